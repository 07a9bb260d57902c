//! MakeHuman's morph targets: offsets of single vertices of a base mesh, as `.target` text, plain or gzipped.

use super::FormatError;
use super::image::read_limited;
use flate2::read::GzDecoder;
use std::io::Read;
use std::path::Path;

/// Largest text, bytes; the largest shared target has 600 kB.
const MAX_BYTES: u64 = 64 << 20;
/// Metres in MakeHuman's unit, the decimetre.
pub const MAKEHUMAN_UNIT: f32 = 0.1;

/// Offsets of vertices, metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphTarget {
    /// Vertex of the base mesh and its offset at weight 1.
    pub offsets: Vec<(u32, [f32; 3])>,
}

impl MorphTarget {
    /// Adds the offsets times `weight`. Vertices beyond the end of `vertices` (helpers of the base mesh) are left out.
    pub fn add_to(&self, vertices: &mut [[f32; 3]], weight: f32) {
        for (i, offset) in &self.offsets {
            if let Some(v) = vertices.get_mut(*i as usize) {
                for (c, o) in v.iter_mut().zip(offset) {
                    *c += o * weight;
                }
            }
        }
    }
}

/// Reads a `.target` or `.target.gz` file.
///
/// # Errors
/// Names the line that is no vertex and offset.
pub fn read_morph_target(path: &Path) -> Result<MorphTarget, FormatError> {
    let bytes = read_limited(path, MAX_BYTES)?;
    let mut text = String::new();
    let read = if path.extension().is_some_and(|e| e == "gz") {
        let mut unpacked = GzDecoder::new(bytes.as_slice()).take(MAX_BYTES);
        unpacked.read_to_string(&mut text)
    } else {
        bytes.as_slice().read_to_string(&mut text)
    };
    read.map_err(|e| FormatError::io(path, e))?;
    parse_morph_target(&text, path)
}

/// Parses the text of a target; `origin` is named in errors.
///
/// # Errors
/// As [`read_morph_target`].
pub fn parse_morph_target(text: &str, origin: &Path) -> Result<MorphTarget, FormatError> {
    let mut offsets = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with(['#', '"']) {
            continue;
        }
        let fault = || {
            FormatError::field(
                origin,
                format!("line {}", number + 1),
                "it is not `vertex dx dy dz`",
            )
        };
        let mut words = line.split_whitespace();
        let vertex = words.next().and_then(|w| w.parse().ok());
        let numbers: Result<Vec<f32>, _> = words.map(str::parse).collect();
        let numbers = numbers.map_err(|_| fault())?;
        let (Some(vertex), &[x, y, z]) = (vertex, numbers.as_slice()) else {
            return Err(fault());
        };
        let offset = [x, y, z].map(|c| c * MAKEHUMAN_UNIT);
        if !offset.iter().all(|c| c.is_finite()) {
            return Err(fault());
        }
        offsets.push((vertex, offset));
    }
    Ok(MorphTarget { offsets })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_metres_and_helpers_are_left_out() {
        let text = "# a comment\n0 .5 0 -1\n\n7 1 1 1\n";
        let target = parse_morph_target(text, Path::new("a.target")).expect("valid");
        let mut vertices = [[1.0, 0.0, 0.0]];
        target.add_to(&mut vertices, 2.0);
        assert_eq!(vertices, [[1.1, 0.0, -0.2]]);
        assert_eq!(target.offsets.len(), 2);
    }

    #[test]
    fn broken_lines_are_named_and_broken_archives_refused() {
        for text in ["0 1 2", "x 1 2 3", "0 1 2 nan", "0 1 2 3 4"] {
            let fault = parse_morph_target(text, Path::new("a.target")).expect_err(text);
            assert!(fault.to_string().contains("line 1"), "{fault}");
        }
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("a.target.gz");
        std::fs::write(&path, "no archive").expect("written");
        assert!(read_morph_target(&path).is_err());
    }
}
