//! All views of an acquisition.

use super::acquisition::{Acquisition, Sinograms};
use super::camera::Camera;
use super::whole::Scan;
use crate::error::PhantomError;
use crate::{Activity, Cycle, Heart};

impl Acquisition {
    /// Solves the shapes that the views need, so that nothing is left to solve when they are taken; no more than the heart keeps.
    ///
    /// # Errors
    /// As [`acquire`](acquire()).
    pub fn solve(&self, heart: &Heart, camera: &Camera, cycle: &Cycle) -> Result<(), PhantomError> {
        let none = Activity::from([0.0; 2]);
        let times = Scan::plain(heart, camera, cycle, *self, none).times()?;
        let gains = times.iter().map(|lasting| lasting.gain);
        let kept: Vec<f64> = gains.take(heart.most_shapes()).collect();
        heart.shapes(&kept).map(drop)
    }
}

/// Takes all views of an acquisition; `activity` is that of the cavity and of the wall.
///
/// Line integrals are those of the exact body, no voxels are involved. Equal shapes are solved
/// once; the result has the same bits for any number of threads. `progress` is called with the
/// number of views done.
///
/// # Errors
/// [`PhantomError::Count`] or [`PhantomError::Odd`] unless the number of steps is even and at most 65536;
/// [`PhantomError::OutOfRange`] for a time, phase or activity without sense, an interval other than a turning camera's own among
/// them; [`PhantomError::Unseen`] for a gate that does not come in some view; what solving the shapes can return.
pub fn acquire(
    heart: &Heart,
    camera: &Camera,
    cycle: &Cycle,
    acquisition: Acquisition,
    activity: impl Into<Activity>,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Sinograms, PhantomError> {
    let scan = Scan::plain(heart, camera, cycle, acquisition, activity.into());
    scan.rows(0..camera.n_views(), 0..camera.n_rows(), progress)
}
