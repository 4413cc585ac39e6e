//! Work arrays shared by calls and threads.

use std::sync::{Mutex, PoisonError};

/// Work arrays, as many as concurrent uses so far. They are stored between uses, and concurrent uses do not wait.
#[derive(Debug)]
pub(crate) struct Pool<S>(Mutex<Vec<S>>);

impl<S> Default for Pool<S> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

/// A clone has no work arrays of its own yet.
impl<S> Clone for Pool<S> {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<S> Pool<S> {
    /// Calls `f` with work arrays that are not in use, or with new ones.
    pub(crate) fn with<R>(&self, new: impl FnOnce() -> S, f: impl FnOnce(&mut S) -> R) -> R {
        // Work arrays have no state that a panic could spoil.
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let free = lock().pop();
        let mut work = free.unwrap_or_else(new);
        let result = f(&mut work);
        lock().push(work);
        result
    }
}

/// Returns the first `len` elements of a work array, which grows if needed.
pub(crate) fn grown<S: Clone + Default>(memory: &mut Vec<S>, len: usize) -> &mut [S] {
    if memory.len() < len {
        // Exactly the planned size.
        memory.reserve_exact(len - memory.len());
        memory.resize(len, S::default());
    }
    &mut memory[..len]
}
