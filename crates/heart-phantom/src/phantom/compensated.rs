//! Reconstructions that are motion-compensated to a reference phase by the exact motion.

use super::Phantom;
use super::artefacts::some_of;
use super::method::{Method, OsemReport};
use crate::error::{PhantomError, check_count, check_length, zeros};
use crate::observer::check_stop;
use crate::scan::Scan;
use crate::truth::{MOST_IN_PASS, check_volumes};
use crate::{Artefacts, Observer};
use radon::add_shifted;
use revolve_voxel::nalgebra::Vector3;

impl Phantom {
    /// Number of volumes that are reconstructed from the projections of all gates: one per gate; with
    /// [`Compensation::KnownMotion`](crate::Compensation::KnownMotion) one per cardiac gate by [`Method::Fbp`], and a single one by [`Method::Osem`].
    #[must_use]
    pub fn n_volumes(&self) -> usize {
        match self.is_compensated() {
            true => self.n_compensated(),
            false => self.n_gates(),
        }
    }

    fn n_compensated(&self) -> usize {
        match self.scene().reconstruction.method {
            Method::Fbp => self.n_cardiac_gates(),
            Method::Osem(_) => 1,
        }
    }

    /// Reconstructs the projections of all gates, `[gate][view][row][bin]`, at a reference phase with the exact motion: an upper bound
    /// for methods that estimate the motion.
    ///
    /// - [`Method::Fbp`] corrects respiratory motion, to end-expiration, in the projections of the cardiac gate `number`: each projection is
    ///   shifted on the detector by the average respiratory displacement during its acquisition, and the projections of the respiratory gates
    ///   are averaged, weighted by their acquisition times. Shifts by whole bins and rows are exact, others interpolate ([`add_shifted`]).
    ///   Cardiac motion within the gate is not corrected.
    /// - [`Method::Osem`] corrects cardiac and respiratory motion, to end-diastole at end-expiration. The model of each gate projects the
    ///   volume that [`Phantom::warps`] maps to that gate, and one volume, `number` 0, fits the projections of all gates. Projections are
    ///   weighted by their expected counts where these are known ([`Phantom::counts_per_unit`]), else by their acquisition time. The
    ///   attenuation map of each gate is that of the gate.
    ///
    /// `progress` receives the number of completed OSEM iterations: 0 before the first, and with FBP.
    ///
    /// ```
    /// use heart_phantom::{Mode, Scene};
    /// use heart_phantom::{Compensation, Method, Osem, Phantom, no_observer};
    /// let mut scene = Scene::default().with_size(24).with_mode(Mode::Gated { gates: 4 });
    /// scene.camera.views = 12;
    /// scene.reconstruction.method = Method::Osem(Osem::new(4, 4));
    /// scene.reconstruction.compensation = Compensation::KnownMotion;
    /// let phantom = Phantom::new(scene)?;
    /// let (volume, report) = phantom.compensated(0, &phantom.sinograms_of_gates()?, &no_observer)?;
    /// let sum = |volume: &[f32]| volume.iter().map(|x| f64::from(*x)).sum::<f64>();
    /// // The total activity, accurate to a few per cent on voxels of two thirds of the wall thickness.
    /// assert!((sum(&volume) / sum(&phantom.compensated_truth(0)?) - 1.0).abs() < 0.05);
    /// assert_eq!(report.map(|report| report.iterations), Some(4));
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such volume; [`PhantomError::Unsupported`] for FBP if respiration rotates the heart, for
    /// OSEM if the total activity of the cavity is constant; as [`Phantom::reconstruct_into`] and [`Phantom::wall`].
    pub fn compensated(
        &self,
        number: usize,
        views: &[f32],
        progress: Observer<'_, usize>,
    ) -> Result<(Vec<f32>, Option<OsemReport>), PhantomError> {
        check_stop(progress(0))?;
        let set = self.camera().n_views() * self.camera().view_len();
        check_length("views of all gates", views.len(), self.n_gates() * set)?;
        match self.scene().reconstruction.method {
            Method::Fbp => {
                let all = self.shifted_back(number, views)?;
                Ok((self.reconstruct(number, &all)?, None))
            }
            Method::Osem(osem) => {
                check_count("volume", number, [0, self.n_compensated() - 1])?;
                let (mut volume, report) = self.osem_of_gates(&osem, views, progress)?;
                self.filter(&mut volume)?;
                Ok((volume, Some(report)))
            }
        }
    }

    /// The ground truth of [`Phantom::compensated`], `[z][y][x]`: for [`Method::Fbp`] the average over the cardiac gate at
    /// end-expiration, for [`Method::Osem`] the activity at end-diastole and end-expiration.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such volume; as [`Phantom::truth`].
    pub fn compensated_truth(&self, number: usize) -> Result<Vec<f32>, PhantomError> {
        let slices = 0..self.camera().n_rows();
        self.at_time_of(number, |scan| self.truth_slices(scan, slices))
    }

    /// Calls `of` with the scan at the time that a motion-compensated volume represents.
    fn at_time_of<T>(
        &self,
        number: usize,
        of: impl FnOnce(&Scan<'_>) -> Result<T, PhantomError>,
    ) -> Result<T, PhantomError> {
        check_count("volume", number, [0, self.n_compensated() - 1])?;
        match self.scene().reconstruction.method {
            Method::Fbp => of(&Scan {
                cycle: &self.cycle().clone().without_breathing(),
                ..self.heart_scan(number)?
            }),
            Method::Osem(_) => self.at_motion_phase(self.reference(), of),
        }
    }

    /// Compares a motion-compensated volume with its ground truth, as [`Phantom::artefacts`] does for a gate.
    ///
    /// # Errors
    /// As [`Phantom::compensated_truth`] and [`Phantom::artefacts`].
    pub fn compensated_artefacts(
        &self,
        number: usize,
        volume: &[f32],
        truth: &[f32],
    ) -> Result<Artefacts, PhantomError> {
        check_volumes(volume, Some(truth), self.camera().grid())?;
        let wall = self.at_time_of(number, |scan| self.wall_alone(scan, truth))?;
        let gains: Vec<f64> = match self.scene().reconstruction.method {
            Method::Fbp => {
                let states = self.states(number)?;
                let gains = states.iter().map(|state| state.gain).collect();
                some_of(gains, MOST_IN_PASS)
            }
            Method::Osem(_) => vec![self.cycle().gain(self.reference().phase)],
        };
        let regions = self.regions_at(&gains, &[0.0])?;
        self.judged(&regions, 0.0, volume, [truth, &wall])
    }

    /// The projections of a cardiac gate with respiratory motion corrected to end-expiration, `[view][row][bin]`, from those of all gates.
    fn shifted_back(&self, gate: usize, views: &[f32]) -> Result<Vec<f32>, PhantomError> {
        let cardiac = self.n_cardiac_gates();
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
        let sets = (gate..self.n_gates()).step_by(cardiac);
        let sets = sets.map(|set| Ok::<_, PhantomError>((set, self.view_times(set)?)));
        let sets = sets.collect::<Result<Vec<_>, _>>()?;
        let seconds = |k: usize| sets.iter().map(|(_, times)| times[k].window).sum::<f64>();
        let len = camera.n_views() * camera.view_len();
        let mut all: Vec<f32> = zeros("samples of the projections", len)?;
        for (set, times) in &sets {
            let breaths = self.heart_scan(*set)?.breaths_of_views();
            let pairs = views[set * len..][..len]
                .chunks(camera.view_len())
                .zip(all.chunks_mut(camera.view_len()));
            for (k, (view, sum)) in pairs.enumerate() {
                let (sin, cos) = times[k].angle.sin_cos();
                let moved = shift * breaths[k];
                let by = [(moved.x * cos + moved.y * sin) / bin, moved.z / row];
                let seconds = seconds(k);
                let weight = match seconds > 0.0 {
                    true => times[k].window / seconds,
                    false => 1.0,
                };
                add_shifted(view, size, by, weight, sum)?;
            }
        }
        Ok(all)
    }
}
