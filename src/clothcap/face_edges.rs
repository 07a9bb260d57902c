//! Edges of faces that need not be manifold.

use crate::mesh::{Csr, Face};

/// Directed sides of a face.
pub(super) fn sides(f: &Face) -> [[u32; 2]; 3] {
    [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]
}

/// Edges of some faces, each once, smaller vertex first, sorted.
pub(super) fn edges(faces: &[Face]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = faces.iter().flat_map(sides).collect();
    edges.iter_mut().for_each(|e| e.sort_unstable());
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Neighbours of each of `vertices` vertices by some edges.
pub(super) fn neighbours(vertices: usize, edges: &[[u32; 2]]) -> Csr {
    let both = |e: &[u32; 2]| [(e[0], e[1]), (e[1], e[0])];
    Csr::from_pairs(vertices, &edges.iter().flat_map(both).collect::<Vec<_>>())
}
