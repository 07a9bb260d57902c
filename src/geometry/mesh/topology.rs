//! Connectivity of a triangle mesh: edges, hinges, neighbours, boundaries.

use super::{Face, MeshError, TriMesh};
use std::collections::BTreeMap;

/// Compressed sparse rows: a list of items, indices if nothing else is said, for each vertex.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Csr<T = u32> {
    offsets: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Default> Csr<T> {
    /// Groups `(row, item)` pairs; items of a row keep their order in `pairs`.
    pub fn from_pairs(rows: usize, pairs: &[(u32, T)]) -> Self {
        let mut offsets = vec![0u32; rows + 1];
        for &(r, _) in pairs {
            offsets[r as usize + 1] += 1;
        }
        for i in 0..rows {
            offsets[i + 1] += offsets[i];
        }
        let mut next = offsets.clone();
        let mut items = vec![T::default(); pairs.len()];
        for &(r, item) in pairs {
            items[next[r as usize] as usize] = item;
            next[r as usize] += 1;
        }
        Self { offsets, items }
    }
    /// Items of one row.
    pub fn row(&self, i: usize) -> &[T] {
        &self.items[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }
}

impl Csr {
    /// Neighbours of each of `rows` rows along undirected edges, in the order of `edges`.
    pub fn of_edges(rows: usize, edges: &[[u32; 2]]) -> Self {
        let both = |[a, b]: &[u32; 2]| [(*a, *b), (*b, *a)];
        Self::from_pairs(rows, &edges.iter().flat_map(both).collect::<Vec<_>>())
    }
    /// Faces around each of `rows` vertices, ascending.
    pub fn of_faces(rows: usize, faces: &[Face]) -> Self {
        let corners = (0..).zip(faces).flat_map(|(k, f)| f.map(|v| (v, k)));
        Self::from_pairs(rows, &corners.collect::<Vec<_>>())
    }
    /// Connected rows whose neighbours are `alike`, each depth-first from its first row, in the order of their first rows.
    pub fn components(&self, alike: impl Fn(usize, usize) -> bool) -> Vec<Vec<u32>> {
        let mut is_taken = vec![false; self.rows()];
        let mut out = Vec::new();
        for first in 0..self.rows() as u32 {
            let (mut own, mut stack) = (Vec::new(), vec![first]);
            while let Some(v) = stack.pop() {
                if !std::mem::replace(&mut is_taken[v as usize], true) {
                    own.push(v);
                    let near = self.row(v as usize).iter();
                    stack.extend(near.filter(|w| alike(v as usize, **w as usize)));
                }
            }
            if !own.is_empty() {
                out.push(own);
            }
        }
        out
    }
}

/// An undirected edge with the one or two faces on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// End vertices, smaller first.
    pub v: [u32; 2],
    /// The face left of `v[0] → v[1]`, or the only one.
    pub face: u32,
    /// The other face; `None` on a boundary.
    pub twin: Option<u32>,
    /// Vertices opposite the edge in `face` and `twin`; with a twin this is a hinge.
    pub opposite: [Option<u32>; 2],
}

/// Connectivity of an edge-manifold, consistently oriented mesh.
#[derive(Clone, Debug)]
pub struct Topology {
    edges: Vec<Edge>,
    vertex_faces: Csr,
    vertex_neighbours: Csr,
}

fn opposite(f: &Face, a: u32, b: u32) -> Option<u32> {
    f.iter().copied().find(|&v| v != a && v != b)
}

impl Topology {
    /// Builds edges and neighbours; edges come sorted by their vertices.
    ///
    /// # Errors
    /// An edge with more than two faces or with faces oriented against each other.
    pub fn new(mesh: &TriMesh) -> Result<Self, MeshError> {
        let mut edges: BTreeMap<(u32, u32), (bool, Edge)> = BTreeMap::new();
        for (fi, f) in mesh.faces().iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (f[k], f[(k + 1) % 3]);
                let (key, forward) = if a < b {
                    ((a, b), true)
                } else {
                    ((b, a), false)
                };
                match edges.get_mut(&key) {
                    None => {
                        let edge = Edge {
                            v: [key.0, key.1],
                            face: fi as u32,
                            twin: None,
                            opposite: [opposite(f, a, b), None],
                        };
                        edges.insert(key, (forward, edge));
                    }
                    Some((first_forward, e)) => {
                        if e.twin.is_some() {
                            return Err(MeshError::NonManifoldEdge(key.0, key.1));
                        }
                        if *first_forward == forward {
                            return Err(MeshError::FlippedFace(key.0, key.1));
                        }
                        e.twin = Some(fi as u32);
                        e.opposite[1] = opposite(f, a, b);
                        if forward {
                            // keep `face` on the left of v[0] → v[1]
                            e.opposite.swap(0, 1);
                            e.twin = Some(e.face);
                            e.face = fi as u32;
                            *first_forward = true;
                        }
                    }
                }
            }
        }
        let edges: Vec<Edge> = edges.into_values().map(|(_, e)| e).collect();
        let n = mesh.vertices().len();
        let ends: Vec<[u32; 2]> = edges.iter().map(|e| e.v).collect();
        Ok(Self {
            edges,
            vertex_faces: Csr::of_faces(n, mesh.faces()),
            vertex_neighbours: Csr::of_edges(n, &ends),
        })
    }
    /// All edges.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }
    /// Faces around each vertex.
    pub fn vertex_faces(&self) -> &Csr {
        &self.vertex_faces
    }
    /// Vertices sharing an edge with each vertex.
    pub fn vertex_neighbours(&self) -> &Csr {
        &self.vertex_neighbours
    }
    /// Has no edge with only one face.
    pub fn is_closed(&self) -> bool {
        self.edges.iter().all(|e| e.twin.is_some())
    }
    fn boundary_edges(&self) -> impl Iterator<Item = [u32; 2]> {
        let open = self.edges.iter().filter(|e| e.twin.is_none());
        open.map(|e| e.v)
    }
    /// Membership in a boundary edge of each vertex, shape `[vertices]`.
    pub fn boundary_vertices(&self) -> Vec<bool> {
        let mut on = vec![false; self.vertex_faces.rows()];
        let ends = self.boundary_edges().flatten();
        ends.for_each(|v| on[v as usize] = true);
        on
    }
    /// Vertices of each connected set of boundary edges, depth-first from the first.
    pub fn boundary_components(&self) -> Vec<Vec<u32>> {
        let edges: Vec<[u32; 2]> = self.boundary_edges().collect();
        let mut all = Csr::of_edges(self.vertex_faces.rows(), &edges).components(|_, _| true);
        all.retain(|own| own.len() > 1);
        all
    }
    /// Connected component of each vertex, numbered from 0 in order of first vertex, and their count.
    pub fn components(&self) -> (Vec<u32>, usize) {
        let all = self.vertex_neighbours.components(|_, _| true);
        let mut label = vec![0; self.vertex_faces.rows()];
        for (own, n) in all.iter().zip(0..) {
            own.iter().for_each(|v| label[*v as usize] = n);
        }
        (label, all.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::P3;

    #[test]
    fn components_are_connected_rows_that_are_alike() {
        let csr = Csr::of_edges(5, &[[0, 1], [1, 2], [3, 4]]);
        assert_eq!(csr.components(|_, _| true), [vec![0, 1, 2], vec![3, 4]]);
        let split = csr.components(|a, b| (a < 2) == (b < 2));
        assert_eq!(split, [vec![0, 1], vec![2], vec![3, 4]]);
    }

    #[test]
    fn hinge_orientation_and_faults() {
        let v = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
        ]
        .map(P3::from)
        .to_vec();
        let m = TriMesh::new(v.clone(), vec![[0, 1, 2], [2, 1, 3]]).expect("valid");
        let t = Topology::new(&m).expect("manifold");
        let hinge = t
            .edges()
            .iter()
            .find(|e| e.twin.is_some())
            .expect("one hinge");
        assert_eq!((hinge.v, hinge.face, hinge.twin), ([1, 2], 0, Some(1)));
        assert_eq!(hinge.opposite, [Some(0), Some(3)]);
        assert!(!t.is_closed() && t.boundary_vertices().iter().all(|b| *b));
        assert_eq!(t.boundary_components(), [[0, 2, 3, 1]]);
        assert_eq!(t.components(), (vec![0; 4], 1));
        let flipped = TriMesh::new(v.clone(), vec![[0, 1, 2], [1, 2, 3]]).expect("valid");
        assert_eq!(
            Topology::new(&flipped).err(),
            Some(MeshError::FlippedFace(1, 2))
        );
        let fan = TriMesh::new(v, vec![[0, 1, 2], [1, 0, 3], [0, 1, 3]]).expect("valid");
        assert_eq!(
            Topology::new(&fan).err(),
            Some(MeshError::NonManifoldEdge(0, 1))
        );
    }
}
