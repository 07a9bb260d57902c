//! Named numpy arrays in a zip.
//!
//! The entry's stated size, the header's shape and the following bytes must agree before an array is read, so that a
//! broken or hostile file costs an error and no memory.

use super::FormatError;
use super::npy::half;
use npyz::{DType, NpyHeader, Order, TypeChar};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Largest array, bytes: 55 joints × 50,000 vertices × 8 bytes is 22 MB, 300 shape directions of SMPL-X (10,475 vertices)
/// are 75 MB.
const MAX_ARRAY_BYTES: u64 = 512 << 20;

/// Numbers of one array in C order.
pub(super) struct NpzArray {
    pub(super) shape: Vec<usize>,
    pub(super) data: Vec<f64>,
}

impl NpzArray {
    /// Length along a dimension; 0 if there is no such dimension.
    pub(super) fn side(&self, dimension: usize) -> usize {
        self.shape.get(dimension).copied().unwrap_or(0)
    }
}

/// The zip, and its path for errors.
pub(super) struct NpzFile<'a> {
    path: &'a Path,
    npz: npyz::npz::NpzArchive<BufReader<File>>,
}

impl<'a> NpzFile<'a> {
    /// Opens a zip of arrays.
    pub(super) fn open(path: &'a Path) -> Result<Self, FormatError> {
        let npz = npyz::npz::NpzArchive::open(path).map_err(|e| FormatError::io(path, e))?;
        Ok(Self { path, npz })
    }
    /// Names of the arrays, for messages.
    pub(super) fn names(&mut self) -> Vec<String> {
        let names = self.npz.zip_archive().file_names();
        let mut out: Vec<String> = names
            .map(|n| n.trim_end_matches(".npy").to_owned())
            .collect();
        out.sort();
        out
    }

    pub(super) fn fault(&self, field: &str, why: impl Into<String>) -> FormatError {
        FormatError::field(self.path, field, why)
    }

    /// Header and payload of an entry; `None` if there is no such array.
    fn raw(&mut self, name: &str) -> Result<Option<(NpyHeader, Vec<u8>)>, FormatError> {
        let path = self.path;
        let fault = |why: String| FormatError::field(path, name, why);
        let file = npyz::npz::file_name_from_array_name(name);
        let zip = self.npz.zip_archive();
        if !zip.file_names().any(|n| n == file) {
            return Ok(None);
        }
        let entry = zip
            .by_name(&file)
            .map_err(|e| fault(format!("the zip entry cannot be opened ({e})")))?;
        let size = entry.size();
        if size > MAX_ARRAY_BYTES {
            return Err(fault(format!(
                "{size} bytes, but no body array is larger than {MAX_ARRAY_BYTES}"
            )));
        }
        // The buffer grows as bytes arrive: the stated size alone allocates nothing.
        let mut bytes = Vec::new();
        let read = entry
            .take(size + 1)
            .read_to_end(&mut bytes)
            .map_err(|e| fault(format!("cannot be read ({e})")))?;
        if read as u64 != size {
            return Err(fault(format!("{read} bytes found, {size} announced")));
        }
        let header_end = super::npy::data_start(&bytes)
            .ok_or_else(|| fault("too short for a numpy array".into()))?;
        if header_end > bytes.len() {
            return Err(fault("its header is longer than the array".into()));
        }
        if !super::npy::is_flat_header(&bytes[..header_end]) {
            return Err(fault("its header nests more than an array's".into()));
        }
        let header = NpyHeader::from_reader(&bytes[..])
            .map_err(|e| fault(format!("is not a numpy array ({e})")))?;
        let item = match header.dtype() {
            DType::Plain(t) => t.num_bytes(),
            _ => None,
        };
        let Some(item) = item.filter(|i| *i > 0) else {
            return Err(fault(
                "is a pickled or structured object; save it as a plain dense array".into(),
            ));
        };
        let count = header
            .shape()
            .iter()
            .try_fold(1u64, |n, d| n.checked_mul(*d));
        let payload = bytes.split_off(header_end);
        if count.and_then(|n| n.checked_mul(item as u64)) != Some(payload.len() as u64) {
            return Err(fault(format!(
                "shape {:?} of {item} bytes each does not match its {} bytes",
                header.shape(),
                payload.len()
            )));
        }
        Ok(Some((header, payload)))
    }

    /// Numbers of any plain type as f64.
    pub(super) fn numbers(&mut self, name: &str) -> Result<Option<NpzArray>, FormatError> {
        let Some((header, bytes)) = self.raw(name)? else {
            return Ok(None);
        };
        let DType::Plain(t) = header.dtype() else {
            return Err(self.fault(name, "not a plain array"));
        };
        let item = t.num_bytes().unwrap_or(0);
        if t.endianness() == npyz::Endianness::Big {
            return Err(self.fault(
                name,
                "big-endian numbers are not supported; save it little-endian",
            ));
        }
        /// The little-endian numbers of one type.
        fn parse<const N: usize>(bytes: &[u8], f: impl Fn([u8; N]) -> f64) -> Vec<f64> {
            bytes.as_chunks::<N>().0.iter().map(|c| f(*c)).collect()
        }
        let data = match (t.type_char(), item) {
            (TypeChar::Float, 2) => parse(&bytes, |b| f64::from(half(u16::from_le_bytes(b)))),
            (TypeChar::Int, 1) => parse(&bytes, |b| f64::from(i8::from_le_bytes(b))),
            (TypeChar::Int, 2) => parse(&bytes, |b| f64::from(i16::from_le_bytes(b))),
            (TypeChar::Uint, 1) => parse(&bytes, |b| f64::from(u8::from_le_bytes(b))),
            (TypeChar::Uint, 2) => parse(&bytes, |b| f64::from(u16::from_le_bytes(b))),
            (TypeChar::Float, 4) => parse(&bytes, |b| f64::from(f32::from_le_bytes(b))),
            (TypeChar::Float, 8) => parse(&bytes, f64::from_le_bytes),
            (TypeChar::Int, 4) => parse(&bytes, |b| f64::from(i32::from_le_bytes(b))),
            (TypeChar::Int, 8) => parse(&bytes, |b| i64::from_le_bytes(b) as f64),
            (TypeChar::Uint, 4) => parse(&bytes, |b| f64::from(u32::from_le_bytes(b))),
            (TypeChar::Uint, 8) => parse(&bytes, |b| u64::from_le_bytes(b) as f64),
            (c, n) => {
                return Err(self.fault(name, format!("type {c:?} of {n} bytes is not supported")));
            }
        };
        if let Some(i) = data.iter().position(|v| !v.is_finite()) {
            return Err(self.fault(name, format!("value {i} is not finite")));
        }
        let shape: Vec<usize> = header.shape().iter().map(|d| *d as usize).collect();
        let data = if header.order() == Order::Fortran {
            to_c_order(&shape, &data)
        } else {
            data
        };
        Ok(Some(NpzArray { shape, data }))
    }

    /// A numpy array of unicode strings (`<U`).
    pub(super) fn strings(&mut self, name: &str) -> Result<Option<Vec<String>>, FormatError> {
        let Some((header, bytes)) = self.raw(name)? else {
            return Ok(None);
        };
        let DType::Plain(t) = header.dtype() else {
            return Err(self.fault(name, "not a plain array"));
        };
        let width = match t.type_char() {
            TypeChar::UnicodeStr => t.num_bytes().unwrap_or(4),
            c => return Err(self.fault(name, format!("type {c:?}; unicode strings were expected"))),
        };
        let text = |item: &[u8]| {
            let codes = item
                .as_chunks::<4>()
                .0
                .iter()
                .map(|c| u32::from_le_bytes(*c));
            codes
                .take_while(|c| *c != 0)
                .map(char::from_u32)
                .collect::<Option<String>>()
        };
        let all: Option<Vec<String>> = bytes.chunks_exact(width).map(text).collect();
        all.map(Some)
            .ok_or_else(|| self.fault(name, "holds characters that are not unicode"))
    }
}

/// Reorders Fortran-order data to C order.
fn to_c_order(shape: &[usize], data: &[f64]) -> Vec<f64> {
    let mut index = vec![0usize; shape.len()];
    let mut strides = vec![1usize; shape.len()];
    for k in 1..shape.len() {
        strides[k] = strides[k - 1] * shape[k - 1];
    }
    let mut out = Vec::with_capacity(data.len());
    for _ in 0..data.len() {
        out.push(
            data[index
                .iter()
                .zip(&strides)
                .map(|(i, s)| i * s)
                .sum::<usize>()],
        );
        for k in (0..shape.len()).rev() {
            index[k] += 1;
            if index[k] < shape[k] {
                break;
            }
            index[k] = 0;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fortran_order_is_undone() {
        assert_eq!(
            to_c_order(&[2, 3], &[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]),
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        );
    }
}
