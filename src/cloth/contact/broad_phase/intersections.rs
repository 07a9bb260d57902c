//! All intersections of a mesh at rest: edges that meet triangles.

use super::{BoxTree, BroadPhase, ContactSweep, SweepFrame};
use crate::contact::contact_mesh::ContactMesh;
use crate::contact::edge_triangle::edge_meets_triangle;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// An edge that meets a triangle without a common or excluded vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EdgeFace {
    /// Index in [`ContactMesh::edges`].
    pub edge: u32,
    /// Index in [`ContactMesh::faces`].
    pub face: u32,
}

impl BroadPhase {
    /// Edges that meet triangles at `positions` (shape `[vertices]`, metres), ascending; not two of the obstacle.
    ///
    /// Exact for the positions as they are given: none are missed and none invented. A position that isn't finite is in
    /// no intersection.
    ///
    /// # Panics
    /// With fewer positions than the mesh has vertices.
    pub fn intersections(
        &mut self,
        mesh: &ContactMesh,
        positions: &[V3d],
        par: Par,
    ) -> Vec<EdgeFace> {
        let sweep = ContactSweep {
            start: positions,
            end: positions,
            distance: 0.0,
            obstacle_distance: 0.0,
        };
        self.update_surfaces(mesh, &SweepFrame::new(&sweep), par);
        let (edges, faces) = (mesh.cloth_edges() as u32, mesh.cloth_faces() as u32);
        let join = |own: &BoxTree, first_edge: u32, other: &BoxTree, first_face: u32| {
            let meets = |e: u32, f: u32| are_met(mesh, positions, [e + first_edge, f + first_face]);
            let found = own.join(par, other, meets);
            let index = move |[e, f]: [u32; 2]| EdgeFace {
                edge: e + first_edge,
                face: f + first_face,
            };
            found.into_iter().map(index)
        };
        let mut all: Vec<EdgeFace> = join(&self.cloth_edges, 0, &self.cloth_faces, 0)
            .chain(join(&self.cloth_edges, 0, &self.obstacle_faces, faces))
            .chain(join(&self.obstacle_edges, edges, &self.cloth_faces, 0))
            .collect();
        all.sort_unstable();
        all
    }
}

fn are_met(mesh: &ContactMesh, positions: &[V3d], [edge, face]: [u32; 2]) -> bool {
    let (edge, face) = (mesh.edges()[edge as usize], mesh.faces()[face as usize]);
    let at = |v: u32| positions[v as usize];
    let (ends, corners) = (edge.map(at), face.map(at));
    let is_finite = ends
        .iter()
        .chain(&corners)
        .all(|p| p.iter().all(|c| c.is_finite()));
    is_finite && !mesh.are_incident(&edge, &face) && edge_meets_triangle(&ends, &corners)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactSurface;
    use rand::{Rng, SeedableRng};

    #[test]
    fn intersections_are_those_of_brute_force() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(12);
        for (cloth, obstacle) in [(0, 0), (80, 0), (50, 40)] {
            let count = cloth + obstacle;
            let strip = |n: usize| -> Vec<_> { (2..n as u32).map(|k| [k - 2, k - 1, k]).collect() };
            let (own, other) = (strip(cloth), strip(obstacle));
            let surface = |vertices, faces| ContactSurface { vertices, faces };
            let mut mesh =
                ContactMesh::new(surface(cloth, &own), surface(obstacle, &other)).expect("a mesh");
            mesh.exclude(&[[2, 9]]);
            // Multiples of a quarter, so that many pairs only touch.
            let mut point = || V3d::from_fn(|_, _| f64::from(random.random_range(0..9)) * 0.25);
            let mut x: Vec<V3d> = (0..count).map(|_| point()).collect();
            if count > 4 {
                x[3].y = f64::NAN;
            }
            let mut slow = Vec::new();
            for edge in 0..mesh.edges().len() as u32 {
                for face in 0..mesh.faces().len() as u32 {
                    let of_cloth = (edge as usize) < mesh.cloth_edges();
                    let on_cloth = (face as usize) < mesh.cloth_faces();
                    if (of_cloth || on_cloth) && are_met(&mesh, &x, [edge, face]) {
                        slow.push(EdgeFace { edge, face });
                    }
                }
            }
            assert!(count == 0 || slow.len() > 100, "{}", slow.len());
            let mut broad_phase = BroadPhase::default();
            for par in [Par::Seq, Par::Rayon] {
                assert_eq!(broad_phase.intersections(&mesh, &x, par), slow);
            }
        }
    }
}
