//! Records of a compressed chunk as a stream: memory for a decompressor's window, whatever the chunk states.

use bzip2::read::BzDecoder;
use flate2::Crc;
use std::io::{self, BufRead, Read};

/// Most bytes read at a time.
const BUFFER: u64 = 1 << 16;

/// Buffer of a reader of `length` bytes: small files need no more than they have.
pub(super) fn buffer_size(length: u64) -> usize {
    length.min(BUFFER) as usize
}

/// Compression of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChunkCompression {
    Stored,
    Bz2,
    Lz4,
    Zstd,
}

/// Decompressed bytes of a chunk, as many as its header states.
pub(super) struct ChunkRecords {
    decompressed: Box<dyn Read + Send>,
    /// Bytes to come.
    remaining: u64,
    /// CRC-32 so far, and the one stated.
    checksum: Option<(Crc, u32)>,
}

impl ChunkRecords {
    /// Stream of a chunk whose records have `size` bytes.
    ///
    /// # Errors
    /// No memory for a decompressor.
    pub(super) fn new(
        compression: ChunkCompression,
        size: u64,
        chunk: impl BufRead + Send + 'static,
    ) -> io::Result<Self> {
        let decompressed: Box<dyn Read + Send> = match compression {
            ChunkCompression::Stored => Box::new(chunk),
            ChunkCompression::Bz2 => Box::new(BzDecoder::new(chunk)),
            ChunkCompression::Lz4 => Box::new(lz4::Decoder::new(chunk)?),
            ChunkCompression::Zstd => Box::new(zstd::stream::read::Decoder::with_buffer(chunk)?),
        };
        Ok(Self {
            decompressed,
            remaining: size,
            checksum: None,
        })
    }

    /// The same with a checksum (CRC-32), compared at the end.
    pub(super) fn checked(self, crc: u32) -> Self {
        Self {
            checksum: Some((Crc::new(), crc)),
            ..self
        }
    }
}

impl Read for ChunkRecords {
    /// Fewer bytes than stated, or a wrong checksum, are an error and not an end.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let most = usize::try_from(self.remaining).unwrap_or(usize::MAX);
        let want = buffer.len().min(most);
        if want == 0 {
            return Ok(0);
        }
        let got = self.decompressed.read(&mut buffer[..want])?;
        if got == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.remaining -= got as u64;
        if let Some((crc, stated)) = &mut self.checksum {
            crc.update(&buffer[..got]);
            if self.remaining == 0 && crc.sum() != *stated {
                return Err(io::Error::other("wrong checksum"));
            }
        }
        Ok(got)
    }
}

/// Reads `length` bytes into `data`; its memory grows with the bytes there are, not with the length.
///
/// # Errors
/// Fewer bytes.
pub(super) fn read_bytes(from: &mut dyn Read, length: u64, data: &mut Vec<u8>) -> io::Result<()> {
    data.clear();
    let read = from.take(length).read_to_end(data)?;
    match (read as u64) < length {
        true => Err(io::ErrorKind::UnexpectedEof.into()),
        false => Ok(()),
    }
}

/// Skips `length` bytes.
///
/// # Errors
/// Fewer bytes.
pub(super) fn skip_bytes(from: &mut dyn Read, length: u64) -> io::Result<()> {
    let skipped = io::copy(&mut from.take(length), &mut io::sink())?;
    match skipped < length {
        true => Err(io::ErrorKind::UnexpectedEof.into()),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Cursor, Write};

    fn compressed(compression: ChunkCompression, data: &[u8]) -> Vec<u8> {
        match compression {
            ChunkCompression::Stored => data.to_vec(),
            ChunkCompression::Bz2 => {
                let mut e = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
                e.write_all(data).expect("written");
                e.finish().expect("finished")
            }
            ChunkCompression::Lz4 => {
                let encoder = lz4::EncoderBuilder::new().build(Vec::new());
                let mut e = encoder.expect("an encoder");
                e.write_all(data).expect("written");
                e.finish().0
            }
            ChunkCompression::Zstd => zstd::bulk::compress(data, 3).expect("compressed"),
        }
    }

    #[test]
    fn every_compression_streams_and_misses_nothing_in_silence() {
        let data: Vec<u8> = (0..100_000u32)
            .map(|i| (i.wrapping_mul(i) >> 7) as u8)
            .collect();
        let mut crc = Crc::new();
        crc.update(&data);
        for kind in [
            ChunkCompression::Stored,
            ChunkCompression::Bz2,
            ChunkCompression::Lz4,
            ChunkCompression::Zstd,
        ] {
            let bytes = compressed(kind, &data);
            let read = |bytes: &[u8], size: usize, crc: u32| {
                let chunk = Cursor::new(bytes.to_vec());
                let stream = ChunkRecords::new(kind, size as u64, chunk).expect("opens");
                let mut out = Vec::new();
                stream.checked(crc).read_to_end(&mut out).map(|_| out)
            };
            let all = read(&bytes, data.len(), crc.sum()).expect("reads");
            assert_eq!(all, data, "{kind:?}");
            assert!(read(&bytes, data.len(), 1).is_err(), "{kind:?}");
            assert!(read(&bytes, data.len() + 1, crc.sum()).is_err(), "{kind:?}");
            let half = &bytes[..bytes.len() / 2];
            assert!(read(half, data.len(), crc.sum()).is_err(), "{kind:?}");
        }
    }
}
