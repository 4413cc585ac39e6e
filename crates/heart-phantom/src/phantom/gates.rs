//! Projections and ground truth of all gates: shapes that gates share are computed once.

use super::Phantom;
use super::output::Product;
use super::products::Needs;
use crate::error::{PhantomError, check_length, zeros};
use crate::scan::{Interpolation, STEPS, Scan, Total};
use crate::scene::WORK_BYTES;
use crate::truth::{SharedShapes, truth_of_gates_into};
use crate::{Observer, Sinograms, no_observer};
use revolve_voxel::Organs;
use std::collections::BTreeSet;

impl Phantom {
    /// The projections of all gates, `[gate][view][row][bin]`: those of [`Phantom::sinograms`] of each gate, to the rounding of the samples.
    /// With step-and-shoot rotation, adjacent gates share a shape of the heart, and the gates of a symmetric volume curve share most of
    /// them; each shape is projected once. For 16 gates of a sinusoid this takes a third of the rays.
    ///
    /// ```
    /// use heart_phantom::{Phantom, Scene, no_observer, Mode};
    /// let scene = Scene::default().with_size(16).with_mode(Mode::Gated { gates: 8 });
    /// let together = Phantom::new(scene.clone())?;
    /// assert_eq!(together.sinograms_of_gates()?.len(), 8 * 90 * 16 * 16);
    /// let one_by_one = Phantom::new(scene)?;
    /// for gate in 0..8 {
    ///     one_by_one.sinograms(gate, &no_observer)?;
    /// }
    /// assert!(2 * together.work().rays_cast < one_by_one.work().rays_cast);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn sinograms_of_gates(&self) -> Result<Vec<f32>, PhantomError> {
        let views = self.camera().n_views() * self.camera().view_len();
        let mut samples = zeros("samples of the projections", self.n_gates() * views)?;
        self.sinograms_of_gates_into(&mut samples)?;
        Ok(samples)
    }

    /// As [`Phantom::sinograms_of_gates`], into a buffer of the caller; reused buffers need no new memory pages.
    ///
    /// # Errors
    /// As [`Phantom::view`]; [`PhantomError::WrongLength`] if the length is not [`Phantom::n_gates`] times that of a projection set.
    pub fn sinograms_of_gates_into(&self, samples: &mut [f32]) -> Result<(), PhantomError> {
        let camera = self.camera();
        let each = camera.n_views() * camera.view_len();
        check_length("views of all gates", samples.len(), self.n_gates() * each)?;
        let made = self.primary_of_gates_into(samples, &no_observer)?;
        if self.scene().noise.is_some() || self.scene().scatter.is_some() {
            for (gate, (one, own)) in made.into_iter().zip(samples.chunks_mut(each)).enumerate() {
                let samples = own.to_vec();
                let windows = self.windows_of(gate, Sinograms { samples, ..one })?;
                own.copy_from_slice(&windows[0].samples);
            }
        }
        Ok(())
    }

    /// Returns `[images, states]`: the number of images of the heart in the views of all gates, estimated from the first view of each, and the
    /// number of states of the heart in the ground truth of all gates, which may share some. Most of the time of a run is proportional to them.
    /// 0 for what the scene does not write.
    ///
    /// # Errors
    /// As [`Phantom::prepare`].
    pub fn images_and_states(&self) -> Result<[usize; 2], PhantomError> {
        let output = &self.scene().output;
        let (mut images, mut states) = (BTreeSet::new(), 0);
        for gate in 0..self.n_gates() {
            if output.needs(Needs::Views) {
                let scan = self.scan_of(gate)?;
                // Equal images of gates that share them are one.
                let set = if self.shares_images() { 0 } else { gate };
                images.extend(scan.images(0).into_iter().map(|image| (set, image)));
            }
            if output.has(Product::Truth) {
                states += self.states(gate)?.len();
            }
        }
        Ok([images.len() * self.camera().n_views(), states])
    }

    /// Whether the gates are sums over the same images, which fit into memory together.
    pub(crate) fn shares_images(&self) -> bool {
        let each = self.camera().n_views() * self.camera().view_len();
        let interpolation = self.acquisition_of(0, STEPS[0]).interpolation;
        self.n_gates() > 1
            && interpolation == Interpolation::Polynomial
            && 4 * self.n_gates() * each <= WORK_BYTES
    }

    /// Expected samples of the photons of each gate that are not scattered; `progress` receives the number of views done.
    pub(crate) fn primary_of_gates(
        &self,
        progress: Observer<'_, usize>,
    ) -> Result<Vec<Sinograms>, PhantomError> {
        let each = self.camera().n_views() * self.camera().view_len();
        let mut samples = zeros("samples of the projections", self.n_gates() * each)?;
        let mut made = self.primary_of_gates_into(&mut samples, progress)?;
        for (one, own) in made.iter_mut().zip(samples.chunks(each)) {
            one.samples = own.to_vec();
        }
        Ok(made)
    }

    /// The same, `[gate][view][row][bin]`; the result has one entry per gate, without samples.
    fn primary_of_gates_into(
        &self,
        samples: &mut [f32],
        progress: Observer<'_, usize>,
    ) -> Result<Vec<Sinograms>, PhantomError> {
        let imaging = self.imaging()?;
        let sets = (0..self.n_gates())
            .map(|gate| {
                Ok(Scan {
                    imaging,
                    ..self.scan_of(gate)?
                })
            })
            .collect::<Result<Vec<_>, PhantomError>>()?;
        let all = self.camera().all_rows();
        let mut totals: Vec<Total> = sets.iter().map(|_| Total::default()).collect();
        Scan::sets_into(&sets, all, samples, &mut totals, progress)?;
        let of_set = |(set, total): (&Scan<'_>, &Total)| set.without_samples(total);
        let made: Vec<Sinograms> = sets.iter().zip(&totals).map(of_set).collect();
        made.iter().for_each(|of_gate| self.work.rays(of_gate.rays));
        Ok(made)
    }

    /// The ground truth of all gates, `[gate][z][y][x]`: that of [`Phantom::truth`] of each gate, to the rounding of the samples. Each shape
    /// that several gates share is voxelised once.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn truth_of_gates(&self) -> Result<Vec<f32>, PhantomError> {
        let mut volumes = zeros(
            "voxels of the ground truth",
            self.n_gates() * self.camera().grid().len(),
        )?;
        self.truth_of_gates_into(&mut volumes)?;
        Ok(volumes)
    }

    /// As [`Phantom::truth_of_gates`], into a buffer of the caller.
    ///
    /// # Errors
    /// As [`Phantom::view`]; [`PhantomError::WrongLength`] if the length is not [`Phantom::n_gates`] times the number of voxels.
    pub fn truth_of_gates_into(&self, volumes: &mut [f32]) -> Result<(), PhantomError> {
        let each = self.camera().grid().len();
        check_length("volumes of all gates", volumes.len(), self.n_gates() * each)?;
        let shared = match self.parts.organs.as_ref().is_some_and(Organs::is_active) {
            true => None,
            false => self.shared_shapes()?,
        };
        let Some(shared) = shared else {
            for (_part, (gate, own)) in simd_set::parts(volumes.chunks_mut(each).enumerate()) {
                own.copy_from_slice(&self.truth(gate)?);
            }
            return Ok(());
        };
        let scan = self.heart_scan(0)?;
        let tolerance = self.scene().truth.tolerance;
        let counters = truth_of_gates_into(&scan, &shared, tolerance, volumes)?;
        self.work.voxels(counters);
        Ok(())
    }

    /// Collects the shapes of all gates. Returns `None` for a single gate, if views differ in their states or the heart breathes, and if the
    /// shapes exceed the memory of the heart.
    fn shared_shapes(&self) -> Result<Option<SharedShapes>, PhantomError> {
        if self.n_gates() == 1 {
            return Ok(None);
        }
        let mut shapes = SharedShapes::new();
        for gate in 0..self.n_gates() {
            let scan = self.heart_scan(gate)?;
            let alike = (scan.acquisition).same_for_all_views(scan.cycle, scan.camera);
            if scan.cycle.breathing().is_some() || !alike {
                return Ok(None);
            }
            for state in self.states(gate)? {
                let uses = shapes.entry(state.gain.to_bits()).or_default();
                uses.push((gate, state.share));
            }
        }
        Ok((shapes.len() <= self.heart().most_shapes()).then_some(shapes))
    }
}
