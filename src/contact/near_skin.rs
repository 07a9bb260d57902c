//! Nearest points on a surface that do not depend on where a walk starts.
//!
//! In the crook of an elbow a walk ends on the upper arm though the forearm is nearer, and between toes or fingers on any of
//! them: it finds skin that is near by, but not the skin that cloth is under.

use super::{Closest, Part, SurfaceFrame, SurfaceModel};
use crate::math::P3;
use crate::spatial::HashGrid;

/// The nearest vertex is looked for within this, metres: the vertices of a body are about as far from each other. Within
/// 25 mm a hood on a slim neck was crumpled.
const NEAREST: f32 = 0.015;
/// The nearest vertex that a place is under is looked for within this, metres: between a dancer's knees that pass each other
/// cloth got 15 mm deep in one call.
const UNDER: f32 = 0.025;

/// The vertices of a surface, looked for around a place.
#[derive(Clone, Debug, Default)]
pub struct NearSkin {
    grid: HashGrid,
}

impl NearSkin {
    /// The surface is there now.
    pub fn fill(&mut self, frame: &SurfaceFrame) {
        self.grid.fill(&frame.vertices, 2.0 * UNDER);
    }
    /// Of two kinds of parts the skin near `x`.
    pub fn around(
        &self,
        surface: &SurfaceModel,
        frame: &SurfaceFrame,
        x: &P3,
        masks: [Part; 2],
    ) -> [Near; 2] {
        let mut found = [[(NEAREST * NEAREST, None), (UNDER * UNDER, None)]; 2];
        self.grid.within(x, UNDER, |v, d| {
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
        found.map(|of| Near(of.map(|f| f.1)))
    }
}

/// Skin near a place: the nearest vertex, and the nearest one of those that the place is under.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Near([Option<u32>; 2]);

impl Near {
    /// Is skin that the place is under near?
    pub fn under(&self) -> bool {
        self.0[1].is_some()
    }
    /// Is any skin near?
    pub fn seen(&self) -> bool {
        self.0.iter().any(Option::is_some)
    }
    /// Where a walk led, if anywhere, or a point around these vertices that is nearer to `x`. In a fold the nearest vertex may
    /// belong to the skin in front of `x`, and the nearest triangle to that above it.
    pub fn or_nearer(
        &self,
        surface: &SurfaceModel,
        frame: &SurfaceFrame,
        x: &P3,
        walked: Option<Closest>,
        mask: Part,
    ) -> Option<Closest> {
        self.0.iter().flatten().fold(walked, |best, v| {
            if best.is_some_and(|b| b.vertex == *v) {
                return best;
            }
            let other = surface.closest_around(frame, x, *v, mask);
            let nearer = best.is_none_or(|b| other.signed.abs() < b.signed.abs());
            if nearer && !other.rim {
                Some(other)
            } else {
                best
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::surface::tests::{sphere, two_spheres};
    use super::*;
    use crate::mesh::{Topology, TriMesh};
    use crate::par::Par;

    #[test]
    fn under_one_of_two_toes_a_walk_on_the_other_is_brought_to_it() {
        // Two spheres of 1 cm beside each other, of the same part.
        let (surface, frame, n) = two_spheres(3, 0.01, [-0.011, 0.011], [1, 1]);
        let n = n as u32;
        let mut near = NearSkin::default();
        near.fill(&frame);
        // 2 mm under the right one, found from the left one.
        let x = P3::new(0.003, 0.0, 0.0);
        let walked = surface.closest(&frame, &x, 0, 1);
        assert!(walked.signed > 0.0 && walked.vertex < n, "{walked:?}");
        let [own, other] = near.around(&surface, &frame, &x, [1, 2]);
        assert!(
            own.0.iter().all(|v| v.is_some_and(|v| v >= n)) && other == Near::default(),
            "{own:?} {other:?}"
        );
        let found = own
            .or_nearer(&surface, &frame, &x, Some(walked), 1)
            .expect("skin");
        assert!((found.signed + 0.002).abs() < 3e-4, "{}", found.signed);
        assert!(own.seen() && own.under() && !other.seen() && !other.under());
        // Nothing within reach, or nothing nearer: the walk stands.
        let far = P3::new(0.1, 0.0, 0.0);
        assert_eq!(
            near.around(&surface, &frame, &far, [1, 1]),
            [Near::default(); 2]
        );
        let walked = surface.closest(&frame, &far, n, 1);
        assert_eq!(
            Near::default().or_nearer(&surface, &frame, &far, None, 1),
            None
        );
        for near in [Near::default(), Near([Some(0), Some(1)])] {
            assert_eq!(
                near.or_nearer(&surface, &frame, &far, Some(walked), 1),
                Some(walked)
            );
        }
    }

    #[test]
    fn five_millimetres_over_a_limb_a_place_is_near_skin_and_under_none() {
        let (surface, frame, _) = two_spheres(4, 0.1, [-0.15, 0.15], [1, 1]);
        let mut near = NearSkin::default();
        near.fill(&frame);
        for (height, seen, under) in [
            (0.05, false, false),
            (0.005, true, false),
            (-0.002, true, true),
        ] {
            let [own, _] = near.around(&surface, &frame, &P3::new(0.15, 0.1 + height, 0.0), [1, 0]);
            assert_eq!(
                (own.seen(), own.under()),
                (seen, under),
                "{height} m: {own:?}"
            );
        }
    }

    #[test]
    fn under_a_large_triangle_whose_corners_are_far_it_is_found_behind_nearer_vertices() {
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
        let surface = SurfaceModel::new(
            mesh.faces().to_vec(),
            Topology::new(&mesh).expect("topology"),
            parts,
        );
        let mut frame = SurfaceFrame {
            vertices: mesh.vertices().to_vec(),
            normals: Vec::new(),
        };
        surface.update_normals(Par::Seq, &mut frame);
        let side = frame.normals[n as usize].x.signum();
        let x = P3::new(0.011 - 0.002 * side, 0.0, 0.0);
        let mut near = NearSkin::default();
        near.fill(&frame);
        let [own, _] = near.around(&surface, &frame, &x, [1, 0]);
        assert!(
            own.0[0].is_some_and(|v| v < n) && own.0[1].is_some_and(|v| v >= n),
            "{own:?}"
        );
        let walked = surface.closest(&frame, &x, 0, 1);
        assert!(walked.signed > 0.0035 && walked.vertex < n, "{walked:?}");
        let found = own
            .or_nearer(&surface, &frame, &x, Some(walked), 1)
            .expect("skin");
        assert!((found.signed + 0.002).abs() < 1e-5, "{found:?}");
    }
}
