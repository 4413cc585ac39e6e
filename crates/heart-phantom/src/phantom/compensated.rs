//! All that the views see in one frame, the exact motion taken back.

use super::Phantom;
use super::method::{Compensation, Method, OsemReport};
use crate::Artefacts;
use crate::error::{PhantomError, check_count, check_length};
use radon::add_shifted;
use revolve_voxel::nalgebra::Vector3;
use std::borrow::Cow;

impl Phantom {
    /// Volumes that are made of the views of all gates: one of each gate, or with [`Compensation::KnownMotion`] by [`Method::Fbp`] one of
    /// each cardiac gate, by [`Method::Osem`] one of all.
    pub fn n_volumes(&self) -> usize {
        match (
            self.scene().reconstruction.compensation,
            self.scene().reconstruction.method,
        ) {
            (Compensation::None, _) => self.n_gates(),
            (Compensation::KnownMotion, Method::Fbp) => self.scene().acquisition.mode.n_gates(),
            (Compensation::KnownMotion, Method::Osem(_)) => 1,
        }
    }

    /// A volume of the views of all gates, `[gate][view][row][bin]`, in one frame, the exact motion known: the upper bound of what
    /// methods can reach that have to find it.
    ///
    /// - By [`Method::Fbp`] breathing is taken back, to end-expiration, from views of the cardiac gate `number`
    ///   ([`Phantom::compensated_views`]).
    /// - By [`Method::Osem`] breath and beat are, to end-diastole at end-expiration: each gate's model is that of its views on the volume
    ///   that [`Phantom::warps`] moves there, and one volume explains the views of all gates, `number` 0. Views count by their counts,
    ///   where these are known ([`Phantom::counts_per_unit`]), else by the seconds that they saw. What attenuates is where it was in each
    ///   gate.
    ///
    /// `progress` is told the number of OSEM's passes done.
    ///
    /// ```
    /// use heart_phantom::scene::{Mode, Scene};
    /// use heart_phantom::{Compensation, Method, Osem, Phantom};
    /// let mut scene = Scene::default().with_size(24).with_mode(Mode::Gated { gates: 4 });
    /// scene.camera.views = 12;
    /// scene.reconstruction.method = Method::Osem(Osem::new(4, 4));
    /// scene.reconstruction.compensation = Compensation::KnownMotion;
    /// let phantom = Phantom::new(scene)?;
    /// let (volume, report) = phantom.compensated(0, &phantom.sinograms_of_gates()?, &|_| ())?;
    /// let sum = |volume: &[f32]| volume.iter().map(|x| f64::from(*x)).sum::<f64>();
    /// // The whole activity, to some hundredths on voxels two thirds as coarse as the wall is thick.
    /// assert!((sum(&volume) / sum(&phantom.compensated_truth(0)?) - 1.0).abs() < 0.05);
    /// assert_eq!(report.map(|report| report.iterations), Some(4));
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such volume; [`PhantomError::Unsupported`] for a breath that turns the heart by FBP, or by
    /// OSEM a cavity whose total activity is kept; as [`Phantom::reconstruct`] and [`Phantom::wall`].
    pub fn compensated(
        &self,
        number: usize,
        views: &[f32],
        progress: &dyn Fn(usize),
    ) -> Result<(Vec<f32>, Option<OsemReport>), PhantomError> {
        let set = self.camera().n_views() * self.camera().view_len();
        check_length("views of all gates", views.len(), self.n_gates() * set)?;
        match self.scene().reconstruction.method {
            Method::Fbp => {
                let seen = |gate: usize| Ok(Cow::Borrowed(&views[gate * set..][..set]));
                let all = self.shifted_back(number, seen)?;
                Ok((self.reconstruct(number, &all)?, None))
            }
            Method::Osem(osem) => {
                check_count("volume", number, [0, 0])?;
                let (volume, report) = self.osem_of_gates(&osem, views, progress)?;
                Ok((volume, Some(report)))
            }
        }
    }

    /// The exact volume that [`Phantom::compensated`] is to find, `[z][y][x]`: by [`Method::Fbp`] the mean over the cardiac gate at
    /// end-expiration, by [`Method::Osem`] the heart at end-diastole and end-expiration.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such volume; as [`Phantom::truth`].
    pub fn compensated_truth(&self, number: usize) -> Result<Vec<f32>, PhantomError> {
        match self.scene().reconstruction.method {
            Method::Fbp => {
                check_count(
                    "gate",
                    number,
                    [0, self.scene().acquisition.mode.n_gates() - 1],
                )?;
                let slices = 0..self.camera().n_rows();
                self.at_end_expiration(number, |scan| self.truth_slices(scan, slices))
            }
            Method::Osem(_) => {
                check_count("volume", number, [0, 0])?;
                self.activity(self.reference())
            }
        }
    }

    /// How a volume in one frame compares with the truth there, as [`Phantom::artefacts`] of a gate.
    ///
    /// # Errors
    /// As [`Phantom::compensated_truth`] and [`Phantom::artefacts`].
    pub fn compensated_artefacts(
        &self,
        number: usize,
        volume: &[f32],
        truth: &[f32],
    ) -> Result<Artefacts, PhantomError> {
        let (gains, wall) = match self.scene().reconstruction.method {
            Method::Fbp => {
                let scan = self.scan(self.camera(), number, self.acquisition(number)?);
                let gains = scan.times()?.iter().map(|state| state.gain).collect();
                (
                    gains,
                    self.at_end_expiration(number, |scan| self.wall_alone(scan, truth))?,
                )
            }
            Method::Osem(_) => {
                let at = self.reference();
                (
                    vec![self.cycle().gain(at.phase)],
                    self.at_moment(at, |scan| self.wall_alone(scan, truth))?,
                )
            }
        };
        let regions = self.regions_at(&gains, &[0.0])?;
        self.judged(&regions, 0.0, volume, [truth, &wall])
    }

    /// All sets of views of a heart that breathes, in the frame of end-expiration: each view is moved on the detector by what the breath
    /// has shifted the heart in the mean over what it sees, and sets are added by the seconds that they saw. `[view][row][bin]`, for
    /// [`Phantom::reconstruct`] of the same gate.
    ///
    /// Shifts by whole bins and rows are exact, others interpolate ([`add_shifted`]); a cardiac gate keeps its beat, which is not
    /// compensated: of cardiac gates those of `gate` are taken.
    ///
    /// ```
    /// use heart_phantom::scene::{Breathing, Mode, RespiratoryGates, Scene};
    /// use heart_phantom::Phantom;
    /// let mut scene = Scene::default().with_size(16).with_mode(Mode::Static { phase: 0.0 });
    /// (scene.camera.views, scene.camera.seconds_per_view) = (8, 4.0);
    /// let breathing = Breathing { shift: [0.0, 0.0, -2.0], ..Breathing::default() };
    /// scene.breathing = Some(Breathing { gates: Some(RespiratoryGates::Amplitude(4)), ..breathing });
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
        self.shifted_back(gate, |set| {
            Ok(Cow::Owned(self.sinograms(set, &|_| ())?.samples))
        })
    }

    /// The same of views that are there, or are made.
    fn shifted_back<'a>(
        &self,
        gate: usize,
        seen: impl Fn(usize) -> Result<Cow<'a, [f32]>, PhantomError>,
    ) -> Result<Vec<f32>, PhantomError> {
        let cardiac = self.scene().acquisition.mode.n_gates();
        check_count("gate", gate, [0, cardiac - 1])?;
        let breathing = self.cycle().breathing();
        if breathing.is_some_and(|breathing| breathing.turn() != [0.0; 3]) {
            return Err(PhantomError::Unsupported {
                format: "a shift of views",
                what: "rotation by breathing",
            });
        }
        let shift = breathing.map_or(Vector3::zeros(), |b| Vector3::from(b.breathing().shift));
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
            let views = seen(set)?;
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
