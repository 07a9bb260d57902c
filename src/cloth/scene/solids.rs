//! Surfaces of a scene's solids, posed by their motion.

use super::solid_mesh::solid_mesh;
use super::{Collider, Scene};
use nalgebra::Point3;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;

/// Surfaces of all solids as one mesh.
#[derive(Debug)]
pub(super) struct Solids<'a> {
    colliders: &'a [Collider],
    /// Points in the frames of their solids (m), with the number of the solid.
    points: Vec<(V3d, usize)>,
    /// Triangles, outwards.
    pub(super) faces: Vec<Face>,
}

impl<'a> Solids<'a> {
    /// Surfaces of the solids of a scene.
    pub(super) fn new(scene: &'a Scene) -> Self {
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for (number, collider) in scene.colliders.iter().enumerate() {
            let (own, triangles) = solid_mesh(&collider.shape, &scene.settings);
            let first = points.len() as u32;
            faces.extend(triangles.iter().map(|f| f.map(|v| v + first)));
            points.extend(own.into_iter().map(|p| (p, number)));
        }
        Self {
            colliders: &scene.colliders,
            points,
            faces,
        }
    }

    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Points at time `t` (s), in the world (m).
    pub(super) fn at(&self, t: f64) -> Vec<V3d> {
        let placements: Vec<_> = self.colliders.iter().map(|c| c.placement(t)).collect();
        let place = |(p, n): &(V3d, usize)| (placements[*n] * Point3::from(*p)).coords;
        self.points.iter().map(place).collect()
    }

    /// Largest depth of a vertex of the cloth in a solid at time `t` (m).
    pub(super) fn deepest(&self, t: f64, cloth: &[V3d]) -> f64 {
        let depth = |c: &'a Collider| {
            let back = c.placement(t).inverse();
            let of = move |p: &V3d| -c.shape.distance(&(back * Point3::from(*p)).coords).0;
            cloth.iter().map(of)
        };
        self.colliders.iter().flat_map(depth).fold(0.0, f64::max)
    }
}
