//! Contents of glTF buffers and of their views, decompressed.

use super::meshopt;
use super::uri::external;
use crate::FormatError;
use ::gltf::Document;
use ::gltf::buffer::{Source, View};
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

/// Contents of the buffers of a document.
pub(super) struct Buffers {
    buffers: Vec<Vec<u8>>,
    /// Decompressed contents of buffer views, or their faults.
    views: HashMap<usize, Result<Vec<u8>, String>>,
}

impl Buffers {
    /// Reads the buffers; `blob` is the binary chunk, external buffers lie beside `origin`.
    ///
    /// # Errors
    /// Names the buffer at fault.
    pub(super) fn read(
        document: &Document,
        json: &Value,
        mut blob: Option<Vec<u8>>,
        origin: &Path,
    ) -> Result<Self, FormatError> {
        let mut buffers = Vec::new();
        for b in document.buffers() {
            let field = format!("buffer {}", b.index());
            let is_fallback = meshopt::is_fallback(json, b.index());
            let data = match b.source() {
                Source::Bin if is_fallback => {
                    buffers.push(Vec::new());
                    continue;
                }
                Source::Bin => blob.take().ok_or_else(|| {
                    FormatError::field(origin, &field, "the file has no binary chunk")
                })?,
                Source::Uri(uri) => external(uri, origin, &field)?,
            };
            if data.len() < b.length() {
                let why = format!("{} bytes, {} announced", data.len(), b.length());
                return Err(FormatError::field(origin, field, why));
            }
            buffers.push(data);
        }
        Ok(Self {
            views: meshopt::decoded_views(json, &buffers),
            buffers,
        })
    }

    /// Bytes of a buffer view.
    pub(super) fn view(&self, view: &View<'_>) -> Result<&[u8], String> {
        if let Some(decoded) = self.views.get(&view.index()) {
            return decoded.as_deref().map_err(Clone::clone);
        }
        let buffer = self
            .buffers
            .get(view.buffer().index())
            .ok_or("no such buffer")?;
        let range = view.offset()..view.offset().saturating_add(view.length());
        let data = buffer.get(range);
        data.ok_or_else(|| "the buffer view is longer than its buffer".into())
    }
}
