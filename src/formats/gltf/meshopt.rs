//! Buffer views compressed by meshoptimizer: extension EXT_meshopt_compression, its three modes and its filters.

use serde_json::Value;
use std::collections::HashMap;

mod filters;
mod indices;
mod vertices;

/// Names of the extension; both have the same properties.
pub(super) const EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Longest decompressed buffer view, bytes.
const MOST_BYTES: usize = 512 << 20;

/// The extension's properties of an object.
fn extension(object: &Value) -> Option<&Value> {
    let extensions = object.get("extensions")?;
    EXTENSIONS.iter().find_map(|name| extensions.get(name))
}

/// True for a buffer that only readers without the extension need.
pub(super) fn is_fallback(json: &Value, buffer: usize) -> bool {
    let buffer = json.get("buffers").and_then(|b| b.get(buffer));
    let fallback = buffer.and_then(extension).and_then(|e| e.get("fallback"));
    fallback.and_then(Value::as_bool).unwrap_or(false)
}

/// Decompressed contents of the buffer views that have the extension, by their index, or their fault: of a view that is not
/// read a fault is of no matter.
pub(super) fn decoded_views(
    json: &Value,
    buffers: &[Vec<u8>],
) -> HashMap<usize, Result<Vec<u8>, String>> {
    let mut out = HashMap::new();
    let views = json.get("bufferViews").and_then(Value::as_array);
    for (index, view) in views.into_iter().flatten().enumerate() {
        if let Some(extension) = extension(view) {
            let fault = |why| format!("buffer view {index}: meshopt compression: {why}");
            out.insert(index, decoded(extension, buffers).map_err(fault));
        }
    }
    out
}

/// Decompressed contents of one buffer view.
fn decoded(extension: &Value, buffers: &[Vec<u8>]) -> Result<Vec<u8>, String> {
    let number = |key: &str| {
        let value = extension.get(key).and_then(Value::as_u64);
        value.and_then(|v| usize::try_from(v).ok())
    };
    let need = |key: &str| number(key).ok_or_else(|| format!("`{key}` is missing"));
    let word = |key: &str| extension.get(key).and_then(Value::as_str);
    let start = number("byteOffset").unwrap_or(0);
    let end = start.saturating_add(need("byteLength")?);
    let data = buffers.get(need("buffer")?).and_then(|b| b.get(start..end));
    let data = data.ok_or("the data are longer than their buffer")?;
    let (count, stride) = (need("count")?, need("byteStride")?);
    if count.saturating_mul(stride) > MOST_BYTES {
        return Err(format!("{count} elements of {stride} bytes are too many"));
    }

    let mut out = match word("mode") {
        Some("ATTRIBUTES") => vertices::decode(data, count, stride)?,
        Some("TRIANGLES") => indices::decode_triangles(data, count, stride)?,
        Some("INDICES") => indices::decode_sequence(data, count, stride)?,
        other => return Err(format!("mode {other:?} is not known")),
    };
    match word("filter") {
        None | Some("NONE") => {}
        Some("EXPONENTIAL") => filters::exponential(&mut out),
        Some("QUATERNION") => filters::quaternion(&mut out),
        Some(other) => {
            return Err(format!(
                "filter `{other}` is not read; export without filters"
            ));
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests;
