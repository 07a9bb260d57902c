//! Error of a capture from one camera.

use crate::CaptureError;
use tryon_tracking::StepError;

/// Recording that yields no scan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TurnError {
    /// No frame.
    #[error("the recording has no frame")]
    Empty,
    /// Nobody is tracked in any frame.
    #[error("nobody is found in any of the {frames} frames")]
    Nobody {
        /// Frames that were searched.
        frames: usize,
    },
    /// A frame that does not fit the camera.
    #[error("frame {frame}: {source}")]
    Frame {
        /// Number of the frame, from 0.
        frame: usize,
        /// Fault.
        source: StepError,
    },
    /// A fit that failed.
    #[error(transparent)]
    Fit(#[from] CaptureError),
}
