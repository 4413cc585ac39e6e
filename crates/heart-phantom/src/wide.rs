//! What lies beyond a detector's edges and reaches into its views by the blur: a larger camera sees it.

use crate::error::PhantomError;
use crate::warning::half_extents;
use crate::{Camera, Phantom, Sinograms};
use radon::Blur;
use std::ops::Range;

/// A larger camera, of which the camera's views are the middle.
#[derive(Debug)]
pub(crate) struct Wide {
    camera: Camera,
    blur: Blur,
    /// Bins, and rows, more on either side.
    margin: [usize; 2],
}

impl Phantom {
    /// Line integrals, blurred but without noise.
    pub(crate) fn means(
        &self,
        gate: usize,
        views: Range<usize>,
        rows: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        let acquisition = self.acquisition(gate)?;
        let Some(wide) = self.wide()? else {
            let cast = self.readout.rows_seen(&rows);
            let scan = self.scan(self.camera(), acquisition);
            let mut taken = scan.rows(views, cast, progress)?;
            self.work.rays(taken.rays);
            self.readout.blur(&mut taken.samples, &rows)?;
            return Ok(taken);
        };
        let [beside, above] = wide.margin;
        let rows = rows.start + above..rows.end + above;
        let cast = wide.blur.rows_seen(&rows);
        let scan = self.scan(&wide.camera, acquisition);
        let mut taken = scan.rows(views, cast, progress)?;
        self.work.rays(taken.rays);
        let blurred = wide.blur.rows(taken.samples, &rows)?;
        let n_bins = self.camera().n_bins();
        taken.samples = (blurred.chunks(wide.camera.n_bins()))
            .flat_map(|row| &row[beside..beside + n_bins])
            .copied()
            .collect();
        Ok(taken)
    }

    /// The camera that sees all that the blur brings into the views; `None` where the camera does.
    fn wide(&self) -> Result<Option<&Wide>, PhantomError> {
        if self.wide.get().is_none() {
            let made = self.make_wide()?;
            // Another thread may have been first, with the same.
            let _ = self.wide.set(made);
        }
        Ok(self.wide.get().and_then(Option::as_ref))
    }

    fn make_wide(&self) -> Result<Option<Wide>, PhantomError> {
        let (parts, camera) = (self.parts(), self.camera());
        let (Some(fwhm), Some(blur)) = (parts.blur, &self.readout.blur) else {
            return Ok(None);
        };
        // How far from the axis, and from the middle along it, there is anything to see.
        let [mut side, mut end] = [0.0f64; 2];
        for body in self.outermost()? {
            let [x, y, z] = half_extents(&body);
            (side, end) = (side.max(x.hypot(y)), end.max(z));
        }
        if let Some(around) = &parts.background {
            let ([x, y], [a, b]) = (around.torso.centre(), around.torso.semi_axes());
            // Along z it goes on as its mirror image does.
            side = side.max(x.hypot(y) + a.max(b));
        }
        let (size, pitch) = (
            [camera.n_bins(), camera.n_rows()],
            camera.detector().pitch(),
        );
        let margin = [0, 1].map(|axis| {
            let reach = blur.weights(axis).len() - 1;
            let free = 0.5 * size[axis] as f64 * pitch[axis] - reach as f64 * pitch[axis];
            if [side, end][axis] > free { reach } else { 0 }
        });
        if margin == [0; 2] {
            return Ok(None);
        }
        let size = [0, 1].map(|axis| size[axis] + 2 * margin[axis]);
        Ok(Some(Wide {
            camera: camera.of_size(size)?,
            blur: Blur::new(size, pitch, fwhm)?,
            margin,
        }))
    }
}
