//! Everything that a run of a scene could be refused for, found before it takes a view.

use super::memory::check_memory;
use super::output::Product;
use super::products::Needs;
use crate::error::PhantomError;
use crate::scan::{Acquisition, Counts};
use crate::{Method, Phantom, Regions, Rotation};
use std::collections::BTreeSet;

/// Most shapes that are tried: of more, some between the smallest and the largest.
const MOST_TRIED: usize = 64;

impl Phantom {
    /// Finds everything that `run` of the scene could be refused for, and solves for it what a run needs anyhow: the
    /// shapes of the heart that views and volumes see, with the defects in them, the steps that meet a tolerance, the plan of the
    /// reconstruction. No view is taken, but for one of each gate where counts have a total: there has to be something to count.
    ///
    /// Of more than 64 shapes so many are tried, from the smallest volume to the largest one. What is left is a disk that is full, a
    /// memory that is not enough, and a shape among those that were not tried.
    ///
    /// ```
    /// use heart_phantom::{Phantom, PhantomError, scene::{Background, Scene}};
    /// let narrow = Background { concentration: 1.0, centre: [0.0; 2], semi_axes: [4.0, 5.0] };
    /// let scene = Scene { background: Some(narrow), ..Scene::default().with_size(32) };
    /// let error = Phantom::new(scene)?.prepare().unwrap_err();
    /// let PhantomError::Refused { field, source, .. } = error else { panic!() };
    /// assert_eq!(field, "background.semi_axes");
    /// assert!(matches!(*source, PhantomError::Uncovered { .. }));
    /// # Ok::<(), PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Refused`] for the first reason, with the field of the scene and its place in the file if it came from one.
    pub fn prepare(&self) -> Result<(), PhantomError> {
        self.try_all().map_err(|error| self.refused(error))
    }

    fn try_all(&self) -> Result<(), PhantomError> {
        let output = &self.scene().output;
        let wants = |product| output.has(product);
        let reconstructs = output.needs(Needs::Reconstruction);
        let sees = output.needs(Needs::Views);
        if sees {
            self.depth()?;
        }
        check_memory(self.memory().total())?;
        if reconstructs {
            self.try_reconstruction()?;
        }
        let mut gains = self.gains_of_phases();
        if reconstructs && wants(Product::Truth) {
            let masks = Regions::gains(self.cycle());
            gains.extend(masks.into_iter().map(f64::to_bits));
        }
        if sees || wants(Product::Truth) {
            self.add_gains_of_views(&mut gains)?;
        }
        self.try_gains(&gains)?;
        if wants(Product::Motion) || !self.scene().points.is_empty() {
            self.wall(self.reference())?;
        }
        if wants(Product::Meshes) {
            let phases = self.phases();
            for scene_phase in phases.iter().take(MOST_TRIED) {
                self.meshes(scene_phase.moment())?;
            }
        }
        let counts = self.scene().noise.map(|noise| noise.counts);
        if let (true, Some(Counts::Total(_))) = (sees, counts) {
            self.try_counts()?;
        }
        Ok(())
    }

    fn try_reconstruction(&self) -> Result<(), PhantomError> {
        if let Method::Osem(osem) = &self.scene().reconstruction.method {
            return self.try_model(osem, 0);
        }
        self.plan(0)?;
        if let Rotation::Continuous = self.camera().rotation() {
            let policy = self.scene().reconstruction.arc;
            for gate in 1..self.n_gates() {
                self.geometry(gate)?.view_weights(policy)?;
            }
        }
        Ok(())
    }

    /// Those of all views; or, where there are too many, some of the first ones, from the smallest to the largest.
    fn add_gains_of_views(&self, gains: &mut BTreeSet<u64>) -> Result<(), PhantomError> {
        for gate in 0..self.n_gates() {
            let scan = self.scan(self.camera(), gate, self.acquisition(gate)?);
            scan.collect_gains(gains, MOST_TRIED + 1);
        }
        if gains.len() > MOST_TRIED {
            let all: Vec<u64> = std::mem::take(gains).into_iter().collect();
            let step = (all.len() - 1) as f64 / (MOST_TRIED - 1) as f64;
            *gains = (0..MOST_TRIED)
                .map(|k| all[(k as f64 * step).round() as usize])
                .collect();
        }
        Ok(())
    }

    /// Those of the phases that stand for the views, and both ends of the beat.
    fn gains_of_phases(&self) -> BTreeSet<u64> {
        let phases = self.phases().into_iter().map(|phase| phase.phase);
        let gains = phases.map(|phase| self.cycle().gain(phase));
        gains
            .chain(self.cycle().gains())
            .map(f64::to_bits)
            .collect()
    }

    fn try_gains(&self, gains: &BTreeSet<u64>) -> Result<(), PhantomError> {
        let gains: Vec<f64> = gains.iter().map(|bits| f64::from_bits(*bits)).collect();
        let scan = self.scan(self.camera(), 0, Acquisition::still(0.0));
        for some in gains.chunks(self.heart().most_shapes()) {
            scan.placed(&self.heart().shapes(some)?)?;
        }
        Ok(())
    }

    /// Whether the camera sees anything to count: the first view as a rule.
    fn try_counts(&self) -> Result<(), PhantomError> {
        for gate in 0..self.n_gates() {
            let seen = |view_idx| -> Result<bool, PhantomError> {
                let rows = 0..self.camera().n_rows();
                let scan = self.scan(self.camera(), gate, self.acquisition(gate)?);
                let view = scan.rows(view_idx..view_idx + 1, rows, &|_| ())?;
                Ok(view.samples.iter().any(|sample| *sample > 0.0))
            };
            let mut sees = false;
            for view_idx in 0..self.camera().n_views() {
                sees = sees || seen(view_idx)?;
            }
            if !sees {
                return Err(PhantomError::NothingToCount);
            }
        }
        Ok(())
    }
}
