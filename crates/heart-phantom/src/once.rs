//! Values that are computed once and stored.

use crate::error::PhantomError;
use std::sync::OnceLock;

/// Returns a stored value; computes and stores it at the first call.
pub(crate) fn once<T>(
    made: &OnceLock<T>,
    make: impl FnOnce() -> Result<T, PhantomError>,
) -> Result<&T, PhantomError> {
    if let Some(known) = made.get() {
        return Ok(known);
    }
    let new = make()?;
    // Another thread may have stored the same value first.
    Ok(made.get_or_init(|| new))
}
