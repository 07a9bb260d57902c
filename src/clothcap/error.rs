//! Error of a capture, and the frame, part or field at fault.

/// Scan or sequence that yields no garment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CaptureError {
    /// Too few finite points.
    #[error("the scan has {points} usable points, a person needs {least}")]
    TooFewPoints {
        /// Finite points.
        points: usize,
        /// Least number.
        least: usize,
    },
    /// No unit makes it the size of a person.
    #[error("the scan is {extent:?} units large: no unit and up axis make it a person")]
    NoPersonSize {
        /// Extent along x, y, z, units of the file.
        extent: [f32; 3],
    },
    /// Nobody is found in it.
    #[error("no person is found in the scan: {why}")]
    NoPerson {
        /// Best hypothesis and its fault.
        why: String,
    },
    /// Nothing but skin is found.
    #[error("no garment is found on the person")]
    NoGarment,
    /// Body whose legs cannot be joined in one tube.
    #[error("a skirt's template: {why}")]
    Topology {
        /// Part of the body at fault.
        why: String,
    },
    /// Displacements that belong to another outfit or body.
    #[error("displacements: {why}")]
    Displacements {
        /// Sizes that differ.
        why: String,
    },
    /// A system of equations could not be solved.
    #[error("{stage}: {why}")]
    Solve {
        /// Stage of the capture.
        stage: &'static str,
        /// Fault of the solver.
        why: String,
    },
}

impl CaptureError {
    /// Fault of a solver in a stage.
    pub(crate) fn solve(stage: &'static str, why: impl std::fmt::Display) -> Self {
        let why = why.to_string();
        Self::Solve { stage, why }
    }
}
