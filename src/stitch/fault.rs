//! Why nothing came out.

use crate::diagnostic::{Diagnostic, ReadError};
use crate::run::Cancelled;

/// Why a view, or all of them, cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StitchError {
    /// The input is at fault.
    #[error("{0}")]
    Fault(Box<Diagnostic>),
    /// A view's file ends in the middle: it may still be being written.
    #[error("{0}")]
    CutOff(Box<Diagnostic>),
    /// Somebody stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<Diagnostic> for StitchError {
    fn from(diagnostic: Diagnostic) -> Self {
        StitchError::Fault(Box::new(diagnostic))
    }
}

impl From<ReadError> for StitchError {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Bad(diagnostic) => StitchError::Fault(diagnostic),
            ReadError::CutOff(diagnostic) => StitchError::CutOff(diagnostic),
            ReadError::Cancelled(cancelled) => StitchError::Cancelled(cancelled),
        }
    }
}
