//! Fault of a message: the field and the reason, before file and topic are known.

use crate::FormatError;

/// Unusable field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MessageFault {
    /// The field, as its schema names it.
    pub(super) field: String,
    /// The fault and the expectation.
    pub(super) why: String,
}

impl MessageFault {
    pub(super) fn new(field: impl Into<String>, why: impl Into<String>) -> Self {
        Self {
            field: field.into(),
            why: why.into(),
        }
    }
}

/// Fault of an image decoder, whose error names an origin: it becomes the field.
impl From<FormatError> for MessageFault {
    fn from(error: FormatError) -> Self {
        match error {
            FormatError::Io { why, .. } => Self::new("data", why.to_string()),
            FormatError::Field { field, why, .. } => Self::new("data", format!("{field}: {why}")),
        }
    }
}
