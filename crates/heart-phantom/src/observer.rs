//! Callbacks that report the progress of a computation and can stop it.

use crate::error::PhantomError;
use std::ops::ControlFlow;

/// A callback that receives the progress of a computation and can stop it: after `ControlFlow::Break` the computation returns
/// [`PhantomError::Stopped`]. Several threads may call it, also after a break.
///
/// ```
/// use heart_phantom::{Phantom, PhantomError, Scene};
/// use std::ops::ControlFlow;
/// let phantom = Phantom::new(Scene::default().with_size(16))?;
/// let stopped = phantom.sinograms(0, &|done| match done < 10 {
///     true => ControlFlow::Continue(()),
///     false => ControlFlow::Break(()),
/// });
/// assert!(matches!(stopped, Err(PhantomError::Stopped)));
/// # Ok::<(), PhantomError>(())
/// ```
pub type Observer<'a, T> = &'a (dyn Fn(T) -> ControlFlow<()> + Sync);

/// Continues: the [`Observer`] of a computation that neither reports its progress nor ends early.
///
/// ```
/// use heart_phantom::{Phantom, Scene, no_observer};
/// let phantom = Phantom::new(Scene::default().with_size(16))?;
/// assert_eq!(phantom.sinograms(0, &no_observer)?.samples.len(), 90 * 16 * 16);
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
pub fn no_observer<T>(_: T) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Returns [`PhantomError::Stopped`] if an observer has stopped the computation.
pub(crate) fn check_stop(observed: ControlFlow<()>) -> Result<(), PhantomError> {
    match observed {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(PhantomError::Stopped),
    }
}
