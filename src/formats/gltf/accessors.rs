//! Rows of glTF accessors: any component type, sparse or compressed. Each accessor is checked against the size of its buffer
//! before it is read.

use super::buffers::Buffers;
use super::draco;
use crate::FormatError;
use ::gltf::accessor::sparse::IndexType;
use ::gltf::accessor::{DataType, Dimensions};
use ::gltf::buffer::View;
use ::gltf::{Accessor, Document};
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

/// Most bytes of an accessor without a buffer view, whose rows are zero.
const MOST_ZEROS: usize = 64 << 20;

/// Accessors of a document.
pub(super) struct Accessors {
    buffers: Buffers,
    /// Decompressed rows of accessors, without gaps.
    rows: HashMap<usize, Vec<u8>>,
}

/// Meaning of integers in an accessor.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Integers {
    /// As the accessor states.
    Stated,
    /// Shares of their largest value.
    Normalized,
}

impl Accessors {
    /// Reads and decompresses the buffers; `blob` is the binary chunk, external buffers lie beside `origin`.
    pub(super) fn read(
        document: &Document,
        json: &Value,
        blob: Option<Vec<u8>>,
        origin: &Path,
    ) -> Result<Self, FormatError> {
        let buffers = Buffers::read(document, json, blob, origin)?;
        let rows = draco::decoded_rows(document, json, &buffers)
            .map_err(|(place, why)| FormatError::field(origin, place, why))?;
        Ok(Self { buffers, rows })
    }

    /// Bytes of a buffer view.
    pub(super) fn view(&self, view: &View<'_>) -> Result<&[u8], String> {
        self.buffers.view(view)
    }

    /// Rows of `size` bytes from `offset` in a buffer view.
    fn strided(
        &self,
        view: &View<'_>,
        offset: usize,
        count: usize,
        size: usize,
    ) -> Result<Vec<u8>, String> {
        let stride = view.stride().unwrap_or(size).max(size);
        let data = self.view(view)?.get(offset..);
        let data = data.ok_or("it starts beyond its buffer view")?;
        let need = count
            .checked_sub(1)
            .and_then(|n| n.checked_mul(stride))
            .and_then(|n| n.checked_add(size));
        match need {
            None => Ok(Vec::new()),
            Some(need) if need > data.len() => Err(format!(
                "{count} elements are more than its buffer view holds"
            )),
            Some(_) => {
                let rows = (0..count).flat_map(|i| &data[i * stride..i * stride + size]);
                Ok(rows.copied().collect())
            }
        }
    }

    /// Rows of an accessor without gaps, `size` bytes each, sparse ones replaced.
    fn packed(&self, a: &Accessor<'_>, size: usize) -> Result<Vec<u8>, String> {
        if let Some(rows) = self.rows.get(&a.index()) {
            return Ok(rows.clone());
        }
        let mut rows = match a.view() {
            Some(view) => self.strided(&view, a.offset(), a.count(), size)?,
            None if a.count().saturating_mul(size) > MOST_ZEROS => {
                return Err(format!("{} elements without a buffer view", a.count()));
            }
            None => vec![0; a.count() * size],
        };
        let Some(sparse) = a.sparse() else {
            return Ok(rows);
        };
        let (count, places, values) = (sparse.count(), sparse.indices(), sparse.values());
        let index_size = match places.index_type() {
            IndexType::U8 => 1,
            IndexType::U16 => 2,
            IndexType::U32 => 4,
        };
        let at = self.strided(&places.view(), places.offset(), count, index_size)?;
        let new = self.strided(&values.view(), values.offset(), count, size)?;
        for (place, row) in at.chunks_exact(index_size).zip(new.chunks_exact(size)) {
            let i = little_endian(place) as usize;
            let end = i.saturating_add(1).saturating_mul(size);
            let target = rows.get_mut(i.saturating_mul(size)..end);
            let target = target.ok_or_else(|| format!("sparse element {i} does not exist"))?;
            target.copy_from_slice(row);
        }
        Ok(rows)
    }

    /// First N numbers of each row.
    fn numbers<const N: usize>(
        &self,
        a: &Accessor<'_>,
        integers: Integers,
    ) -> Result<Vec<[f32; N]>, String> {
        let (kind, columns) = (a.data_type(), a.dimensions().multiplicity());
        let is_share = integers == Integers::Normalized || a.normalized();
        let (width, size) = (kind.size(), columns * kind.size());
        let rows = self.packed(a, size)?;
        let number =
            |row: &[u8], k: usize| number(&row[k * width..(k + 1) * width], kind, is_share);
        let rows = rows.chunks_exact(size.max(1));
        Ok(rows
            .map(|row| std::array::from_fn(|k| number(row, k)))
            .collect())
    }

    /// Rows of N numbers: floats, or integers as they are, or as shares where the accessor says so (KHR_mesh_quantization).
    pub(super) fn floats<const N: usize>(&self, a: &Accessor<'_>) -> Result<Vec<[f32; N]>, String> {
        if a.dimensions().multiplicity() != N {
            let (dimensions, kind) = (a.dimensions(), a.data_type());
            return Err(format!("{dimensions:?} of {kind:?}, expected {N} numbers"));
        }
        self.numbers(a, Integers::Stated)
    }

    /// Rows of at least N numbers, cut to N; integers are shares of their largest value.
    pub(super) fn normalized<const N: usize>(
        &self,
        a: &Accessor<'_>,
    ) -> Result<Vec<[f32; N]>, String> {
        use Dimensions::{Vec2, Vec3, Vec4};
        let dimensions = a.dimensions();
        if dimensions.multiplicity() < N || !matches!(dimensions, Vec2 | Vec3 | Vec4) {
            return Err(format!("{dimensions:?}, expected vectors of {N} or more"));
        }
        if a.data_type() == DataType::U32 {
            return Err("U32, expected floats or shorter integers".into());
        }
        self.numbers(a, Integers::Normalized)
    }

    /// Vertex indices of a primitive.
    pub(super) fn indices(&self, a: &Accessor<'_>) -> Result<Vec<u32>, String> {
        if a.dimensions() != Dimensions::Scalar {
            return Err("expected scalars".into());
        }
        let size = match a.data_type() {
            kind @ (DataType::U8 | DataType::U16 | DataType::U32) => kind.size(),
            other => return Err(format!("{other:?}, expected unsigned integers")),
        };
        let rows = self.packed(a, size)?;
        Ok(rows.chunks_exact(size).map(little_endian).collect())
    }
}

/// Unsigned integer of up to four bytes.
fn little_endian(bytes: &[u8]) -> u32 {
    let bytes = bytes.iter().rev();
    bytes.fold(0, |value, byte| value << 8 | u32::from(*byte))
}

/// Number of a component; integers as shares of their largest value with `is_share` (glTF 2.0, section 3.6.2.2).
fn number(bytes: &[u8], kind: DataType, is_share: bool) -> f32 {
    let bits = little_endian(bytes);
    let share = |value: f32, most: f32| {
        if is_share {
            (value / most).max(-1.0)
        } else {
            value
        }
    };
    match kind {
        DataType::F32 => f32::from_bits(bits),
        DataType::I8 => share(f32::from(bits as u8 as i8), 127.0),
        DataType::U8 => share(f32::from(bits as u8), 255.0),
        DataType::I16 => share(f32::from(bits as u16 as i16), 32_767.0),
        DataType::U16 => share(f32::from(bits as u16), 65_535.0),
        DataType::U32 => bits as f32,
    }
}
