//! What lies beyond a detector's edges and reaches into its views by the blur: a larger camera sees it.

use super::camera::Camera;
use crate::error::PhantomError;
use radon::Blur;

/// A larger camera, of which the camera's views are the middle.
#[derive(Debug)]
pub(crate) struct Wide {
    pub(crate) camera: Camera,
    pub(crate) blur: Blur,
    /// Bins, and rows, more on either side.
    pub(crate) margin: [usize; 2],
}

impl Wide {
    /// Where there is anything to see as far as `extent` (from the axis, and from the middle along it, in cm); `None` if the blur,
    /// `fwhm` wide, brings nothing into the views that the camera does not see.
    pub(crate) fn around(
        camera: &Camera,
        blur: &Blur,
        fwhm: f64,
        extent: [f64; 2],
    ) -> Result<Option<Self>, PhantomError> {
        let reach = [0, 1].map(|axis| blur.weights(axis).len() - 1);
        let (margin, camera) = widened(camera, reach, extent)?;
        if margin == [0; 2] {
            return Ok(None);
        }
        let size = [camera.n_bins(), camera.n_rows()];
        Ok(Some(Self {
            blur: Blur::new(size, camera.detector().pitch(), fwhm)?,
            camera,
            margin,
        }))
    }
}

/// How many bins and rows more on either side see all that a blur of that reach brings into the views, and the camera that has them.
pub(super) fn widened(
    camera: &Camera,
    reach: [usize; 2],
    extent: [f64; 2],
) -> Result<([usize; 2], Camera), PhantomError> {
    let (size, pitch) = (
        [camera.n_bins(), camera.n_rows()],
        camera.detector().pitch(),
    );
    let margin = [0, 1].map(|axis| {
        let free = 0.5 * size[axis] as f64 * pitch[axis] - reach[axis] as f64 * pitch[axis];
        if extent[axis] > free { reach[axis] } else { 0 }
    });
    let size = [0, 1].map(|axis| size[axis] + 2 * margin[axis]);
    Ok((margin, camera.of_size(size)?))
}
