//! Edges of faces that need not be manifold.

use tryon_geometry::mesh::{Csr, Face};

/// Directed sides of a face.
pub(super) fn sides(f: &Face) -> [[u32; 2]; 3] {
    [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]
}

/// Edges of some faces, each once, smaller vertex first, sorted.
pub(super) fn edges(faces: &[Face]) -> Vec<[u32; 2]> {
    let rows = faces.iter().flatten().max().map_or(0, |v| *v as usize + 1);
    let ascending = |[a, b]: [u32; 2]| (a.min(b), a.max(b));
    let pairs: Vec<(u32, u32)> = faces.iter().flat_map(sides).map(ascending).collect();
    let by_first = Csr::from_pairs(rows, &pairs);
    let mut out = Vec::with_capacity(pairs.len() / 2);
    let mut row = Vec::new();
    for a in 0..rows as u32 {
        row.clear();
        row.extend_from_slice(by_first.row(a as usize));
        row.sort_unstable();
        row.dedup();
        out.extend(row.iter().map(|b| [a, *b]));
    }
    out
}

/// Neighbours of each of `vertices` vertices by some edges.
pub(super) fn neighbours(vertices: usize, edges: &[[u32; 2]]) -> Csr {
    let both = |e: &[u32; 2]| [(e[0], e[1]), (e[1], e[0])];
    Csr::from_pairs(vertices, &edges.iter().flat_map(both).collect::<Vec<_>>())
}
