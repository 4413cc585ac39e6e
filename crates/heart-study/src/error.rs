//! What can go wrong: in the phantom, or in a drawing.

use crate::figures::FigureError;
use heart_phantom::PhantomError;

/// Why the study could not be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// An option, the phantom or a file.
    #[error(transparent)]
    Phantom(#[from] PhantomError),
    /// A figure could not be drawn.
    #[error(transparent)]
    Figure(FigureError),
}

impl From<FigureError> for StudyError {
    fn from(error: FigureError) -> Self {
        match error {
            FigureError::File(error) => Self::Phantom(error),
            error => Self::Figure(error),
        }
    }
}
