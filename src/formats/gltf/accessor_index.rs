//! Accessors that extensions name by their index, which the gltf crate does not check.

use ::gltf::{Accessor, Document};
use serde_json::Value;

/// Accessor that an extension names by its index; `None` where it names none.
///
/// # Errors
/// An index without an accessor.
pub(super) fn accessor_at<'d>(
    document: &'d Document,
    index: Option<&Value>,
) -> Result<Option<Accessor<'d>>, String> {
    let Some(value) = index else {
        return Ok(None);
    };
    let index = value.as_u64().and_then(|i| usize::try_from(i).ok());
    let found = index.and_then(|i| document.accessors().nth(i));
    found
        .map(Some)
        .ok_or_else(|| format!("accessor {value} does not exist"))
}
