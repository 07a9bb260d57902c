//! Cloth as the offline solver meets it: masses, energies of its shape, pins and forces.

use super::energy_term::EnergyTerm;
use super::error::OfflineError;
use crate::contact::{ContactMesh, ContactMeshError, ContactSurface};
use std::sync::Arc;
use tryon_geometry::linear::{BlockMatrix, BlockPattern};
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;

/// A vertex that follows a scripted target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PinTarget {
    /// The vertex.
    pub vertex: u32,
    /// Its target at the end of the step (m).
    pub target: V3d,
}

/// A garment or several: `[vertices]` masses, the energies of their shape, and gravity.
pub struct OfflineCloth {
    /// Mass of each vertex (kg).
    pub mass: Vec<f64>,
    /// Triangles, for contact.
    pub faces: Vec<Face>,
    /// Acceleration of gravity (m/s²).
    pub gravity: V3d,
    /// Pairs of vertices that are sewn to one another: elements that own one each never form contact.
    pub sewn: Vec<[u32; 2]>,
    terms: Vec<Box<dyn EnergyTerm>>,
    pattern: Arc<BlockPattern>,
}

impl std::fmt::Debug for OfflineCloth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OfflineCloth")
            .field("vertices", &self.mass.len())
            .field("faces", &self.faces.len())
            .field("terms", &self.terms.len())
            .finish_non_exhaustive()
    }
}

impl OfflineCloth {
    /// Cloth of these masses (kg), triangles and energies.
    ///
    /// # Errors
    /// A mass that is not positive, by vertex; an index beyond the vertices.
    pub fn new(
        mass: Vec<f64>,
        faces: Vec<Face>,
        gravity: V3d,
        mut terms: Vec<Box<dyn EnergyTerm>>,
    ) -> Result<Self, OfflineError> {
        if let Some(vertex) = mass.iter().position(|m| !(*m > 0.0 && m.is_finite())) {
            return Err(OfflineError::Input {
                field: "mass",
                why: format!("vertex {vertex} has {} kg", mass[vertex]),
            });
        }
        let mut pairs = Vec::new();
        for term in &terms {
            term.visit_pairs(&mut |a, b| pairs.push((a, b)));
        }
        let pattern = Arc::new(BlockPattern::new(mass.len(), pairs)?);
        for term in &mut terms {
            term.bind(&pattern);
        }
        Ok(Self {
            mass,
            faces,
            gravity,
            sewn: Vec::new(),
            terms,
            pattern,
        })
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.mass.len()
    }

    /// True for cloth without vertices.
    pub fn is_empty(&self) -> bool {
        self.mass.is_empty()
    }

    /// Surfaces that meet: the cloth, and an obstacle of `vertices` with these triangles.
    ///
    /// # Errors
    /// A face with a vertex beyond its surface's.
    pub fn contact_mesh(
        &self,
        obstacle: ContactSurface<'_>,
    ) -> Result<ContactMesh, ContactMeshError> {
        let own = ContactSurface {
            vertices: self.len(),
            faces: &self.faces,
        };
        let mut mesh = ContactMesh::new(own, obstacle)?;
        mesh.exclude(&self.sewn);
        Ok(mesh)
    }

    /// Vertices that share an element with a vertex, itself included, ascending.
    pub(super) fn neighbours(&self, vertex: usize) -> &[u32] {
        self.pattern.neighbours(vertex)
    }

    /// Energies of the shape.
    pub(super) fn terms(&self) -> &[Box<dyn EnergyTerm>] {
        &self.terms
    }

    /// Zero matrix on the blocks that the shape's energies share, with `more` vertices after those of the cloth.
    pub(super) fn matrix(&self, more: usize) -> BlockMatrix {
        BlockMatrix::zeros(Arc::new(self.pattern.extended(more)))
    }
}

impl PinTarget {
    /// Energy at `x` of a spring of this stiffness (J).
    pub(super) fn value(&self, x: &[V3d], stiffness: f64) -> f64 {
        0.5 * stiffness * (x[self.vertex as usize] - self.target).norm_squared()
    }

    /// Gradient at `x` (N).
    pub(super) fn gradient(&self, x: &[V3d], stiffness: f64) -> V3d {
        (x[self.vertex as usize] - self.target) * stiffness
    }
}
