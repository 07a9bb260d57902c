//! Triangles of a glTF primitive: list, strip or fan (glTF 2.0, section 3.7.2.1).

use ::gltf::mesh::Mode;
use tryon_geometry::mesh::Face;

/// Triangles of vertex indices, and the number of degenerate ones of a list, which are left out. Those of a strip link its
/// parts. `None` for points and lines.
///
/// # Errors
/// A list of another number than three times triangles.
pub(super) fn triangles(corners: &[u32], mode: Mode) -> Result<Option<(Vec<Face>, usize)>, String> {
    let n = corners.len();
    let all: Vec<Face> = match mode {
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return Ok(None),
        Mode::Triangles if !n.is_multiple_of(3) => {
            return Err(format!("{n} do not make triangles"));
        }
        Mode::Triangles => corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
        Mode::TriangleStrip => {
            let each = corners.windows(3).enumerate();
            // Every other triangle of a strip runs the other way.
            each.map(|(k, c)| match k % 2 {
                0 => [c[0], c[1], c[2]],
                _ => [c[0], c[2], c[1]],
            })
            .collect()
        }
        Mode::TriangleFan => {
            let sides = corners.get(1..).unwrap_or_default().windows(2);
            sides.map(|c| [c[0], c[1], corners[0]]).collect()
        }
    };
    let is_proper = |f: &Face| f[0] != f[1] && f[1] != f[2] && f[0] != f[2];
    let proper: Vec<Face> = all.iter().copied().filter(is_proper).collect();
    let degenerate = match mode {
        Mode::Triangles => all.len() - proper.len(),
        _ => 0,
    };
    Ok(Some((proper, degenerate)))
}
