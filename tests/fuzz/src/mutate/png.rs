//! Mutations of PNG chunks, whose checksums are made right again, and of the pixels within.

use super::Mutator;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};
use rand::Rng;
use std::io::{Read, Write};

const SIGNATURE: &[u8; 8] = b"\x89PNG\r\n\x1a\n";
/// Most bytes that are unpacked for a mutation.
const MOST: u64 = 1 << 18;

struct Chunk {
    kind: [u8; 4],
    data: Vec<u8>,
}

impl Mutator<'_> {
    pub(super) fn png(&mut self, b: &mut Vec<u8>, donor: &[u8]) {
        let Some(mut chunks) = parse(b).filter(|c| !c.is_empty()) else {
            return self.bytes(b, donor);
        };
        let (i, j) = (self.index(chunks.len()), self.index(chunks.len()));
        match self.rng.random_range(0..8) {
            0 => {
                chunks.remove(i);
            }
            1 => chunks.swap(i, j),
            2 => {
                let kinds = [
                    b"tRNS", b"PLTE", b"gAMA", b"acTL", b"fcTL", b"IDAT", b"iCCP",
                ];
                chunks[i].kind = *kinds[self.rng.random_range(0..kinds.len())];
            }
            3 | 4 if chunks[i].kind == *b"IDAT" => self.pixels(&mut chunks[i].data, donor),
            _ => self.bytes(&mut chunks[i].data, donor),
        }
        *b = write(&chunks);
    }

    fn pixels(&mut self, data: &mut Vec<u8>, donor: &[u8]) {
        let mut raw = Vec::new();
        let _ = ZlibDecoder::new(&data[..]).take(MOST).read_to_end(&mut raw);
        self.bytes(&mut raw, donor);
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
        if packed.write_all(&raw).is_ok()
            && let Ok(bytes) = packed.finish()
        {
            *data = bytes;
        }
    }
}

fn parse(b: &[u8]) -> Option<Vec<Chunk>> {
    let mut rest = b.strip_prefix(SIGNATURE)?;
    let mut chunks = Vec::new();
    while let Some((head, after)) = rest.split_first_chunk::<8>() {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let (data, after) = after.split_at_checked(length)?;
        chunks.push(Chunk {
            kind: [head[4], head[5], head[6], head[7]],
            data: data.to_vec(),
        });
        rest = after.get(4..)?;
    }
    Some(chunks)
}

fn write(chunks: &[Chunk]) -> Vec<u8> {
    let mut out = SIGNATURE.to_vec();
    for c in chunks {
        let mut crc = Crc::new();
        crc.update(&c.kind);
        crc.update(&c.data);
        out.extend_from_slice(&(c.data.len() as u32).to_be_bytes());
        out.extend_from_slice(&c.kind);
        out.extend_from_slice(&c.data);
        out.extend_from_slice(&crc.sum().to_be_bytes());
    }
    out
}
