//! Triangle meshes and their topology, checked once at construction; normals, boundaries, repair, isotropic remeshing, neighbour smoothing.

mod distances;
pub(crate) mod edges;
mod editable;
mod normals;
pub(crate) mod remesh;
pub(crate) mod repair;
mod settings;
pub mod smoothing;
pub(crate) mod topology;
pub(crate) mod union_find;

pub use distances::distances;
pub use edges::{boundary_edges, boundary_loops, edge_faces, edges, sides, undirected};
pub use editable::smallest_angle;
pub use normals::{face_normal, vertex_normal, vertex_normals};
pub use remesh::{Border, RemeshSpec, Remesher, remesh};
pub use repair::{FaceFinding, MeshRepairReport, RepairedMesh, repair};
pub use settings::{MeshRepairSettings, RemeshSettings};
pub use topology::{Csr, Edge, Topology};
pub use union_find::UnionFind;

use crate::math::P3;
use serde::{Deserialize, Serialize};

/// Vertex indices of a triangle, counter-clockwise seen from outside.
pub type Face = [u32; 3];

/// A triangle mesh with indices in range, three different corners a face and finite positions, checked by
/// [`TriMesh::new`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TriMesh {
    vertices: Vec<P3>,
    faces: Vec<Face>,
}

/// A fault of a mesh and its place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// A face names a vertex that does not exist.
    #[error("face {face}: vertex index {index} is out of range (the mesh has {vertices} vertices)")]
    IndexOutOfRange {
        /// Face number.
        face: usize,
        /// The bad index.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A face uses a vertex twice.
    #[error("face {face}: vertex {index} is used twice")]
    RepeatedCorner {
        /// Face number.
        face: usize,
        /// The repeated index.
        index: u32,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex}: position is not finite")]
    NotFinite {
        /// Vertex number.
        vertex: usize,
    },
    /// More than 2³² vertices.
    #[error("{0} vertices do not fit 32-bit indices")]
    TooLarge(usize),
    /// An edge with more than two faces.
    #[error("edge ({0}, {1}) has more than two faces")]
    NonManifoldEdge(u32, u32),
    /// A surface with one side only (Möbius strip): its faces cannot have one orientation.
    #[error("face {face}: the surface has one side only (a twisted band); cut it open there")]
    OneSided {
        /// Face at which the orientation contradicts itself.
        face: usize,
    },
    /// Two faces traverse a shared edge in the same direction.
    #[error("edge ({0}, {1}): its two faces are oriented against each other")]
    FlippedFace(u32, u32),
}

impl TriMesh {
    /// Checks vertices (metres) and faces.
    ///
    /// # Errors
    /// [`MeshError`] naming the face or vertex at fault.
    pub fn new(vertices: Vec<P3>, faces: Vec<Face>) -> Result<Self, MeshError> {
        if u32::try_from(vertices.len()).is_err() {
            return Err(MeshError::TooLarge(vertices.len()));
        }
        if let Some(vertex) = vertices
            .iter()
            .position(|p| !p.iter().all(|c| c.is_finite()))
        {
            return Err(MeshError::NotFinite { vertex });
        }
        for (face, f) in faces.iter().enumerate() {
            if let Some(&index) = f.iter().find(|&&i| i as usize >= vertices.len()) {
                return Err(MeshError::IndexOutOfRange {
                    face,
                    index,
                    vertices: vertices.len(),
                });
            }
            if f[0] == f[1] || f[0] == f[2] {
                return Err(MeshError::RepeatedCorner { face, index: f[0] });
            }
            if f[1] == f[2] {
                return Err(MeshError::RepeatedCorner { face, index: f[1] });
            }
        }
        Ok(Self { vertices, faces })
    }

    /// Positions, metres, shape `[n]`.
    pub fn vertices(&self) -> &[P3] {
        &self.vertices
    }
    /// Triangles, shape `(m)`.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }
    /// Corner positions of one face.
    pub fn corners(&self, face: usize) -> [P3; 3] {
        self.faces[face].map(|i| self.vertices[i as usize])
    }
    /// Replaces all positions, keeping the topology.
    ///
    /// # Errors
    /// When a position is not finite; a wrong count names the first missing or extra vertex.
    pub fn with_vertices(&self, vertices: Vec<P3>) -> Result<Self, MeshError> {
        if vertices.len() != self.vertices.len() {
            return Err(MeshError::NotFinite {
                vertex: vertices.len().min(self.vertices.len()),
            });
        }
        Self::new(vertices, self.faces.clone())
    }
    /// Axis-aligned bounds, or `None` for a mesh without vertices.
    pub fn bounds(&self) -> Option<(P3, P3)> {
        let first = *self.vertices.first()?;
        Some(
            self.vertices
                .iter()
                .fold((first, first), |(lo, hi), p| (lo.inf(p), hi.sup(p))),
        )
    }
    /// Signed volume (m³) of a closed mesh; positive when faces point outward.
    pub fn volume(&self) -> f64 {
        self.faces
            .iter()
            .map(|f| {
                let [a, b, c] = f.map(|i| self.vertices[i as usize].coords.cast::<f64>());
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }
    /// Surface area, m².
    pub fn area(&self) -> f64 {
        (0..self.faces.len())
            .map(|i| {
                let [a, b, c] = self.corners(i).map(|p| p.cast::<f64>());
                0.5 * (b - a).cross(&(c - a)).norm()
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A regular tetrahedron, outward faces.
    pub(crate) fn tetrahedron() -> TriMesh {
        let v = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ]
        .map(P3::from);
        TriMesh::new(v.to_vec(), vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).expect("valid")
    }

    #[test]
    fn faults_are_named() {
        let v = vec![P3::origin(); 3];
        assert_eq!(
            TriMesh::new(v.clone(), vec![[0, 1, 2], [0, 1, 7]]),
            Err(MeshError::IndexOutOfRange {
                face: 1,
                index: 7,
                vertices: 3
            })
        );
        assert_eq!(
            TriMesh::new(v.clone(), vec![[0, 2, 2]]),
            Err(MeshError::RepeatedCorner { face: 0, index: 2 })
        );
        let mut bad = v;
        bad[1].y = f32::NAN;
        assert_eq!(
            TriMesh::new(bad, vec![]),
            Err(MeshError::NotFinite { vertex: 1 })
        );
    }

    #[test]
    fn closed_forms_of_the_tetrahedron() {
        let t = tetrahedron();
        assert!((t.volume() - 1.0 / 6.0).abs() < 1e-12);
        assert!((t.area() - (1.5 + 3f64.sqrt() / 2.0)).abs() < 1e-7);
        let topo = Topology::new(&t).expect("manifold");
        assert_eq!(topo.edges().len(), 6);
        assert!(topo.is_closed());
    }
}
