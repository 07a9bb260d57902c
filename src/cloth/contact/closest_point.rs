//! Closest point on a moving surface, by a walk downhill from the nearest vertex of the previous step.
//!
//! Temporal coherence costs a few neighbours instead of a tree. A point outside an arm keeps the arm as its nearest
//! surface when the arm has moved past it.

use super::triangle_fan::{LANES, TriangleFan};
use super::{Part, SurfaceFrame, SurfaceModel};
use tryon_geometry::math::{P3, V3};

/// The point of a surface closest to a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// Nearest vertex: where the next walk starts.
    pub vertex: u32,
    /// Triangle of the point.
    pub face: u32,
    /// Barycentric weights in that triangle.
    pub weights: [f32; 3],
    /// The point, metres.
    pub point: P3,
    /// Unit normal there, outward.
    pub normal: V3,
    /// Distance of the query, negative inside, metres.
    pub signed_distance: f32,
    /// The walk ended at the boundary of the parts it was confined to: the distance is meaningless.
    pub on_part_boundary: bool,
}

impl ClosestPoint {
    /// Clearance to a point of another part that faces this one, metres: negative where the parts penetrate each other.
    /// `None` if they do not face each other.
    pub fn clearance_to(&self, other: &Self) -> Option<f32> {
        (self.normal.dot(&other.normal) < 0.0).then(|| self.normal.dot(&(other.point - self.point)))
    }
}

/// Extent of a search for the closest point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchExtent {
    /// Parts that the search is confined to.
    pub mask: Part,
    /// Largest distance that counts, metres.
    pub reach: f32,
}

impl SurfaceModel {
    /// Walks from `start` to a vertex nearer to `p` than all its neighbours in `mask`.
    pub fn walk(&self, frame: &SurfaceFrame, p: &P3, start: u32, mask: Part) -> u32 {
        let mut at = start;
        let mut best = (frame.vertices[at as usize] - p).norm_squared();
        for _ in 0..self.settings.max_walk {
            let mut next = at;
            for &n in self.neighbours(at) {
                let d = (frame.vertices[n as usize] - p).norm_squared();
                if d < best && self.parts[n as usize] & mask != 0 {
                    best = d;
                    next = n;
                }
            }
            if next == at {
                break;
            }
            at = next;
        }
        at
    }

    /// Closest point on the faces around a vertex.
    pub fn closest_around(
        &self,
        frame: &SurfaceFrame,
        p: &P3,
        vertex: u32,
        mask: Part,
    ) -> ClosestPoint {
        let around = self.topology.vertex_faces().row(vertex as usize);
        let leaves_mask = |f: &u32| {
            let corners = self.faces[*f as usize];
            corners.iter().any(|&c| self.parts[c as usize] & mask == 0)
        };
        let Some((square, face, [v, w])) = self.closest_of_faces(frame, p, around) else {
            return ClosestPoint {
                vertex,
                face: 0,
                weights: [1.0, 0.0, 0.0],
                point: frame.vertices[vertex as usize],
                normal: V3::y(),
                signed_distance: f32::MAX,
                on_part_boundary: true,
            };
        };
        let weights = [1.0 - v - w, v, w];
        let [a, b, c] = self.faces[face as usize].map(|i| frame.vertices[i as usize].coords);
        let point = P3::from(a * weights[0] + b * v + c * w);
        let smooth = self.interpolated_normal(frame, face, weights);
        let mut normal = smooth.try_normalize(0.0).unwrap_or_else(V3::y);
        let outside = (p - point).dot(&normal) >= 0.0;
        let distance = square.sqrt();
        // Exact at edges and corners, where the interpolated normal is not.
        if distance > self.settings.direct_normal {
            let along = (p - point) / distance * if outside { 1.0 } else { -1.0 };
            if along.dot(&normal) > self.settings.direct_normal_cosine {
                normal = along;
            }
        }
        ClosestPoint {
            vertex,
            face,
            weights,
            point,
            normal,
            signed_distance: if outside { distance } else { -distance },
            on_part_boundary: self.common[vertex as usize] & mask == 0
                && around.iter().any(leaves_mask),
        }
    }

    /// Squared distance, face and weights of b and c of the closest point of some faces.
    fn closest_of_faces(
        &self,
        frame: &SurfaceFrame,
        p: &P3,
        faces: &[u32],
    ) -> Option<(f32, u32, [f32; 2])> {
        let mut best: Option<(f32, u32, [f32; 2])> = None;
        for some in faces.chunks(LANES) {
            let corners = |f: &u32| self.faces[*f as usize].map(|i| frame.vertices[i as usize]);
            let (weights, square) = TriangleFan::new(p, some.iter().map(corners)).closest();
            for (l, f) in some.iter().enumerate() {
                if best.is_none_or(|o| square[l] < o.0) {
                    best = Some((square[l], *f, [weights[0][l], weights[1][l]]));
                }
            }
        }
        best
    }

    /// Walk, then closest point around its end.
    pub fn closest(&self, frame: &SurfaceFrame, p: &P3, start: u32, mask: Part) -> ClosestPoint {
        let v = self.walk(frame, p, start, mask);
        self.closest_around(frame, p, v, mask)
    }

    /// End of a walk, and the closest point if it can be within reach, else its least distance beyond that, metres.
    pub fn closest_within(
        &self,
        frame: &SurfaceFrame,
        p: &P3,
        start: u32,
        extent: SearchExtent,
    ) -> (u32, Result<ClosestPoint, f32>) {
        let SearchExtent { mask, reach } = extent;
        let v = self.walk(frame, p, start, mask);
        let beyond = (frame.vertices[v as usize] - p).norm() - self.settings.edge - reach;
        if beyond > 0.0 {
            return (v, Err(beyond));
        }
        (v, Ok(self.closest_around(frame, p, v, mask)))
    }

    /// Closest point on the parts of `mask`; at their boundary the closest one on any part.
    /// `vertex` stays within the parts.
    pub fn closest_across_parts(
        &self,
        frame: &SurfaceFrame,
        p: &P3,
        start: u32,
        mask: Part,
    ) -> ClosestPoint {
        let own = self.closest(frame, p, start, mask);
        if own.on_part_boundary {
            ClosestPoint {
                vertex: own.vertex,
                ..self.closest(frame, p, own.vertex, Part::MAX)
            }
        } else {
            own
        }
    }

    /// A point of a face, by its barycentric weights, lies on the border of an open surface, where inside and outside are
    /// undefined.
    pub fn is_border_point(&self, face: u32, weights: [f32; 3]) -> bool {
        let f = self.faces[face as usize];
        (0..3).all(|k| weights[k] < self.settings.min_weight || self.border[f[k] as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_shapes::{sphere, surface};
    use super::*;

    #[test]
    fn distance_to_a_sphere_has_its_closed_form_and_the_walk_ends_at_the_nearest_vertex() {
        let mesh = sphere(4);
        let (model, frame) = surface(&mesh, vec![1; mesh.vertices().len()]);
        for i in 0..200 {
            let t = i as f32 * 0.7;
            let dir = V3::new(t.sin(), (t * 1.3).cos(), (t * 0.37).sin()).normalize();
            let r = 0.8 + 0.4 * ((i * 37) % 100) as f32 / 100.0;
            let p = P3::from(dir * r);
            let walked = model.closest(&frame, &p, 0, 1);
            assert_eq!(
                walked.vertex,
                model.nearest_vertex(&frame, &p, 1),
                "point {i}"
            );
            assert!(
                (walked.signed_distance - (r - 1.0)).abs() < 4e-3,
                "{walked:?} {r}"
            );
            assert!(walked.normal.dot(&dir) > 0.99 && !walked.on_part_boundary);
        }
    }
}
