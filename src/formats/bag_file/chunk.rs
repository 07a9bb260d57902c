//! Records within a chunk, decompressed as they are read.

use super::record::RecordFault;
use bzip2::read::BzDecoder;
use std::io::{self, Read};

/// Bytes of a chunk's records, as many as its header states.
pub(super) struct ChunkRecords {
    decompressed: Box<dyn Read + Send>,
    /// Bytes to come.
    remaining: u64,
}

impl ChunkRecords {
    /// Decompressor of a chunk whose records have `size` bytes.
    ///
    /// # Errors
    /// A compression other than `none`, `bz2` and `lz4`.
    pub(super) fn new(
        compression: &[u8],
        size: u32,
        chunk: impl Read + Send + 'static,
    ) -> Result<Self, RecordFault> {
        let decompressed: Box<dyn Read + Send> = match compression {
            b"none" => Box::new(chunk),
            b"bz2" => Box::new(BzDecoder::new(chunk)),
            b"lz4" => Box::new(lz4::Decoder::new(chunk)?),
            other => {
                let name = String::from_utf8_lossy(other);
                let why = format!("`{name}`, expected none, bz2 or lz4");
                return Err(RecordFault::Field("compression", why));
            }
        };
        Ok(Self {
            decompressed,
            remaining: size.into(),
        })
    }
}

impl Read for ChunkRecords {
    /// Fewer bytes than stated are an error, not an end.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let want = buffer.len().min(self.remaining as usize);
        if want == 0 {
            return Ok(0);
        }
        let got = self.decompressed.read(&mut buffer[..want])?;
        if got == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.remaining -= got as u64;
        Ok(got)
    }
}
