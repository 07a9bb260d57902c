//! Rows of glTF accessors. Each accessor is checked against the size of its buffer before it is read.

use super::uri::external;
use crate::FormatError;
use ::gltf::accessor::{DataType, Dimensions};
use ::gltf::buffer::{Source, View};
use ::gltf::{Accessor, Document};
use std::path::Path;

/// Buffers of a document.
pub(super) struct Accessors {
    buffers: Vec<Vec<u8>>,
}

impl Accessors {
    /// Reads the buffers; `blob` is the binary chunk, external buffers lie beside `origin`.
    pub(super) fn read(
        document: &Document,
        blob: Option<Vec<u8>>,
        origin: &Path,
    ) -> Result<Self, FormatError> {
        let mut blob = blob;
        let mut buffers = Vec::new();
        for b in document.buffers() {
            let field = format!("buffer {}", b.index());
            let data = match b.source() {
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
        Ok(Self { buffers })
    }

    /// Bytes of a buffer view.
    pub(super) fn view(&self, view: &View<'_>) -> Result<&[u8], String> {
        let buffer = self
            .buffers
            .get(view.buffer().index())
            .ok_or("no such buffer")?;
        let range = view.offset()..view.offset().saturating_add(view.length());
        let data = buffer.get(range);
        data.ok_or_else(|| "the buffer view is longer than its buffer".into())
    }

    /// Bytes of each element of an accessor.
    fn elements<'s>(&'s self, a: &Accessor<'_>, size: usize) -> Result<Vec<&'s [u8]>, String> {
        if a.sparse().is_some() {
            return Err("sparse accessors are not supported; export without them".into());
        }
        let view = a.view().ok_or("no buffer view")?;
        let stride = view.stride().unwrap_or(size).max(size);
        let data = self
            .view(&view)?
            .get(a.offset()..)
            .ok_or("it starts beyond its buffer view")?;
        let need = a
            .count()
            .checked_sub(1)
            .and_then(|n| n.checked_mul(stride))
            .and_then(|n| n.checked_add(size));
        match need {
            None => Ok(Vec::new()),
            Some(need) if need > data.len() => Err(format!(
                "{} elements are more than its buffer view holds",
                a.count()
            )),
            Some(_) => Ok((0..a.count())
                .map(|i| &data[i * stride..i * stride + size])
                .collect()),
        }
    }

    /// Rows of N floats.
    pub(super) fn floats<const N: usize>(&self, a: &Accessor<'_>) -> Result<Vec<[f32; N]>, String> {
        if a.data_type() != DataType::F32 || a.dimensions().multiplicity() != N {
            return Err(format!(
                "{:?} of {:?}, expected {N} floats",
                a.dimensions(),
                a.data_type()
            ));
        }
        let float = |e: &[u8], k: usize| {
            f32::from_le_bytes([e[4 * k], e[4 * k + 1], e[4 * k + 2], e[4 * k + 3]])
        };
        Ok(self
            .elements(a, 4 * N)?
            .into_iter()
            .map(|e| std::array::from_fn(|k| float(e, k)))
            .collect())
    }

    /// Rows of at least N numbers, cut to N; unsigned integers are divided by their largest value.
    pub(super) fn normalized<const N: usize>(
        &self,
        a: &Accessor<'_>,
    ) -> Result<Vec<[f32; N]>, String> {
        use Dimensions::{Vec2, Vec3, Vec4};
        let (dimensions, kind) = (a.dimensions(), a.data_type());
        let columns = dimensions.multiplicity();
        if columns < N || !matches!(dimensions, Vec2 | Vec3 | Vec4) {
            return Err(format!("{dimensions:?}, expected vectors of {N} or more"));
        }
        let value: fn(&[u8], usize) -> f32 = match kind {
            DataType::F32 => |e, k| f32::from_le_bytes(std::array::from_fn(|b| e[4 * k + b])),
            DataType::U8 => |e, k| f32::from(e[k]) / 255.0,
            DataType::U16 => {
                |e, k| f32::from(u16::from_le_bytes([e[2 * k], e[2 * k + 1]])) / 65_535.0
            }
            other => return Err(format!("{other:?}, expected floats, U8 or U16")),
        };
        Ok(self
            .elements(a, columns * kind.size())?
            .into_iter()
            .map(|e| std::array::from_fn(|k| value(e, k)))
            .collect())
    }

    /// Vertex indices of a primitive.
    pub(super) fn indices(&self, a: &Accessor<'_>) -> Result<Vec<u32>, String> {
        if a.dimensions() != Dimensions::Scalar {
            return Err("expected scalars".into());
        }
        Ok(match a.data_type() {
            DataType::U8 => self
                .elements(a, 1)?
                .into_iter()
                .map(|e| u32::from(e[0]))
                .collect(),
            DataType::U16 => self
                .elements(a, 2)?
                .into_iter()
                .map(|e| u16::from_le_bytes([e[0], e[1]]).into())
                .collect(),
            DataType::U32 => self
                .elements(a, 4)?
                .into_iter()
                .map(|e| u32::from_le_bytes([e[0], e[1], e[2], e[3]]))
                .collect(),
            other => return Err(format!("{other:?}, expected unsigned integers")),
        })
    }
}
