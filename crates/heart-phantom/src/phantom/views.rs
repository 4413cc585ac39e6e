//! Views of a phantom, with its blur and noise.

use super::memory::check_memory;
use super::{Phantom, once};
use crate::error::{PhantomError, check_count};
use crate::scan::{Collimation, Depth, Facing, Scan, Wide};
use crate::scene::BlurSettings;
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

    /// Line integrals, blurred but without noise.
    pub(crate) fn means(
        &self,
        gate: usize,
        views: Range<usize>,
        rows: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        let acquisition = self.acquisition(gate)?;
        let lattice = self.lattice()?;
        if let Some(depth) = self.depth()? {
            let [_, above] = depth.margin;
            let scan = Scan {
                depth: Some(depth),
                lattice,
                ..self.scan(&depth.camera, gate, acquisition)
            };
            let rows_there = rows.start + above..rows.end + above;
            let mut taken = scan.rows(views, rows_there, progress)?;
            self.work.rays(taken.rays);
            taken.samples = self.middle(&taken.samples, depth.margin[0]);
            return Ok(taken);
        }
        let Some(wide) = self.wide()? else {
            let cast = self.readout.rows_seen(&rows);
            let scan = Scan {
                lattice,
                ..self.scan(self.camera(), gate, acquisition)
            };
            let mut taken = scan.rows(views, cast, progress)?;
            self.work.rays(taken.rays);
            self.readout.blur(&mut taken.samples, &rows)?;
            return Ok(taken);
        };
        let [beside, above] = wide.margin;
        let rows = rows.start + above..rows.end + above;
        let cast = wide.blur.rows_seen(&rows);
        let scan = Scan {
            lattice,
            ..self.scan(&wide.camera, gate, acquisition)
        };
        let mut taken = scan.rows(views, cast, progress)?;
        self.work.rays(taken.rays);
        let blurred = wide.blur.rows(taken.samples, &rows)?;
        taken.samples = self.middle(&blurred, beside);
        Ok(taken)
    }

    /// The camera's own bins from rows that have some more on either side.
    fn middle(&self, rows: &[f32], beside: usize) -> Vec<f32> {
        let n_bins = self.camera().n_bins();
        (rows.chunks(n_bins + 2 * beside))
            .flat_map(|row| &row[beside..beside + n_bins])
            .copied()
            .collect()
    }

    /// What blurs by depth; `None` without a collimator.
    pub(super) fn depth(&self) -> Result<Option<&Depth>, PhantomError> {
        Ok(once(&self.depth, || self.make_depth())?.as_ref())
    }

    fn make_depth(&self) -> Result<Option<Depth>, PhantomError> {
        // Else a point is seen as a point.
        let blurs = |own: &&Collimation| own.response.variance(f64::MAX) > 0.0;
        let Some(collimation) = self.parts.collimator.as_ref().filter(blurs) else {
            return Ok(None);
        };
        if let Some((view_idx, Facing { radius, body, .. })) = self.inside()? {
            return Err(PhantomError::DetectorInside {
                view_idx,
                radius,
                needed: body,
            });
        }
        let (camera, views) = (self.camera(), self.facing()?.to_vec());
        let [side, end] = self.extent()?;
        // What goes on beyond all rows is blurred into them from both sides.
        let endless = self.parts.background.is_some();
        let end = if endless { f64::INFINITY } else { end };
        let depth = Depth::new(collimation, camera, views, [side, end])?;
        let threads = rayon::current_num_threads() as u64;
        check_memory(2 * threads * depth.view_bytes() as u64)?;
        Ok(Some(depth))
    }

    /// The same, once it was made.
    pub(super) fn depth_known(&self) -> Option<&Depth> {
        self.depth.get().and_then(Option::as_ref)
    }

    /// The camera that sees all that the blur brings into the views; `None` where the camera does.
    pub(super) fn wide(&self) -> Result<Option<&Wide>, PhantomError> {
        Ok(once(&self.wide, || self.make_wide())?.as_ref())
    }

    fn make_wide(&self) -> Result<Option<Wide>, PhantomError> {
        let (Some(BlurSettings { fwhm }), Some(blur)) = (self.scene().blur, &self.readout.blur)
        else {
            return Ok(None);
        };
        Wide::around(self.camera(), blur, fwhm, self.extent()?)
    }
}
