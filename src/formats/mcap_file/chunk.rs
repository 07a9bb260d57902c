//! Header of an MCAP chunk, before its records.

use super::record::take;
use crate::chunk_records::{ChunkCompression, ChunkRecords};
use std::io::{self, BufRead};

/// Bytes of the header with a compression's name of no length.
const LEAST_HEADER: usize = 40;
/// Longest name of a compression, bytes.
const LONGEST_NAME: u32 = 32;

/// Fault of a chunk or a record.
#[derive(Debug)]
pub(super) enum McapFault {
    /// Unusable field, and why.
    Field(String, String),
    /// Error of the system or a decompressor, or the end of the bytes.
    Io(io::Error),
}

impl From<io::Error> for McapFault {
    fn from(e: io::Error) -> Self {
        Self::Io(e)
    }
}

impl McapFault {
    pub(super) fn field(field: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Field(field.into(), why.into())
    }
}

/// Records of a chunk whose header begins `chunk`, of `length` bytes.
///
/// # Errors
/// A header that is cut short, an unknown compression, or lengths that contradict each other.
pub(super) fn records(
    mut chunk: impl BufRead + Send + 'static,
    length: u64,
) -> Result<ChunkRecords, McapFault> {
    let mut header = [0; LEAST_HEADER - 8];
    chunk.read_exact(&mut header)?;
    let mut rest = &header[16..];
    let cut = || McapFault::field("chunk", "its header is cut short");
    let size = u64::from_le_bytes(take(&mut rest).ok_or_else(cut)?);
    let crc = u32::from_le_bytes(take(&mut rest).ok_or_else(cut)?);
    let name_length = u32::from_le_bytes(take(&mut rest).ok_or_else(cut)?);
    if name_length > LONGEST_NAME {
        let why = format!("a name of {name_length} bytes, expected at most {LONGEST_NAME}");
        return Err(McapFault::field("chunk.compression", why));
    }
    let mut name = vec![0; name_length as usize];
    chunk.read_exact(&mut name)?;
    let mut compressed = [0; 8];
    chunk.read_exact(&mut compressed)?;
    let compressed = u64::from_le_bytes(compressed);
    let header_length = LEAST_HEADER as u64 + u64::from(name_length);
    if length
        .checked_sub(header_length)
        .is_none_or(|rest| compressed > rest)
    {
        let why = format!("{compressed} bytes, the chunk has {length} in all");
        return Err(McapFault::field("chunk.records", why));
    }
    let compression = match &name[..] {
        b"" => ChunkCompression::Stored,
        b"lz4" => ChunkCompression::Lz4,
        b"zstd" => ChunkCompression::Zstd,
        other => {
            let name = String::from_utf8_lossy(other);
            let why = format!("`{name}`, expected none, lz4 or zstd");
            return Err(McapFault::field("chunk.compression", why));
        }
    };
    let records = ChunkRecords::new(compression, size, chunk.take(compressed))?;
    // Zero: not stated.
    Ok(match crc {
        0 => records,
        crc => records.checked(crc),
    })
}
