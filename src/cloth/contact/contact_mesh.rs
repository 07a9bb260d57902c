//! Collision mesh: cloth and obstacle in one index space, their edges, and the pairs that never count as contact.

use tryon_geometry::mesh::{Face, edges};

/// Cloth and obstacle surfaces. Vertices, faces and edges of the obstacle follow those of the cloth.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ContactMesh {
    vertices: [u32; 2],
    faces: Vec<Face>,
    cloth_faces: u32,
    edges: Vec<[u32; 2]>,
    cloth_edges: u32,
    /// Vertex pairs without contact in both orders, ascending.
    excluded: Vec<[u32; 2]>,
}

/// Faces of one surface by vertices of its own.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactSurface<'a> {
    /// Number of vertices, also of those without a face.
    pub vertices: usize,
    /// Triangles.
    pub faces: &'a [Face],
}

/// Fault of the surfaces of a [`ContactMesh`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ContactMeshError {
    /// A face with a vertex beyond the surface's.
    #[error("face {face} of the {surface} names vertex {vertex} of {vertices}")]
    FaceOutOfRange {
        /// `cloth` or `obstacle`.
        surface: &'static str,
        /// Face.
        face: usize,
        /// Vertex.
        vertex: u32,
        /// Vertices of the surface.
        vertices: usize,
    },
    /// More vertices than 32 bits number.
    #[error("{0} vertices exceed 32 bits")]
    TooManyVertices(usize),
}

impl ContactMesh {
    /// Joins the surfaces. Faces may be degenerate.
    ///
    /// # Errors
    /// When a face is out of range.
    pub fn new(
        cloth: ContactSurface<'_>,
        obstacle: ContactSurface<'_>,
    ) -> Result<Self, ContactMeshError> {
        let total = cloth.vertices.saturating_add(obstacle.vertices);
        if u32::try_from(total).is_err() {
            return Err(ContactMeshError::TooManyVertices(total));
        }
        check_range("cloth", cloth)?;
        check_range("obstacle", obstacle)?;
        let offset = cloth.vertices as u32;
        let moved = obstacle.faces.iter().map(|f| f.map(|v| v + offset));
        let faces: Vec<Face> = cloth.faces.iter().copied().chain(moved).collect();
        let (own, other) = faces.split_at(cloth.faces.len());
        let mut all = edges(own);
        let cloth_edges = all.len() as u32;
        all.extend(edges(other));
        Ok(Self {
            vertices: [offset, total as u32],
            cloth_faces: cloth.faces.len() as u32,
            faces,
            edges: all,
            cloth_edges,
            excluded: Vec::new(),
        })
    }

    /// Excludes all contact between elements of which one has the first and one the second vertex of a pair, as for
    /// vertices sewn together. Replaces earlier exclusions.
    pub fn exclude(&mut self, pairs: &[[u32; 2]]) {
        let both = pairs.iter().flat_map(|[a, b]| [[*a, *b], [*b, *a]]);
        self.excluded = both.collect();
        self.excluded.sort_unstable();
        self.excluded.dedup();
    }

    /// Vertices of cloth and obstacle.
    pub fn vertices(&self) -> usize {
        self.vertices[1] as usize
    }
    /// Vertices of the cloth: the first ones.
    pub fn cloth_vertices(&self) -> usize {
        self.vertices[0] as usize
    }
    /// Triangles, the cloth's first.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }
    /// Triangles of the cloth.
    pub fn cloth_faces(&self) -> usize {
        self.cloth_faces as usize
    }
    /// Edges, the smaller vertex first, the cloth's first, each part ascending.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }
    /// Edges of the cloth.
    pub fn cloth_edges(&self) -> usize {
        self.cloth_edges as usize
    }

    /// True if elements with these vertices share one, or own an excluded pair: they never form a contact pair.
    pub fn are_incident(&self, a: &[u32], b: &[u32]) -> bool {
        let mut pairs = a.iter().flat_map(|v| b.iter().map(move |w| (v, w)));
        pairs.any(|(v, w)| v == w || self.is_excluded([*v, *w]))
    }

    fn is_excluded(&self, pair: [u32; 2]) -> bool {
        !self.excluded.is_empty() && self.excluded.binary_search(&pair).is_ok()
    }
}

fn check_range(
    surface: &'static str,
    ContactSurface { vertices, faces }: ContactSurface<'_>,
) -> Result<(), ContactMeshError> {
    let outside = |(face, corners): (usize, &Face)| {
        let vertex = corners.iter().copied().find(|v| *v as usize >= vertices)?;
        Some(ContactMeshError::FaceOutOfRange {
            surface,
            face,
            vertex,
            vertices,
        })
    };
    faces
        .iter()
        .enumerate()
        .find_map(outside)
        .map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> ContactMesh {
        let cloth = ContactSurface {
            vertices: 4,
            faces: &[[0, 1, 2], [2, 1, 3]],
        };
        let obstacle = ContactSurface {
            vertices: 3,
            faces: &[[2, 1, 0]],
        };
        ContactMesh::new(cloth, obstacle).expect("a mesh")
    }

    #[test]
    fn obstacle_follows_cloth() {
        let mesh = two();
        assert_eq!((mesh.vertices(), mesh.cloth_vertices()), (7, 4));
        assert_eq!(mesh.faces(), [[0, 1, 2], [2, 1, 3], [6, 5, 4]]);
        let cloth = [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]];
        assert_eq!(mesh.edges()[..mesh.cloth_edges()], cloth);
        assert_eq!(mesh.edges()[5..], [[4, 5], [4, 6], [5, 6]]);
        assert_eq!(mesh.cloth_faces(), 2);
    }

    #[test]
    fn shared_and_excluded_vertices_make_elements_incident() {
        let mut mesh = two();
        assert!(mesh.are_incident(&[0], &[0, 1, 2]));
        assert!(!mesh.are_incident(&[3], &[0, 1, 2]));
        mesh.exclude(&[[3, 0], [2, 5]]);
        assert!(mesh.are_incident(&[3], &[0, 1, 2]));
        assert!(mesh.are_incident(&[4, 5], &[2, 3]));
        assert!(!mesh.are_incident(&[4, 6], &[2, 3]));
    }

    #[test]
    fn a_face_out_of_range_is_reported() {
        let surface = ContactSurface {
            vertices: 2,
            faces: &[[0, 1, 2]],
        };
        let fault = ContactMesh::new(ContactSurface::default(), surface).expect_err("a fault");
        assert_eq!(
            fault.to_string(),
            "face 0 of the obstacle names vertex 2 of 2"
        );
    }
}
