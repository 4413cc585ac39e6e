//! All gates together: what several of them see is computed once.

use super::Phantom;
use crate::error::PhantomError;
use crate::scan::{Scan, SharedShapes};
use crate::truth::truth_of_gates;
use revolve_voxel::Organs;

impl Phantom {
    /// The views of all gates, `[gate][view][row][bin]`: those of [`Phantom::sinograms`] of each, to the rounding of their samples. Before
    /// a camera that stops, gates next to each other share a shape of the heart, and those of a beat that falls as it rises most of
    /// them: each is projected once. Of 16 gates of a sinusoid that is a third of the rays.
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
        let shared = match self.depth()?.is_some() || self.wide()?.is_some() {
            true => None,
            false => self.shared_shapes()?,
        };
        let Some(shared) = shared else {
            return self.one_by_one(|gate| Ok(self.sinograms(gate, &|_| ())?.samples));
        };
        let (camera, n_gates) = (self.camera(), self.n_gates());
        let scan = Scan {
            lattice: self.lattice()?,
            ..self.scan(camera, 0, self.acquisition(0)?)
        };
        let (mut samples, rays) = scan.of_gates(n_gates, &shared)?;
        self.work.rays(rays);
        if self.parts.blur.is_some() || self.parts.noise.is_some() {
            let (views, rows) = (0..camera.n_views(), 0..camera.n_rows());
            let length = samples.len() / n_gates;
            for (gate, own) in samples.chunks_mut(length).enumerate() {
                let mut read = own.to_vec();
                self.readout.blur(&mut read, &rows)?;
                self.count(gate, &views, &rows, &mut read)?;
                own.copy_from_slice(&read);
            }
        }
        Ok(samples)
    }

    /// The exact volumes of all gates, `[gate][z][y][x]`: those of [`Phantom::truth`] of each, to the rounding of their samples, with each
    /// shape that several gates see covered once.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn truth_of_gates(&self) -> Result<Vec<f32>, PhantomError> {
        let shared = match self.parts.organs.as_ref().is_some_and(Organs::is_active) {
            true => None,
            false => self.shared_shapes()?,
        };
        let Some(shared) = shared else {
            return self.one_by_one(|gate| self.truth(gate));
        };
        let scan = self.scan(self.camera(), 0, self.acquisition(0)?);
        let tolerance = self.parts.truth_tolerance;
        let (volumes, counters) = truth_of_gates(&scan, self.n_gates(), &shared, tolerance)?;
        self.work.voxels(counters);
        Ok(volumes)
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

    fn one_by_one(
        &self,
        of: impl Fn(usize) -> Result<Vec<f32>, PhantomError>,
    ) -> Result<Vec<f32>, PhantomError> {
        let mut all = of(0)?;
        all.reserve_exact((self.n_gates() - 1) * all.len());
        for gate in 1..self.n_gates() {
            all.extend(of(gate)?);
        }
        Ok(all)
    }
}
