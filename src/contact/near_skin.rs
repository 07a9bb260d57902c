//! Nearest points on a surface that do not depend on where a walk starts.
//!
//! In the crook of an elbow a walk ends on the upper arm though the forearm is nearer, and between toes or fingers on any of
//! them: it finds skin that is near by, but not the skin that cloth is under.

use super::{Closest, Part, PointGrid, SurfaceFrame, SurfaceModel};
use crate::math::P3;

/// Cloth is not expected deeper than this under skin that no walk led to, metres: the vertices of a body are about as far
/// from each other.
const REACH: f32 = 0.015;

/// The vertices of a surface, looked for around a place.
#[derive(Clone, Debug, Default)]
pub struct NearSkin {
    grid: PointGrid,
}

impl NearSkin {
    /// The surface is there now.
    pub fn fill(&mut self, frame: &SurfaceFrame) {
        self.grid.fill(&frame.vertices, 2.0 * REACH);
    }
    /// Of two kinds of parts the vertex nearest to `x`, if there is one within 15 mm.
    pub fn vertices(&self, surface: &SurfaceModel, x: &P3, masks: [Part; 2]) -> [Option<u32>; 2] {
        let mut best = [(REACH * REACH, None); 2];
        self.grid.within(x, REACH, |v, d| {
            let part = surface.part(v);
            for (best, mask) in best.iter_mut().zip(masks) {
                if (d, Some(v)) < *best && part & mask != 0 {
                    *best = (d, Some(v));
                }
            }
        });
        best.map(|b| b.1)
    }
}

/// Where a walk led, or the point around the `nearest` of all vertices where that is nearer to `x`.
pub fn nearer(
    surface: &SurfaceModel,
    frame: &SurfaceFrame,
    x: &P3,
    walked: Closest,
    nearest: Option<u32>,
    mask: Part,
) -> Closest {
    let Some(nearest) = nearest.filter(|v| *v != walked.vertex) else { return walked };
    let other = surface.closest_around(frame, x, nearest, mask);
    if !other.rim && other.signed.abs() < walked.signed.abs() { other } else { walked }
}

#[cfg(test)]
mod tests {
    use super::super::surface::tests::sphere;
    use super::*;
    use crate::math::V3;
    use crate::mesh::{Topology, TriMesh};
    use crate::par::Par;

    #[test]
    fn under_one_of_two_toes_a_walk_on_the_other_is_brought_to_it() {
        // Two spheres of 1 cm beside each other, of the same part: no edge leads from one to the other.
        let ball = sphere(3);
        let n = ball.vertices().len() as u32;
        let side = |by: f32| ball.vertices().iter().map(move |p| P3::from(p.coords * 0.01 + V3::x() * by));
        let places: Vec<P3> = side(-0.011).chain(side(0.011)).collect();
        let faces = ball.faces().iter().copied().chain(ball.faces().iter().map(|f| f.map(|v| v + n))).collect();
        let mesh = TriMesh::new(places, faces).expect("two spheres");
        let parts = vec![1; mesh.vertices().len()];
        let surface = SurfaceModel::new(mesh.faces().to_vec(), Topology::new(&mesh).expect("topology"), parts);
        let mut frame = SurfaceFrame { vertices: mesh.vertices().to_vec(), normals: Vec::new() };
        surface.update_normals(Par::Seq, &mut frame);
        let mut near = NearSkin::default();
        near.fill(&frame);
        // 2 mm under the right one, found from the left one.
        let x = P3::new(0.003, 0.0, 0.0);
        let walked = surface.closest(&frame, &x, 0, 1);
        assert!(walked.signed > 0.0 && walked.vertex < n, "{walked:?}");
        let [own, other] = near.vertices(&surface, &x, [1, 2]);
        assert!(own.is_some_and(|v| v >= n) && other.is_none(), "{own:?} {other:?}");
        let found = nearer(&surface, &frame, &x, walked, own, 1);
        assert!((found.signed + 0.002).abs() < 3e-4, "{}", found.signed);
        // Nothing within reach, or nothing nearer: the walk stands.
        let far = P3::new(0.1, 0.0, 0.0);
        assert_eq!(near.vertices(&surface, &far, [1, 1]), [None; 2]);
        let walked = surface.closest(&frame, &far, n, 1);
        assert_eq!(nearer(&surface, &frame, &far, walked, None, 1), walked);
        assert_eq!(nearer(&surface, &frame, &far, walked, Some(0), 1), walked);
    }
}
