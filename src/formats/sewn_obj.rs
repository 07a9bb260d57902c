//! OBJ files of sewn garments (Codim-IPC): a `stitch V A B T` line ties vertex V to the point A + T·(B − A).
//! Unlike faces, stitches count vertices from 0.

use super::FormatError;
use super::image::read_limited;
use super::obj::{ObjMesh, parse_obj};
use super::obj_text::lines;
use super::text_encoding::decode_text;
use std::path::Path;

/// Largest file, bytes; the shared dress of 15,656 vertices has 2.5 MB.
const MAX_BYTES: u64 = 512 << 20;

/// A vertex sewn to a point of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stitch {
    /// The vertex.
    pub vertex: u32,
    /// Ends of the edge.
    pub edge: [u32; 2],
    /// Parameter of the point on the edge, 0 at the first end to 1 at the second.
    pub at: f32,
}

/// Mesh of flat panels and its stitches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SewnObj {
    /// Positions, faces and texture coordinates; texture coordinates give the flat rest shape.
    pub obj: ObjMesh,
    /// Stitches, in the order of the file; empty for a mesh without stitches.
    pub stitches: Vec<Stitch>,
}

/// Reads an OBJ file with its stitches.
///
/// # Errors
/// As [`parse_sewn_obj`], or when the file cannot be read.
pub fn read_sewn_obj(path: &Path) -> Result<SewnObj, FormatError> {
    parse_sewn_obj(&decode_text(&read_limited(path, MAX_BYTES)?), path)
}

/// Parses OBJ text with its stitches; `origin` is named in errors.
///
/// # Errors
/// As [`parse_obj`]; a stitch at fault is named by its line.
pub fn parse_sewn_obj(text: &str, origin: &Path) -> Result<SewnObj, FormatError> {
    let obj = parse_obj(text, origin)?;
    let n = obj.mesh.vertices().len();
    let mut stitches = Vec::new();
    let is_stitch = |line: &str| line.split_whitespace().next() == Some("stitch");
    for (number, line) in lines(text).filter(|(_, line)| is_stitch(line)) {
        let name = format!("line {number}: stitch {}", stitches.len());
        let at = |why: String| FormatError::field(origin, name.clone(), why);
        let words: Vec<&str> = line.split_whitespace().skip(1).collect();
        let [v, a, b, t] = words.as_slice() else {
            return Err(at(format!(
                "{} numbers; a vertex, an edge's two ends and a share are needed",
                words.len()
            )));
        };
        let vertex = |w: &str| match w.parse::<usize>() {
            Ok(k) if k < n => Ok(k as u32),
            _ => Err(at(format!(
                "vertex `{w}` does not exist (the file has {n}, in stitches counted from 0)"
            ))),
        };
        let share = t.parse::<f32>().ok().filter(|t| (0.0..=1.0).contains(t));
        let share = share.ok_or_else(|| at(format!("`{t}` is no share between 0 and 1")))?;
        stitches.push(Stitch {
            vertex: vertex(v)?,
            edge: [vertex(a)?, vertex(b)?],
            at: share,
        });
    }
    Ok(SewnObj { obj, stitches })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\nf 4 5 6\nstitch 3 0 1 0.25\n";

    #[test]
    fn stitches_read_and_faults_are_named() {
        let parse = |t: &str| parse_sewn_obj(t, Path::new("d.obj")).map_err(|e| e.to_string());
        assert_eq!(
            parse(TEXT).expect("valid").stitches,
            [Stitch {
                vertex: 3,
                edge: [0, 1],
                at: 0.25
            }]
        );
        let e = parse(&TEXT.replace("stitch 3", "stitch 9")).expect_err("vertex");
        assert!(e.contains("line 9: stitch 0") && e.contains("`9`"), "{e}");
        assert!(
            parse(&TEXT.replace("0.25", "1.5"))
                .expect_err("share")
                .contains("1.5")
        );
        for cut in 0..TEXT.len() {
            let _ = parse(&TEXT[..cut]);
        }
    }
}
