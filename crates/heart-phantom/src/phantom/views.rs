//! Projections of a phantom, with blur and noise.

use super::Phantom;
use crate::error::{PhantomError, check_count, check_length};
use crate::once::once;
use crate::scan::{RowsOfViews, Scan};
use crate::{Observer, ProjectionValues, Sinograms, ViewTime, no_observer};
use radon::ParallelGeometry;
use std::borrow::Cow;

impl Phantom {
    /// Returns times and angle of each view of a gate, without projecting.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate.
    pub fn view_times(&self, gate: usize) -> Result<Vec<ViewTime>, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        Ok(self.parts.view_times(gate))
    }

    /// Returns the geometry of a gate: bins, and angles averaged over the acquisition time of each view. With continuous rotation it differs from
    /// [`Camera::geometry`](crate::Camera::geometry), unless views use their whole interval.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate.
    pub fn geometry(&self, gate: usize) -> Result<ParallelGeometry, PhantomError> {
        if self.camera().ray_geometry().is_some() {
            let what = "parallel geometry: reconstruct fan and cone beams by other programs";
            return Err(PhantomError::Absent { what });
        }
        let angles: Vec<f64> = self
            .view_times(gate)?
            .iter()
            .map(|time| time.angle)
            .collect();
        let (bins, pitch) = (self.parts.camera.n_bins(), self.parts.camera.pitch());
        Ok(ParallelGeometry::from_radians(angles, bins, pitch)?)
    }

    /// Computes a view of a gate, `[row][bin]`, with blur and noise of the scene. Noise of a given total needs all views of the gate once, for
    /// the scale.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate or view; errors of the solver.
    pub fn view(&self, gate: usize, view_idx: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("view", view_idx, [0, self.parts.camera.n_views() - 1])?;
        let part = self.camera().rows_of(view_idx..view_idx + 1);
        Ok(self.take(gate, part, &no_observer)?.samples)
    }

    /// Computes all views of a gate, `[view][row][bin]`. `progress` receives the number of completed views.
    ///
    /// # Errors
    /// As [`Phantom::view`]; [`PhantomError::Stopped`].
    pub fn sinograms(
        &self,
        gate: usize,
        progress: Observer<'_, usize>,
    ) -> Result<Sinograms, PhantomError> {
        self.take(gate, self.camera().all_rows(), progress)
    }

    pub(super) fn take(
        &self,
        gate: usize,
        part: RowsOfViews,
        progress: Observer<'_, usize>,
    ) -> Result<Sinograms, PhantomError> {
        let mut taken = self.means(gate, part.clone(), progress)?;
        self.count((gate, 0), &part, &mut taken.samples)?;
        Ok(taken)
    }

    /// All views of a gate in each energy window of `[scatter]`, the first of them [`Phantom::sinograms`]; these alone without scatter. The
    /// counts of a sample of 1 are the same in all windows.
    ///
    /// # Errors
    /// As [`Phantom::sinograms`].
    pub fn windows(
        &self,
        gate: usize,
        progress: Observer<'_, usize>,
    ) -> Result<Vec<Sinograms>, PhantomError> {
        let primary = self.primary(gate, self.camera().all_rows(), progress)?;
        self.windows_of(gate, primary)
    }

    /// The same from the expected samples of the photons that are not scattered.
    pub(crate) fn windows_of(
        &self,
        gate: usize,
        primary: Sinograms,
    ) -> Result<Vec<Sinograms>, PhantomError> {
        let all = self.camera().all_rows();
        let mut windows = vec![primary; self.n_windows()];
        for (window, taken) in windows.iter_mut().enumerate() {
            self.add_scatter((gate, window), &all, taken)?;
            self.count((gate, window), &all, &mut taken.samples)?;
        }
        Ok(windows)
    }

    /// Draws counts for rows of some views of a gate and an energy window with these expected values.
    pub(super) fn count(
        &self,
        (gate, window): (usize, usize),
        part: &RowsOfViews,
        samples: &mut Vec<f32>,
    ) -> Result<(), PhantomError> {
        let camera = &self.parts.camera;
        let (views, rows) = part;
        let per_unit = if *part == camera.all_rows() && window == 0 {
            self.counts_of(gate, || Ok(Cow::Borrowed(&samples[..])))?
        } else {
            self.counts_per_unit(gate)?
        };
        let first = (window * self.n_gates() + gate) * camera.n_views() + views.start;
        let (Some(noise), Some(per_unit)) = (self.scene().noise, per_unit) else {
            return Ok(());
        };
        let size = [camera.n_bins(), camera.n_rows()];
        noise.count(samples, &per_unit[views.clone()], first, (rows, size))
    }

    /// Returns the expected counts per unit sample in each view of a gate, from the sensitivity of the camera ([`Counting`](crate::Counting)) or
    /// from the noise; `None` without either. A given total needs all views of the gate, once.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn counts_per_unit(&self, gate: usize) -> Result<Option<Vec<f64>>, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        self.counts_of(gate, || {
            let all = self.camera().all_rows();
            Ok(self.means(gate, all, &no_observer)?.samples.into())
        })
    }

    /// The same, from all samples of the gate if needed.
    fn counts_of<'a>(
        &self,
        gate: usize,
        all: impl FnOnce() -> Result<Cow<'a, [f32]>, PhantomError>,
    ) -> Result<Option<Vec<f64>>, PhantomError> {
        if let Some(expected) = self.parts.expected_counts(gate) {
            return Ok(Some(expected));
        }
        let known = once(&self.counts[gate], || {
            (self.scene().noise).map_or(Ok(None), |noise| noise.counts_per_unit(all))
        })?;
        Ok(known.map(|known| vec![known; self.parts.camera.n_views()]))
    }

    /// Returns the sum of the counts of all views of a gate: drawn, which are integers, or expected.
    pub(crate) fn sum_of_counts(&self, samples: &[f32], per_unit: &[f64]) -> f64 {
        let is_drawn = self.scene().noise.is_some();
        let count = |sample: f32, per_unit: f64| {
            if is_drawn {
                f64::from(drawn_count(sample, per_unit))
            } else {
                f64::from(sample) * per_unit
            }
        };
        let views = samples.chunks(self.camera().view_len()).zip(per_unit);
        views
            .flat_map(|(view, per_unit)| view.iter().map(move |sample| count(*sample, *per_unit)))
            .sum()
    }

    /// Returns views `[view][row][bin]` of a gate, from view `first` on, in the quantity of `output.values`: as given, or as the counts of
    /// the noise, which are integers.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate or view; [`PhantomError::WrongLength`] unless `views` are whole views, at most those from
    /// `first` on; as [`Phantom::counts_per_unit`].
    pub fn in_values_of_output<'v>(
        &self,
        gate: usize,
        first: usize,
        views: &'v [f32],
    ) -> Result<Cow<'v, [f32]>, PhantomError> {
        let (n_views, view_len) = (self.camera().n_views(), self.camera().view_len());
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        check_count("view", first, [0, n_views - 1])?;
        let whole = (views.len() / view_len).min(n_views - first);
        check_length("views", views.len(), whole * view_len)?;
        match self.scene().output.values {
            ProjectionValues::Normalised => Ok(views.into()),
            ProjectionValues::Counts => {
                let counts = self.counts_per_unit(gate)?.unwrap_or_default();
                let counts = counts.get(first..).unwrap_or_default();
                Ok(to_counts(views, counts, view_len).into())
            }
        }
    }

    /// Computes the expected samples, without noise.
    pub(crate) fn means(
        &self,
        gate: usize,
        part: RowsOfViews,
        progress: Observer<'_, usize>,
    ) -> Result<Sinograms, PhantomError> {
        let mut taken = self.primary(gate, part.clone(), progress)?;
        self.add_scatter((gate, 0), &part, &mut taken)?;
        Ok(taken)
    }

    /// Expected samples of the photons that are not scattered.
    pub(super) fn primary(
        &self,
        gate: usize,
        part: RowsOfViews,
        progress: Observer<'_, usize>,
    ) -> Result<Sinograms, PhantomError> {
        let scan = Scan {
            imaging: self.imaging()?,
            ..self.scan_of(gate)?
        };
        let taken = scan.rows(part, progress)?;
        self.work.rays(taken.rays);
        Ok(taken)
    }
}

/// Returns the counts before the division by the noise model, from views of `view_len` samples and the counts per unit of each.
pub(crate) fn to_counts(views: &[f32], per_unit: &[f64], view_len: usize) -> Vec<f32> {
    let views = views.chunks(view_len).zip(per_unit);
    views
        .flat_map(|(view, per_unit)| view.iter().map(|sample| drawn_count(*sample, *per_unit)))
        .collect()
}

/// Returns the count before the division by the noise model; rounding removes the error of that division.
fn drawn_count(sample: f32, per_unit: f64) -> f32 {
    (sample * per_unit as f32).round()
}
