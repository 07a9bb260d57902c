//! Faults of a message, by field path.

use tonic_types::{ErrorDetails, FieldViolation, StatusExt};

/// Invalid field of a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {why}")]
pub struct WireError {
    /// Path of the field, `message.field`, with indices where a field repeats.
    pub field: String,
    /// Fault of the field.
    pub why: String,
}

impl WireError {
    /// A fault at `field`.
    pub fn new(field: impl Into<String>, why: impl Into<String>) -> Self {
        Self {
            field: field.into(),
            why: why.into(),
        }
    }
    /// The same fault with the path from a containing message.
    pub fn within(self, parent: &str) -> Self {
        Self {
            field: format!("{parent}.{}", self.field),
            why: self.why,
        }
    }
}

impl From<WireError> for tonic::Status {
    fn from(e: WireError) -> Self {
        let details = ErrorDetails::with_bad_request(vec![FieldViolation::new(
            e.field.clone(),
            e.why.clone(),
        )]);
        tonic::Status::with_error_details(tonic::Code::InvalidArgument, e.to_string(), details)
    }
}

/// Value of a required message field.
///
/// # Errors
/// When it is absent.
pub fn required<T>(value: Option<T>, field: &str) -> Result<T, WireError> {
    value.ok_or_else(|| WireError::new(field, "is required"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fault_becomes_invalid_argument_with_its_path() {
        let status = tonic::Status::from(
            WireError::new("depth.fx", "must be positive").within("calibration"),
        );
        assert_eq!(status.code(), tonic::Code::InvalidArgument);
        let details = status.get_error_details();
        let bad = details.bad_request().expect("details");
        assert_eq!(bad.field_violations[0].field, "calibration.depth.fx");
    }
}
