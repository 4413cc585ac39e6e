//! Views of a breathing heart in one frame: that of end-expiration, each moved back by what the breath has moved it.

use super::Phantom;
use crate::error::PhantomError;
use radon::add_shifted;
use revolve_voxel::nalgebra::Vector3;

impl Phantom {
    /// All sets of views of a heart that breathes, in the frame of end-expiration: each view is moved on the detector by what the breath
    /// has shifted the heart in the mean over what it sees, and sets are added by the seconds that they saw. `[view][row][bin]`, for
    /// [`Phantom::reconstruct`] of set 0.
    ///
    /// With narrow respiratory gates this is what motion-compensated methods are measured against: the exact motion is known. Shifts by
    /// whole bins and rows are exact, others interpolate ([`add_shifted`]); a cardiac gate keeps its beat, which is not compensated: of
    /// cardiac gates those of `gate` are taken.
    ///
    /// ```
    /// use heart_phantom::scene::{BreathingSettings, Mode, RespiratoryGates, Scene};
    /// use heart_phantom::Phantom;
    /// let mut scene = Scene::default().with_size(16).with_mode(Mode::Static { phase: 0.0 });
    /// (scene.camera.views, scene.camera.seconds_per_view) = (8, 4.0);
    /// let breathing = BreathingSettings { shift: [0.0, 0.0, -2.0], ..BreathingSettings::default() };
    /// scene.breathing = Some(BreathingSettings { gates: Some(RespiratoryGates::Amplitude(4)), ..breathing });
    /// let phantom = Phantom::new(scene)?;
    /// let volume = phantom.reconstruct(0, &phantom.compensated_views(0)?)?;
    /// # let _ = volume;
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Unsupported`] for a breath that turns the heart: no shift of a view undoes that; [`PhantomError::Count`] if there is
    /// no such cardiac gate; as [`Phantom::sinograms`].
    pub fn compensated_views(&self, gate: usize) -> Result<Vec<f32>, PhantomError> {
        let cardiac = self.parts().mode.n_gates();
        crate::error::check_count("gate", gate, [0, cardiac - 1])?;
        let breathing = self.cycle().breathing();
        if breathing.is_some_and(|breathing| breathing.turn() != [0.0; 3]) {
            return Err(PhantomError::Unsupported {
                format: "a shift of views",
                what: "a breath that turns the heart",
            });
        }
        let shift = breathing.map_or(Vector3::zeros(), |b| Vector3::from(b.shift()));
        let camera = self.camera();
        let (size, [bin, row]) = (
            [camera.n_bins(), camera.n_rows()],
            camera.detector().pitch(),
        );
        let sets: Vec<usize> = (gate..self.n_gates()).step_by(cardiac).collect();
        let mut seconds = vec![0.0; camera.n_views()];
        for &set in &sets {
            for (sum, time) in seconds.iter_mut().zip(self.view_times(set)?) {
                *sum += time.window;
            }
        }
        let mut all = vec![0.0f32; camera.n_views() * camera.view_len()];
        for set in sets {
            let views = self.sinograms(set, &|_| ())?.samples;
            let breaths = (self.scan(camera, set, self.acquisition(set)?)).breaths_of_views();
            let times = self.view_times(set)?;
            let pairs = views
                .chunks(camera.view_len())
                .zip(all.chunks_mut(camera.view_len()));
            for (k, (view, sum)) in pairs.enumerate() {
                let (sin, cos) = times[k].angle.sin_cos();
                let moved = shift * breaths[k];
                let by = [(moved.x * cos + moved.y * sin) / bin, moved.z / row];
                let weight = match seconds[k] > 0.0 {
                    true => times[k].window / seconds[k],
                    false => 1.0,
                };
                add_shifted(view, size, by, weight, sum)?;
            }
        }
        Ok(all)
    }
}
