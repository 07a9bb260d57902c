//! An npy file that grows frame by frame and is valid after each: shape `[frames, vertices, 3]`, f32, little-endian.

use super::FormatError;
use super::npy::data_start;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tryon_geometry::math::P3;

/// Bytes before the values, at any number of frames.
const HEADER: u64 = 128;
/// Magic, version 1.0, and the length of the rest of the header.
const PREFIX: [u8; 10] = *b"\x93NUMPY\x01\x00\x76\x00";

/// Positions over time in a file.
#[derive(Debug)]
pub struct NpyFrames {
    file: File,
    path: PathBuf,
    vertices: usize,
    frames: usize,
}

/// Header of this many frames, padded with spaces.
fn header(frames: usize, vertices: usize) -> Vec<u8> {
    let shape =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({frames}, {vertices}, 3), }}");
    let mut out = PREFIX.to_vec();
    out.extend(shape.as_bytes());
    out.resize(HEADER as usize - 1, b' ');
    out.push(b'\n');
    out
}

impl NpyFrames {
    /// An empty file, in place of one of that name.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path, vertices: usize) -> Result<Self, FormatError> {
        let io = |e| FormatError::io(path, e);
        let mut file = (OpenOptions::new().read(true).write(true))
            .create(true)
            .truncate(true)
            .open(path)
            .map_err(io)?;
        file.write_all(&header(0, vertices)).map_err(io)?;
        let path = path.to_owned();
        let frames = 0;
        Ok(Self {
            file,
            path,
            vertices,
            frames,
        })
    }

    /// The first `frames` frames of a file that this type wrote; further ones are dropped.
    ///
    /// # Errors
    /// When the file has fewer, or another number of vertices, or cannot be read.
    pub fn resume(path: &Path, vertices: usize, frames: usize) -> Result<Self, FormatError> {
        let io = |e| FormatError::io(path, e);
        let mut file = (OpenOptions::new().read(true).write(true))
            .open(path)
            .map_err(io)?;
        let mut start = vec![0; HEADER as usize];
        file.read_exact(&mut start).map_err(io)?;
        let is_own = data_start(&start) == Some(HEADER as usize)
            && String::from_utf8_lossy(&start).contains(&format!(", {vertices}, 3)"));
        if !is_own {
            let why = format!("no positions of {vertices} vertices");
            return Err(FormatError::field(path, "shape", why));
        }
        let length = HEADER + frames as u64 * frame_bytes(vertices);
        if file.metadata().map_err(io)?.len() < length {
            let why = format!("fewer than {frames} frames");
            return Err(FormatError::field(path, "shape", why));
        }
        file.set_len(length).map_err(io)?;
        let path = path.to_owned();
        let mut out = Self {
            file,
            path,
            vertices,
            frames,
        };
        out.write_header()?;
        Ok(out)
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// When it has another number of vertices or cannot be written.
    pub fn push(&mut self, positions: &[P3]) -> Result<(), FormatError> {
        if positions.len() != self.vertices {
            let why = format!("{} for {} vertices", positions.len(), self.vertices);
            return Err(FormatError::field(&self.path, "frame", why));
        }
        let coordinates = positions.iter().flat_map(|p| [p.x, p.y, p.z]);
        let bytes: Vec<u8> = coordinates.flat_map(f32::to_le_bytes).collect();
        let io = |e| FormatError::io(&self.path, e);
        self.file.seek(SeekFrom::End(0)).map_err(io)?;
        self.file.write_all(&bytes).map_err(io)?;
        self.frames += 1;
        self.write_header()
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frames
    }

    /// True without frames.
    pub fn is_empty(&self) -> bool {
        self.frames == 0
    }

    /// Positions of all frames (m), shape `[frames][vertices]`.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn read(&mut self) -> Result<Vec<Vec<P3>>, FormatError> {
        let io = |e| FormatError::io(&self.path, e);
        self.file.seek(SeekFrom::Start(HEADER)).map_err(io)?;
        let mut bytes = vec![0; frame_bytes(self.vertices) as usize];
        let mut frames = Vec::with_capacity(self.frames);
        for _ in 0..self.frames {
            self.file.read_exact(&mut bytes).map_err(io)?;
            let value = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            let points = bytes.chunks_exact(12);
            let point = |p: &[u8]| P3::new(value(p), value(&p[4..]), value(&p[8..]));
            frames.push(points.map(point).collect());
        }
        Ok(frames)
    }

    fn write_header(&mut self) -> Result<(), FormatError> {
        let header = header(self.frames, self.vertices);
        let start = self.file.seek(SeekFrom::Start(0));
        (start.and_then(|_| self.file.write_all(&header)))
            .map_err(|e| FormatError::io(&self.path, e))
    }
}

fn frame_bytes(vertices: usize) -> u64 {
    12 * vertices as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npy::read_npy;

    #[test]
    fn the_file_is_valid_after_each_frame_and_after_a_resume() {
        let dir = tempfile::tempdir().expect("temporary folder");
        let path = dir.path().join("a.npy");
        let frame = |k: f32| vec![P3::new(k, 1.0, 2.0), P3::new(3.0, k, 5.0)];
        let mut file = NpyFrames::create(&path, 2).expect("created");
        assert_eq!(read_npy(&path).expect("read").0, [0, 2, 3]);
        for k in 0..3 {
            file.push(&frame(k as f32)).expect("written");
        }
        let (shape, values) = read_npy(&path).expect("read");
        assert_eq!((shape, values[15]), (vec![3, 2, 3], 3.0));
        assert_eq!(file.read().expect("read"), [0.0, 1.0, 2.0].map(frame));

        let mut again = NpyFrames::resume(&path, 2, 1).expect("resumed");
        again.push(&frame(7.0)).expect("written");
        assert_eq!(again.read().expect("read"), [0.0, 7.0].map(frame));
        assert_eq!(read_npy(&path).expect("read").0, [2, 2, 3]);
        for (vertices, frames) in [(3, 1), (2, 3)] {
            assert!(NpyFrames::resume(&path, vertices, frames).is_err());
        }
        assert!(again.push(&[]).is_err());
    }
}
