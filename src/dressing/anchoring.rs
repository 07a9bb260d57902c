//! Anchors tied to the skin below them.

use super::waistband::{GarmentOnSkin, spread};
use tryon_cloth::AnchorBinding;
use tryon_cloth::contact::SurfaceFrame;
use tryon_cloth::{ClothError, Sheet};
use tryon_garment::{AnchorKind, Region};
use tryon_geometry::math::P3;

impl GarmentOnSkin<'_> {
    /// Ties the anchors `offset` metres off the skin, waistbands evenly stretched.
    pub(super) fn fasten(&self, positions: &[P3]) -> Result<Vec<AnchorBinding>, ClothError> {
        let mut positions = positions.to_vec();
        let edges = Sheet::of_garment(self.mesh)?.edges;
        spread(self, &edges, &mut positions);
        Ok(self.bind(&positions, |_| self.offset as f32))
    }
    /// Ties the anchors at their heights over the skin, at least `offset` metres.
    pub(super) fn bind_in_place(&self, positions: &[P3]) -> Vec<AnchorBinding> {
        self.bind(positions, |height| height.max(self.offset as f32))
    }
    /// `height`: of the binding, from the vertex's own, metres.
    fn bind(&self, positions: &[P3], height: impl Fn(f32) -> f32) -> Vec<AnchorBinding> {
        let mut out = Vec::new();
        for set in &self.mesh.anchors {
            for &vertex in &set.vertices {
                let p = positions[vertex as usize];
                let near = self.surface.nearest_vertex(self.frame, &p, Region::ALL.0);
                let c = self
                    .surface
                    .closest_around(self.frame, &p, near, Region::ALL.0);
                let body = self.surface.faces()[c.face as usize];
                out.push(if set.kind == AnchorKind::Rigid {
                    rigid_binding(vertex, &p, body, self.frame)
                } else {
                    AnchorBinding {
                        vertex,
                        body,
                        weights: c.weights,
                        height: height(c.signed_distance),
                        strength: set.strength,
                    }
                });
            }
        }
        out
    }
}

/// Ties a vertex to a triangle at its exact position: barycentric weights of its projection, and its height.
fn rigid_binding(vertex: u32, at: &P3, body: [u32; 3], frame: &SurfaceFrame) -> AnchorBinding {
    let [p, q, r] = body.map(|v| frame.vertices[v as usize]);
    let (u, v, d) = (q - p, r - p, at - p);
    let normal = u.cross(&v);
    let square = normal.norm_squared().max(f32::MIN_POSITIVE);
    let (b, c) = (
        d.cross(&v).dot(&normal) / square,
        u.cross(&d).dot(&normal) / square,
    );
    AnchorBinding {
        vertex,
        body,
        weights: [1.0 - b - c, b, c],
        height: d.dot(&normal) / square.sqrt(),
        strength: 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::V3;

    #[test]
    fn a_rigid_binding_reproduces_the_position_and_survives_a_triangle_without_area() {
        let frame = |vertices: [P3; 3]| SurfaceFrame {
            vertices: vertices.to_vec(),
            normals: Vec::new(),
        };
        let [p, q, r] = [
            P3::new(0.1, 0.0, 0.2),
            P3::new(0.4, 0.1, 0.0),
            P3::new(0.0, 0.5, 0.1),
        ];
        let at = P3::new(0.9, -0.3, 0.7);
        let b = rigid_binding(0, &at, [0, 1, 2], &frame([p, q, r]));
        let [wp, wq, wr] = b.weights;
        let normal: V3 = (q - p).cross(&(r - p)).normalize();
        let back = p.coords * wp + q.coords * wq + r.coords * wr + normal * b.height;
        assert!((back - at.coords).norm() < 1e-6, "{back}");
        let flat = rigid_binding(0, &at, [0, 1, 2], &frame([p, p, p]));
        assert!(flat.weights.iter().all(|w| w.is_finite()) && flat.height == 0.0);
    }
}
