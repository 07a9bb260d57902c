//! Broad phase of the skin: nearest vertices independent of where a walk starts.
//!
//! In the crook of an elbow, or between toes, a walk ends on skin that is near but is not the skin below the cloth.

use super::{ClosestPoint, Part, SurfaceFrame, SurfaceModel};
use crate::settings::SkinQuerySettings;
use tryon_geometry::math::P3;
use tryon_geometry::spatial::HashGrid;

/// Hash grid of the vertices of a surface.
#[derive(Clone, Debug, Default)]
pub struct SkinGrid {
    grid: HashGrid,
}

impl SkinGrid {
    /// Rebuilds the grid for a frame.
    pub fn fill(&mut self, surface: &SurfaceModel, frame: &SurfaceFrame) {
        self.grid
            .fill(&frame.vertices, 2.0 * surface.settings.below);
    }
    /// Candidate vertices near `x`, for two masks of parts.
    pub fn candidates(
        &self,
        surface: &SurfaceModel,
        frame: &SurfaceFrame,
        x: &P3,
        masks: [Part; 2],
    ) -> [SkinCandidates; 2] {
        let SkinQuerySettings { nearest, below, .. } = surface.settings;
        let mut found = [[(nearest * nearest, None), (below * below, None)]; 2];
        self.grid.within(x, below, |v, d| {
            let part = surface.part(v);
            for ([any, above], mask) in found.iter_mut().zip(masks) {
                if part & mask == 0 {
                    continue;
                }
                if (d, Some(v)) < *any {
                    *any = (d, Some(v));
                }
                if (d, Some(v)) < *above
                    && (x - frame.vertices[v as usize]).dot(&surface.normal(frame, v)) < 0.0
                {
                    *above = (d, Some(v));
                }
            }
        });
        found.map(|of| SkinCandidates(of.map(|f| f.1)))
    }
}

/// The nearest vertex, and the nearest vertex whose tangent plane the point is below.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SkinCandidates([Option<u32>; 2]);

impl SkinCandidates {
    /// The point is below the tangent plane of a near vertex.
    pub fn is_below(&self) -> bool {
        self.0[1].is_some()
    }
    /// Any vertex is near.
    pub fn is_near(&self) -> bool {
        self.0.iter().any(Option::is_some)
    }
    /// The end of a walk or a closest point around the candidates, whichever is nearer to `x`.
    ///
    /// In a fold the nearest vertex may belong to the opposite skin, and the nearest triangle to that above `x`.
    pub fn or_nearer(
        &self,
        surface: &SurfaceModel,
        frame: &SurfaceFrame,
        x: &P3,
        walked: Option<ClosestPoint>,
        mask: Part,
    ) -> Option<ClosestPoint> {
        self.0.iter().flatten().fold(walked, |best, v| {
            if best.is_some_and(|b| b.vertex == *v) {
                return best;
            }
            let other = surface.closest_around(frame, x, *v, mask);
            let nearer = best.is_none_or(|b| other.signed_distance.abs() < b.signed_distance.abs());
            if nearer && !other.on_part_boundary {
                Some(other)
            } else {
                best
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_shapes::{self, sphere, two_spheres};
    use super::*;
    use tryon_geometry::mesh::TriMesh;

    #[test]
    fn point_below_one_of_two_toes_is_found_from_a_walk_on_the_other() {
        // Two spheres of 1 cm beside each other, of the same part.
        let (surface, frame, n) = two_spheres(3, 0.01, [-0.011, 0.011], [1, 1]);
        let n = n as u32;
        let mut near = SkinGrid::default();
        near.fill(&surface, &frame);
        // 2 mm under the right one, found from the left one.
        let x = P3::new(0.003, 0.0, 0.0);
        let walked = surface.closest(&frame, &x, 0, 1);
        assert!(
            walked.signed_distance > 0.0 && walked.vertex < n,
            "{walked:?}"
        );
        let [own, other] = near.candidates(&surface, &frame, &x, [1, 2]);
        assert!(
            own.0.iter().all(|v| v.is_some_and(|v| v >= n)) && other == SkinCandidates::default(),
            "{own:?} {other:?}"
        );
        let found = own
            .or_nearer(&surface, &frame, &x, Some(walked), 1)
            .expect("skin");
        assert!(
            (found.signed_distance + 0.002).abs() < 3e-4,
            "{}",
            found.signed_distance
        );
        assert!(own.is_near() && own.is_below() && !other.is_near() && !other.is_below());
        // Nothing within reach, or nothing nearer: the walk stands.
        let far = P3::new(0.1, 0.0, 0.0);
        assert_eq!(
            near.candidates(&surface, &frame, &far, [1, 1]),
            [SkinCandidates::default(); 2]
        );
        let walked = surface.closest(&frame, &far, n, 1);
        assert_eq!(
            SkinCandidates::default().or_nearer(&surface, &frame, &far, None, 1),
            None
        );
        for near in [
            SkinCandidates::default(),
            SkinCandidates([Some(0), Some(1)]),
        ] {
            assert_eq!(
                near.or_nearer(&surface, &frame, &far, Some(walked), 1),
                Some(walked)
            );
        }
    }

    #[test]
    fn point_above_a_limb_is_near_and_not_below() {
        let (surface, frame, _) = two_spheres(4, 0.1, [-0.15, 0.15], [1, 1]);
        let mut near = SkinGrid::default();
        near.fill(&surface, &frame);
        for (height, seen, under) in [
            (0.05, false, false),
            (0.005, true, false),
            (-0.002, true, true),
        ] {
            let [own, _] =
                near.candidates(&surface, &frame, &P3::new(0.15, 0.1 + height, 0.0), [1, 0]);
            assert_eq!(
                (own.is_near(), own.is_below()),
                (seen, under),
                "{height} m: {own:?}"
            );
        }
    }

    #[test]
    fn large_triangle_is_found_behind_nearer_vertices() {
        // A ball of 5 mm in front of a flat piece of skin with corners 17 mm apart, and a place between, under the skin.
        let ball = sphere(2);
        let n = ball.vertices().len() as u32;
        let mut places: Vec<P3> = ball
            .vertices()
            .iter()
            .map(|p| P3::from(p.coords * 0.005))
            .collect();
        let turn = |k: f32| (k * std::f32::consts::TAU / 3.0).sin_cos();
        places.extend([0.0, 1.0, 2.0].map(|k| P3::new(0.011, 0.01 * turn(k).0, 0.01 * turn(k).1)));
        let mut faces = ball.faces().to_vec();
        faces.push([n, n + 1, n + 2]);
        let mesh = TriMesh::new(places, faces).expect("a ball and a triangle");
        let parts = vec![1; mesh.vertices().len()];
        let (surface, frame) = test_shapes::surface(&mesh, parts);
        let side = frame.normals[n as usize].x.signum();
        let x = P3::new(0.011 - 0.002 * side, 0.0, 0.0);
        let mut near = SkinGrid::default();
        near.fill(&surface, &frame);
        let [own, _] = near.candidates(&surface, &frame, &x, [1, 0]);
        assert!(
            own.0[0].is_some_and(|v| v < n) && own.0[1].is_some_and(|v| v >= n),
            "{own:?}"
        );
        let walked = surface.closest(&frame, &x, 0, 1);
        assert!(
            walked.signed_distance > 0.0035 && walked.vertex < n,
            "{walked:?}"
        );
        let found = own
            .or_nearer(&surface, &frame, &x, Some(walked), 1)
            .expect("skin");
        assert!((found.signed_distance + 0.002).abs() < 1e-5, "{found:?}");
    }
}
