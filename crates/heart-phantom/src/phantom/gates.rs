//! Projections and ground truth of all gates: shapes that gates share are computed once.

use super::Phantom;
use crate::error::{PhantomError, check_length};
use crate::scan::SharedShapes;
use crate::truth::truth_of_gates_into;
use revolve_voxel::Organs;

impl Phantom {
    /// The projections of all gates, `[gate][view][row][bin]`: those of [`Phantom::sinograms`] of each gate, to the rounding of the samples.
    /// With step-and-shoot rotation, adjacent gates share a shape of the heart, and the gates of a symmetric volume curve share most of
    /// them; each shape is projected once. For 16 gates of a sinusoid this takes a third of the rays.
    ///
    /// ```
    /// use heart_phantom::{Phantom, Scene, scene::Mode};
    /// let scene = Scene::default().with_size(16).with_mode(Mode::Gated { gates: 8 });
    /// let together = Phantom::new(scene.clone())?;
    /// assert_eq!(together.sinograms_of_gates()?.len(), 8 * 90 * 16 * 16);
    /// let one_by_one = Phantom::new(scene)?;
    /// for gate in 0..8 {
    ///     one_by_one.sinograms(gate, &|_| ())?;
    /// }
    /// assert!(2 * together.work().rays_cast < one_by_one.work().rays_cast);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn sinograms_of_gates(&self) -> Result<Vec<f32>, PhantomError> {
        let views = self.camera().n_views() * self.camera().view_len();
        let mut samples = vec![0.0f32; self.n_gates() * views];
        self.sinograms_of_gates_into(&mut samples)?;
        Ok(samples)
    }

    /// The same into memory of the caller's, whatever is in it: some that is used again costs no new pages.
    ///
    /// # Errors
    /// As [`Phantom::view`]; [`PhantomError::WrongLength`] for other than [`Phantom::n_gates`] times the samples of a gate's views.
    pub fn sinograms_of_gates_into(&self, samples: &mut [f32]) -> Result<(), PhantomError> {
        let camera = self.camera();
        let each = camera.n_views() * camera.view_len();
        check_length("views of all gates", samples.len(), self.n_gates() * each)?;
        let shared = match self.depth()?.is_some() {
            true => None,
            false => self.shared_shapes()?,
        };
        let Some(shared) = shared else {
            let one = |gate| Ok(self.sinograms(gate, &|_| ())?.samples);
            return one_by_one(samples, each, one);
        };
        let scan = self.scan(camera, 0, self.acquisition(0)?);
        self.work.rays(scan.of_gates_into(&shared, samples)?);
        if self.scene().noise.is_some() {
            let (views, rows) = (0..camera.n_views(), 0..camera.n_rows());
            for (gate, own) in samples.chunks_mut(each).enumerate() {
                let mut read = own.to_vec();
                self.count(gate, &views, &rows, &mut read)?;
                own.copy_from_slice(&read);
            }
        }
        Ok(())
    }

    /// The ground truth of all gates, `[gate][z][y][x]`: that of [`Phantom::truth`] of each gate, to the rounding of the samples. Each shape
    /// that several gates share is voxelised once.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn truth_of_gates(&self) -> Result<Vec<f32>, PhantomError> {
        let mut volumes = vec![0.0f32; self.n_gates() * self.camera().grid().len()];
        self.truth_of_gates_into(&mut volumes)?;
        Ok(volumes)
    }

    /// The same into memory of the caller's, whatever is in it.
    ///
    /// # Errors
    /// As [`Phantom::view`]; [`PhantomError::WrongLength`] for other than [`Phantom::n_gates`] times the voxels.
    pub fn truth_of_gates_into(&self, volumes: &mut [f32]) -> Result<(), PhantomError> {
        let each = self.camera().grid().len();
        check_length("volumes of all gates", volumes.len(), self.n_gates() * each)?;
        let shared = match self.parts.organs.as_ref().is_some_and(Organs::is_active) {
            true => None,
            false => self.shared_shapes()?,
        };
        let Some(shared) = shared else {
            return one_by_one(volumes, each, |gate| self.truth(gate));
        };
        let scan = self.scan(self.camera(), 0, self.acquisition(0)?);
        let tolerance = self.scene().truth.tolerance;
        let counters = truth_of_gates_into(&scan, &shared, tolerance, volumes)?;
        self.work.voxels(counters);
        Ok(())
    }

    fn shared_shapes(&self) -> Result<Option<SharedShapes>, PhantomError> {
        if self.n_gates() == 1 {
            return Ok(None);
        }
        let scans = (0..self.n_gates())
            .map(|gate| Ok(self.scan(self.camera(), gate, self.acquisition(gate)?)))
            .collect::<Result<Vec<_>, PhantomError>>()?;
        SharedShapes::of(&scans)
    }
}

/// Computes the gates one after the other.
fn one_by_one(
    all: &mut [f32],
    each: usize,
    of: impl Fn(usize) -> Result<Vec<f32>, PhantomError>,
) -> Result<(), PhantomError> {
    for (gate, own) in all.chunks_mut(each).enumerate() {
        own.copy_from_slice(&of(gate)?);
    }
    Ok(())
}
