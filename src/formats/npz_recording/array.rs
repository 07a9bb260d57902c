//! Arrays of an npz file as streams, with memory for what is read.

use crate::FormatError;
use crate::npy::{data_start, is_flat_header};
use crate::zip_entries::ZipFileArchive;
use flate2::bufread::DeflateDecoder;
use npyz::{DType, NpyHeader, Order};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use zip::CompressionMethod;

/// Longest header, bytes; NumPy writes 128.
const MAX_NPY_HEADER: usize = 4096;

/// Type of an array's numbers, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    U8,
    U16,
    I32,
    I64,
    F32,
    F64,
}

impl NumberType {
    fn of(descr: &str) -> Option<Self> {
        match descr {
            "|u1" => Some(Self::U8),
            "<u2" => Some(Self::U16),
            "<i4" => Some(Self::I32),
            "<i8" => Some(Self::I64),
            "<f4" => Some(Self::F32),
            "<f8" => Some(Self::F64),
            _ => None,
        }
    }

    /// Bytes of a number.
    pub(super) fn size(self) -> u64 {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::I32 | Self::F32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }

    /// All numbers of these bytes.
    pub(super) fn numbers(self, bytes: &[u8]) -> Vec<f64> {
        fn parse<const N: usize>(bytes: &[u8], f: impl Fn([u8; N]) -> f64) -> Vec<f64> {
            bytes.as_chunks::<N>().0.iter().map(|c| f(*c)).collect()
        }
        match self {
            Self::U8 => bytes.iter().map(|b| f64::from(*b)).collect(),
            Self::U16 => parse(bytes, |b| f64::from(u16::from_le_bytes(b))),
            Self::I32 => parse(bytes, |b| f64::from(i32::from_le_bytes(b))),
            Self::I64 => parse(bytes, |b| i64::from_le_bytes(b) as f64),
            Self::F32 => parse(bytes, |b| f64::from(f32::from_le_bytes(b))),
            Self::F64 => parse(bytes, f64::from_le_bytes),
        }
    }
}

/// Place of an entry's bytes in the file.
#[derive(Clone, Copy, Debug)]
struct EntryPlace {
    at: u64,
    size: u64,
    is_deflated: bool,
}

/// An array, read from its first number on.
pub(super) struct ArrayStream {
    path: PathBuf,
    name: String,
    place: EntryPlace,
    /// Bytes before the numbers.
    header: usize,
    reader: Box<dyn Read + Send>,
    /// Lengths, outermost first.
    pub(super) shape: Vec<u64>,
    /// Type of the numbers.
    pub(super) number: NumberType,
    /// True if the first index runs fastest.
    pub(super) is_fortran: bool,
}

impl std::fmt::Debug for ArrayStream {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ArrayStream")
            .field("name", &self.name)
            .field("shape", &self.shape)
            .field("number", &self.number)
            .finish_non_exhaustive()
    }
}

impl ArrayStream {
    /// Opens the array `name`; `None` if there is none.
    ///
    /// # Errors
    /// Damage, an unknown compression, or a type that is none of [`NumberType`].
    pub(super) fn open(
        path: &Path,
        zip: &mut ZipFileArchive,
        name: &str,
    ) -> Result<Option<Self>, FormatError> {
        let fault = |why: String| FormatError::field(path, name, why);
        let file = npyz::npz::file_name_from_array_name(name);
        if !zip.file_names().any(|n| n == file) {
            return Ok(None);
        }
        let entry = zip.by_name(&file).map_err(|e| fault(e.to_string()))?;
        let place = EntryPlace {
            at: entry.data_start(),
            size: entry.compressed_size(),
            is_deflated: match entry.compression() {
                CompressionMethod::Stored => false,
                CompressionMethod::Deflated => true,
                other => return Err(fault(format!("compression {other} is not read"))),
            },
        };
        let stated = entry.size();
        drop(entry);
        let mut reader = reader_at(path, place)?;
        let bytes = header_bytes(&mut *reader).map_err(fault)?;
        let header = NpyHeader::from_reader(&bytes[..])
            .map_err(|e| fault(format!("not a numpy array ({e})")))?;
        let number = number_type(&header.dtype()).map_err(fault)?;
        let shape = header.shape().to_vec();
        let count = shape
            .iter()
            .try_fold(number.size(), |n, d| n.checked_mul(*d));
        if count.and_then(|n| n.checked_add(bytes.len() as u64)) != Some(stated) {
            return Err(fault(format!(
                "shape {shape:?} does not match its {stated} bytes"
            )));
        }
        Ok(Some(Self {
            path: path.to_owned(),
            name: name.to_owned(),
            place,
            header: bytes.len(),
            reader,
            shape,
            number,
            is_fortran: header.order() == Order::Fortran,
        }))
    }

    /// The next `count` numbers' bytes.
    ///
    /// # Errors
    /// When the file cannot be read, is damaged or ends before.
    pub(super) fn read(&mut self, count: u64) -> Result<Vec<u8>, FormatError> {
        let wanted = count.saturating_mul(self.number.size());
        // The buffer grows as bytes arrive: the stated shape alone allocates nothing.
        let mut bytes = Vec::new();
        let read = (&mut self.reader).take(wanted).read_to_end(&mut bytes);
        read.map_err(|e| FormatError::io(&self.path, e))?;
        if bytes.len() as u64 == wanted {
            return Ok(bytes);
        }
        let why = format!("cut short: {} of {wanted} bytes", bytes.len());
        Err(FormatError::field(&self.path, &self.name, why))
    }

    /// Returns to the first number.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(super) fn rewind(&mut self) -> Result<(), FormatError> {
        self.reader = reader_at(&self.path, self.place)?;
        let header = (&mut self.reader).take(self.header as u64);
        std::io::copy(&mut { header }, &mut std::io::sink())
            .map(|_| ())
            .map_err(|e| FormatError::io(&self.path, e))
    }
}

/// Plain bytes of an entry.
fn reader_at(path: &Path, place: EntryPlace) -> Result<Box<dyn Read + Send>, FormatError> {
    let io = |e| FormatError::io(path, e);
    let mut file = File::open(path).map_err(io)?;
    file.seek(SeekFrom::Start(place.at)).map_err(io)?;
    let bytes = BufReader::new(file.take(place.size));
    Ok(match place.is_deflated {
        true => Box::new(DeflateDecoder::new(bytes)),
        false => Box::new(bytes),
    })
}

/// Header of an array with its magic.
fn header_bytes(reader: &mut dyn Read) -> Result<Vec<u8>, String> {
    let mut bytes = vec![0; 12];
    let cut = |e: std::io::Error| format!("too short for a numpy array ({e})");
    reader.read_exact(&mut bytes).map_err(cut)?;
    let end = data_start(&bytes).filter(|end| (12..=MAX_NPY_HEADER).contains(end));
    let end = end.ok_or("its header is no numpy array's")?;
    bytes.resize(end, 0);
    reader.read_exact(&mut bytes[12..]).map_err(cut)?;
    if is_flat_header(&bytes) {
        return Ok(bytes);
    }
    Err("its header nests more than an array's".to_owned())
}

fn number_type(dtype: &DType) -> Result<NumberType, String> {
    let descr = dtype.descr();
    NumberType::of(descr.trim_matches('\'')).ok_or_else(|| format!("type {descr} is not read"))
}
