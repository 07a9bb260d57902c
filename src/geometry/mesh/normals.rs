//! Face and vertex normals.

use super::Face;
use crate::math::{P3, V3};
use crate::par::{self, Par};

/// Normal of a triangle times twice its area.
pub fn face_normal(vertices: &[P3], f: &Face) -> V3 {
    let [a, b, c] = f.map(|i| vertices[i as usize]);
    (b - a).cross(&(c - a))
}

/// Area-weighted unit vertex normals into `out`, shape `[vertices]`; zero where all faces are degenerate.
///
/// `vertex_faces` is [`super::Topology::vertex_faces`]: gathering instead of scattering keeps the sum's order
/// and so its bits, at any thread count.
pub fn vertex_normals(
    par: Par,
    vertices: &[P3],
    faces: &[Face],
    vertex_faces: &super::topology::Csr,
    out: &mut Vec<V3>,
) {
    // Each face normal serves three vertices.
    let mut normals = Vec::new();
    par::map_into(par, faces.len(), 2048, &mut normals, |f| {
        face_normal(vertices, &faces[f])
    });
    par::map_into(par, vertices.len(), 1024, out, |i| {
        let sum = vertex_faces
            .row(i)
            .iter()
            .fold(V3::zeros(), |s, &f| s + normals[f as usize]);
        sum.try_normalize(0.0).unwrap_or_else(V3::zeros)
    });
}

/// As [`vertex_normals`], of one vertex; `around` are the indices of its faces.
pub fn vertex_normal(vertices: &[P3], faces: &[Face], around: &[u32]) -> V3 {
    let sum = around.iter().fold(V3::zeros(), |s, &f| {
        s + face_normal(vertices, &faces[f as usize])
    });
    sum.try_normalize(0.0).unwrap_or_else(V3::zeros)
}
