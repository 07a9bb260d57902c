//! Edges and boundaries of faces that need not be manifold. [`super::Topology`] has those of a manifold.

use super::{Csr, Face};
use std::collections::BTreeMap;

/// Directed sides of a face.
pub fn sides(f: &Face) -> [[u32; 2]; 3] {
    [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]
}

/// A side without its direction: smaller vertex first.
pub fn undirected([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Edges, each once, smaller vertex first, ascending. A side from a vertex to itself is none.
pub fn edges(faces: &[Face]) -> Vec<[u32; 2]> {
    let rows = faces.iter().flatten().max().map_or(0, |v| *v as usize + 1);
    let sides = faces.iter().flat_map(sides).filter(|[a, b]| a != b);
    let pairs: Vec<(u32, u32)> = sides.map(|side| undirected(side).into()).collect();
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

/// Edge and face of each side, ascending: `chunk_by` groups the faces of an edge.
pub fn edge_faces(faces: &[Face]) -> Vec<([u32; 2], u32)> {
    let of = |(n, f)| sides(f).map(|side| (undirected(side), n));
    let mut all: Vec<_> = (0..).zip(faces).flat_map(of).collect();
    all.sort_unstable();
    all
}

/// Directed sides without an opposite one, each once, ascending.
pub fn boundary_edges(faces: &[Face]) -> Vec<[u32; 2]> {
    let mut all: Vec<[u32; 2]> = faces.iter().flat_map(sides).collect();
    all.sort_unstable();
    all.dedup();
    let is_open = |[a, b]: &&[u32; 2]| all.binary_search(&[*b, *a]).is_err();
    all.iter().filter(is_open).copied().collect()
}

/// Loops of [`boundary_edges`] along their directions, each from its smallest vertex. Where boundaries meet at a vertex, they
/// leave it along the last of its edges only.
pub fn boundary_loops(faces: &[Face]) -> Vec<Vec<u32>> {
    let sides = boundary_edges(faces).into_iter();
    let mut next: BTreeMap<u32, u32> = sides.map(|[a, b]| (a, b)).collect();
    let mut loops = Vec::new();
    while let Some((&first, _)) = next.first_key_value() {
        let mut ring = Vec::new();
        let mut at = first;
        while let Some(b) = next.remove(&at) {
            ring.push(at);
            at = b;
        }
        loops.push(ring);
    }
    loops
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of two triangles, a third on its diagonal, and one with a corner twice.
    const FAN: [Face; 4] = [[0, 1, 2], [0, 2, 3], [2, 0, 4], [3, 3, 5]];

    #[test]
    fn edges_of_fans_and_collapsed_faces() {
        let sides = [
            [0, 1],
            [0, 2],
            [0, 3],
            [0, 4],
            [1, 2],
            [2, 3],
            [2, 4],
            [3, 5],
        ];
        assert_eq!(edges(&FAN), sides);
        assert_eq!(edges(&[]), [[0; 2]; 0]);
        let of_edge = |e| {
            let all = edge_faces(&FAN);
            let own = all.iter().filter(|(edge, _)| *edge == e);
            own.map(|(_, f)| *f).collect::<Vec<_>>()
        };
        assert_eq!(of_edge([0, 2]), [0, 1, 2]);
        assert_eq!(of_edge([3, 5]), [3, 3]);
    }

    #[test]
    fn boundaries_run_along_their_faces() {
        assert_eq!(boundary_edges(&FAN[..2]), [[0, 1], [1, 2], [2, 3], [3, 0]]);
        assert_eq!(boundary_loops(&FAN[..2]), [[0, 1, 2, 3]]);
        assert_eq!(
            boundary_edges(&FAN[3..]),
            [[0; 2]; 0],
            "it is its own opposite"
        );
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        assert_eq!(edges(&tetrahedron).len(), 6);
        assert!(boundary_edges(&tetrahedron).is_empty());
        assert!(boundary_loops(&tetrahedron).is_empty());
        let two = [[0, 1, 2], [5, 3, 4]];
        assert_eq!(boundary_loops(&two), [[0, 1, 2], [3, 4, 5]]);
    }

    #[test]
    fn loops_end_where_boundaries_meet() {
        let bow_tie = [[0, 1, 2], [0, 3, 4]];
        assert_eq!(boundary_edges(&bow_tie).len(), 6);
        assert_eq!(boundary_loops(&bow_tie), [vec![0, 3, 4], vec![1, 2]]);
    }
}
