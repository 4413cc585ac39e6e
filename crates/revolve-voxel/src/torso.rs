//! Views of a torso: what surrounds the body and is active, too.

use rayon::prelude::*;

use crate::attenuation::across;
use crate::error::{finite, length, positive};
use crate::{Attenuator, EllipticCylinder, Error, ParallelRays, Sample};

impl EllipticCylinder {
    /// Adds `activity` times the integral along the rays within the cylinder to an image `[row][bin]`, weakened by an
    /// attenuator if there is one (the detector is ahead of the rays).
    ///
    /// ```
    /// use revolve_voxel::{Attenuator, EllipticCylinder, Medium, ParallelDetector};
    /// let torso = EllipticCylinder::new([1.0, 0.0], [3.0, 2.0])?;
    /// let rays = ParallelDetector::new(3, 1, [1.0, 1.0])?.rays(0.0)?; // along +y at x = -1, 0, 1
    /// let mut seen = [0.0_f64; 3];
    /// torso.project_add(&rays, 0.5, None, &mut seen)?;
    /// assert!((seen[2] - 0.5 * 4.0).abs() < 1e-12);
    /// let medium = Attenuator::new(0.2, Medium::Torso(torso))?;
    /// let mut weakened = [0.0_f64; 3];
    /// torso.project_add(&rays, 0.5, Some(&medium), &mut weakened)?;
    /// for (plain, weak) in seen.iter().zip(&weakened) {
    ///     assert!((weak - 0.5 * (1.0 - (-0.2 * plain / 0.5).exp()) / 0.2).abs() < 1e-12);
    /// }
    /// # Ok::<(), revolve_voxel::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] for a wrong image, [`Error::NotFinite`] for the activity, [`Error::NotPositive`] for rays along z.
    pub fn project_add<T: Sample>(
        &self,
        rays: &ParallelRays,
        activity: f64,
        attenuator: Option<&Attenuator>,
        out: &mut [T],
    ) -> Result<(), Error> {
        finite("activity", activity)?;
        length("image", rays.n_bins() * rays.n_rows(), out.len())?;
        positive("rays' part across the torso", across(&rays.direction()))?;
        out.par_chunks_mut(rays.n_bins())
            .enumerate()
            .for_each(|(row, image)| {
                for (bin, pixel) in image.iter_mut().enumerate() {
                    let ray = rays.line(bin, row);
                    if let Some(span) = self.span(&ray) {
                        let way = match attenuator {
                            None => span.length(),
                            Some(medium) => medium.along(&ray).integral(span.enter, span.exit),
                        };
                        *pixel += T::from_f64(activity * way);
                    }
                }
            });
        Ok(())
    }
}
