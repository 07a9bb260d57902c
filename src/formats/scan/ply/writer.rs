//! PLY writer: little-endian scans with optional normals, colours and labels.

use crate::FormatError;
use std::fmt::Write as _;
use std::path::Path;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;

/// Coloured, labelled mesh to write.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlyMesh<'a> {
    /// Positions, shape `[points]`.
    pub points: &'a [P3],
    /// Triangles.
    pub faces: &'a [Face],
    /// Normals, shape `[points]`; empty for none.
    pub normals: &'a [V3],
    /// Colours, sRGB, shape `[points]`; empty for none.
    pub colors: &'a [[u8; 3]],
    /// Class of each point, shape `[points]`: the vertex property `label` (`uchar`).
    pub labels: Option<&'a [u8]>,
}

/// Writes a binary little-endian PLY file.
///
/// # Errors
/// Names an array of another length than the points, or a face whose index is out of range; or when the file cannot
/// be written.
pub fn write_ply(path: &Path, mesh: &PlyMesh<'_>) -> Result<(), FormatError> {
    check(mesh).map_err(|(field, why)| FormatError::field(path, field, why))?;
    let mut bytes = header(mesh).into_bytes();
    for (i, p) in mesh.points.iter().enumerate() {
        bytes.extend(p.iter().flat_map(|c| c.to_le_bytes()));
        if let Some(n) = mesh.normals.get(i) {
            bytes.extend(n.iter().flat_map(|c| c.to_le_bytes()));
        }
        bytes.extend(mesh.colors.get(i).into_iter().flatten());
        bytes.extend(mesh.labels.and_then(|l| l.get(i)));
    }
    for f in mesh.faces {
        bytes.push(3);
        bytes.extend(f.iter().flat_map(|i| i.to_le_bytes()));
    }
    std::fs::write(path, bytes).map_err(|e| FormatError::io(path, e))
}

/// Checks lengths and indices; the field at fault and the fault.
fn check(mesh: &PlyMesh<'_>) -> Result<(), (String, String)> {
    let n = mesh.points.len();
    // The indices are written as `int`, which most readers expect.
    if i32::try_from(n).is_err() {
        return Err(("points".into(), format!("{n} do not fit 32-bit indices")));
    }
    let optional = |length: usize| if length == 0 { n } else { length };
    for (field, length) in [
        ("normals", optional(mesh.normals.len())),
        ("colors", optional(mesh.colors.len())),
        ("labels", mesh.labels.map_or(n, <[u8]>::len)),
    ] {
        if length != n {
            return Err((field.into(), format!("{length} for {n} points")));
        }
    }
    let is_out = |f: &Face| f.iter().any(|i| *i as usize >= n);
    match mesh.faces.iter().position(is_out) {
        Some(face) => Err((
            format!("face {face}"),
            format!("an index is out of range ({n} points)"),
        )),
        None => Ok(()),
    }
}

fn header(mesh: &PlyMesh<'_>) -> String {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    let mut names = vec!["float x", "float y", "float z"];
    if !mesh.normals.is_empty() {
        names.extend(["float nx", "float ny", "float nz"]);
    }
    if !mesh.colors.is_empty() {
        names.extend(["uchar red", "uchar green", "uchar blue"]);
    }
    if mesh.labels.is_some() {
        names.push("uchar label");
    }
    let _ = writeln!(text, "element vertex {}", mesh.points.len());
    for name in names {
        let _ = writeln!(text, "property {name}");
    }
    let _ = writeln!(text, "element face {}", mesh.faces.len());
    text.push_str("property list uchar int vertex_indices\nend_header\n");
    text
}
