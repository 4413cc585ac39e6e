//! Views of a phantom, with its blur and noise.

use super::Phantom;
use crate::error::{PhantomError, check_count};
use crate::scan::Scan;
use crate::{Sinograms, ViewTime};
use radon::ParallelGeometry;
use std::borrow::Cow;
use std::ops::Range;

impl Phantom {
    /// When and from where each view of a gate is taken; nothing is computed for it.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate.
    pub fn view_times(&self, gate: usize) -> Result<Vec<ViewTime>, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        Ok(self.parts.view_times(gate))
    }

    /// The angles from which the views of a gate are seen, each in the mean over its time, and the bins. Of a camera that turns
    /// all the time they are not those of [`Camera::geometry`](crate::Camera::geometry), unless the views see all of their time.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate.
    pub fn geometry(&self, gate: usize) -> Result<ParallelGeometry, PhantomError> {
        let angles: Vec<f64> = self
            .view_times(gate)?
            .iter()
            .map(|time| time.angle)
            .collect();
        let (bins, pitch) = (self.parts.camera.n_bins(), self.parts.camera.pitch());
        Ok(ParallelGeometry::new(angles, bins, pitch)?)
    }

    /// One view of a gate, `[row][bin]`, with the scene's blur and noise. Noise of a given total needs all views of the gate
    /// once, to know its scale.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate or view; what solving the shapes can return.
    pub fn view(&self, gate: usize, view_idx: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("view", view_idx, [0, self.parts.camera.n_views() - 1])?;
        let rows = 0..self.parts.camera.n_rows();
        Ok(self
            .take(gate, view_idx..view_idx + 1, rows, &|_| ())?
            .samples)
    }

    /// All views of a gate, `[view][row][bin]`. `progress` is told the number of views done.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn sinograms(
        &self,
        gate: usize,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        self.take(
            gate,
            0..self.parts.camera.n_views(),
            0..self.parts.camera.n_rows(),
            progress,
        )
    }

    pub(super) fn take(
        &self,
        gate: usize,
        views: Range<usize>,
        rows: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        let mut taken = self.means(gate, views.clone(), rows.clone(), progress)?;
        self.count(gate, &views, &rows, &mut taken.samples)?;
        Ok(taken)
    }

    /// Counts some rows of some views of a gate, whose means these are.
    pub(super) fn count(
        &self,
        gate: usize,
        views: &Range<usize>,
        rows: &Range<usize>,
        samples: &mut Vec<f32>,
    ) -> Result<(), PhantomError> {
        let camera = &self.parts.camera;
        let per_unit = if (views, rows) == (&(0..camera.n_views()), &(0..camera.n_rows())) {
            self.counts_of(gate, || Ok(Cow::Borrowed(&samples[..])))?
        } else {
            self.counts_per_unit(gate)?
        };
        let first = gate * self.parts.camera.n_views() + views.start;
        let per_unit = (per_unit.as_deref()).map(|per_unit| &per_unit[views.clone()]);
        self.readout.count(samples, per_unit, first, rows)
    }

    /// Mean counts of a sample of 1 in each view of a gate, by the camera's sensitivity ([`Counting`](crate::Counting)), or by the noise,
    /// the same in all; `None` without either. Of a given total it takes all views of the gate, once.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn counts_per_unit(&self, gate: usize) -> Result<Option<Vec<f64>>, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        let camera = &self.parts.camera;
        let (views, rows) = (0..camera.n_views(), 0..camera.n_rows());
        self.counts_of(gate, || {
            Ok(Cow::Owned(self.means(gate, views, rows, &|_| ())?.samples))
        })
    }

    /// The same from all samples of the gate, if they are needed.
    fn counts_of<'a>(
        &self,
        gate: usize,
        all: impl FnOnce() -> Result<Cow<'a, [f32]>, PhantomError>,
    ) -> Result<Option<Vec<f64>>, PhantomError> {
        if let Some(expected) = self.parts.expected_counts(gate) {
            return Ok(Some(expected));
        }
        let known = match self.counts[gate].get() {
            Some(&known) => Some(known),
            None => (self.readout.counts_per_unit(all)?)
                .map(|made| *self.counts[gate].get_or_init(|| made)),
        };
        Ok(known.map(|known| vec![known; self.parts.camera.n_views()]))
    }

    /// Expected samples, without noise.
    pub(crate) fn means(
        &self,
        gate: usize,
        views: Range<usize>,
        rows: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        let (acquisition, depth) = (self.acquisition(gate)?, self.depth()?);
        let camera = depth.map_or(self.camera(), |depth| &depth.camera);
        let scan = Scan {
            depth,
            ..self.scan(camera, gate, acquisition)
        };
        let taken = scan.rows(views, rows, progress)?;
        self.work.rays(taken.rays);
        Ok(taken)
    }
}
