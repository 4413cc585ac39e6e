//! Validation of a run before its first view.

use super::artefacts::some_of;
use super::output::Product;
use super::products::Needs;
use crate::error::PhantomError;
use crate::scan::Acquisition;
use crate::{Counts, Method, Phantom, Regions, Rotation, no_observer};
use std::collections::BTreeSet;

/// Largest number of shapes that are solved.
const MOST_TRIED: usize = 64;

impl Phantom {
    /// Finds errors of a run before it starts, except those below. Solves shapes and defects of projections and volumes, the time steps for a
    /// tolerance and the plan of the reconstruction, which the run reuses. With a given total number of counts, projects views of each gate until one
    /// has counts; otherwise projects no view.
    ///
    /// The time steps and the resolution for a small tolerance can take longer than the views. It has no observer: to be able to end it, call it
    /// in a thread pool whose threads have a watch (`simd_set::watch_with`), and stop the watch.
    ///
    /// Of more than 64 shapes, 64 from the smallest to the largest volume are solved. Errors that remain possible: a full disk, too little
    /// memory, an error of a shape that was not solved.
    ///
    /// ```
    /// use heart_phantom::{Phantom, PhantomError, Background, Scene};
    /// let narrow = Background { concentration: 1.0, centre: [0.0; 2], semi_axes: [4.0, 5.0] };
    /// let scene = Scene { background: Some(narrow), ..Scene::default().with_size(32) };
    /// let error = Phantom::new(scene)?.prepare().unwrap_err();
    /// let PhantomError::Rejected { field, source, .. } = error else { panic!() };
    /// assert_eq!(field, "background.semi_axes");
    /// assert!(matches!(*source, PhantomError::Uncovered { .. }));
    /// # Ok::<(), PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Rejected`] for the first error, with the field of the scene and its place in the file.
    pub fn prepare(&self) -> Result<(), PhantomError> {
        self.try_all().map_err(|error| self.refused(error))
    }

    fn try_all(&self) -> Result<(), PhantomError> {
        let output = &self.scene().output;
        let wants = |product| output.has(product);
        let reconstructs = output.needs(Needs::Reconstruction);
        let sees = output.needs(Needs::Views);
        if sees {
            self.imaging()?;
            if self.scene().scatter.is_some() {
                self.bytes_of_scatter(&self.radii()?)?;
            }
        }
        self.check_available(self.memory().total())?;
        if reconstructs {
            self.try_reconstruction()?;
        }
        let mut gains = self.gains_of_phases();
        if reconstructs && wants(Product::Truth) {
            let masks = Regions::gains(self.cycle());
            gains.extend(masks.into_iter().map(f64::to_bits));
        }
        for gate in 0..self.n_gates() {
            if sees {
                self.scan_of(gate)?
                    .collect_gains(&mut gains, MOST_TRIED + 1);
            }
            if wants(Product::Truth) {
                let states = self.states(gate)?;
                gains.extend(states.iter().map(|state| state.gain.to_bits()));
            }
        }
        self.try_gains(&gains)?;
        if wants(Product::Motion) || !self.scene().points.is_empty() {
            self.wall(self.reference())?;
        }
        if wants(Product::Meshes) {
            let phases = self.phases();
            for scene_phase in phases.iter().take(MOST_TRIED) {
                self.meshes(scene_phase.at)?;
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

    /// Returns the gains of the phases that represent the projections, and those of end-diastole and end-systole.
    fn gains_of_phases(&self) -> BTreeSet<u64> {
        let phases = self.phases().into_iter().map(|phase| phase.at.phase);
        let gains = phases.map(|phase| self.cycle().gain(phase));
        gains
            .chain(self.cycle().gains())
            .map(f64::to_bits)
            .collect()
    }

    /// Solves these shapes; if there are too many, a subset from the smallest to the largest.
    fn try_gains(&self, gains: &BTreeSet<u64>) -> Result<(), PhantomError> {
        let gains = gains.iter().map(|bits| f64::from_bits(*bits)).collect();
        let gains = some_of(gains, MOST_TRIED);
        let scan = self.scan(Acquisition::still(0.0));
        for some in gains.chunks(self.heart().most_shapes()) {
            scan.placed(&self.heart().shapes(some)?)?;
        }
        Ok(())
    }

    /// Checks that a view of each gate has counts; usually the first one has.
    fn try_counts(&self) -> Result<(), PhantomError> {
        for gate in 0..self.n_gates() {
            let seen = |view_idx| -> Result<bool, PhantomError> {
                let part = self.camera().rows_of(view_idx..view_idx + 1);
                let view = self.scan_of(gate)?.rows(part, &no_observer)?;
                Ok(view.samples.iter().any(|sample| *sample > 0.0))
            };
            let mut sees = false;
            for view_idx in 0..self.camera().n_views() {
                sees = sees || seen(view_idx)?;
            }
            if !sees {
                return Err(PhantomError::NoCounts);
            }
        }
        Ok(())
    }
}
