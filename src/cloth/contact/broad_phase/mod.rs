//! Broad phase: vertex–face and edge–edge pairs that may come within a distance of each other along a step.
//!
//! - [`BroadPhase::candidates`]`(&ContactMesh, &ContactSweep, Par) -> Vec<ContactPair>`;
//! - [`BroadPhase::intersections`]`(&ContactMesh, &[V3d], Par) -> Vec<EdgeFace>`: exact, for the positions at rest.
//!
//! Boxes of elements are swept along the step relative to the mean motion, and joined tree with tree. Two obstacle
//! elements never form a pair, nor do elements that share a vertex.

mod box_tree;
mod element_box;
pub(crate) mod intersections;

use super::contact_mesh::ContactMesh;
use super::pair::ContactPair;
use box_tree::BoxTree;
use element_box::{ElementBox, SweepFrame};
pub use intersections::EdgeFace;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;

/// Linear motion of all vertices of a [`ContactMesh`], and the distance at which pairs matter.
#[derive(Clone, Copy, Debug)]
pub struct ContactSweep<'a> {
    /// Positions at the start, cloth then obstacle, shape `[vertices]`, metres.
    pub start: &'a [V3d],
    /// Positions at the end; the same slice for pairs at rest.
    pub end: &'a [V3d],
    /// Pairs of the cloth whose boxes come as near as this are candidates, metres.
    pub distance: f64,
    /// The same for pairs of cloth and obstacle, metres; no less.
    pub obstacle_distance: f64,
}

/// Trees of the broad phase, refit while the mesh keeps its size.
#[derive(Clone, Debug, Default)]
pub struct BroadPhase {
    cloth_vertices: BoxTree,
    obstacle_vertices: BoxTree,
    cloth_faces: BoxTree,
    obstacle_faces: BoxTree,
    cloth_edges: BoxTree,
    obstacle_edges: BoxTree,
}

impl BroadPhase {
    /// All pairs whose elements may come within the distance: cloth vertices with cloth faces, with obstacle faces,
    /// obstacle vertices with cloth faces, edges of the cloth with one another, with obstacle edges; each part
    /// ascending. The same at any thread count and after any earlier query.
    ///
    /// # Panics
    /// With fewer positions than the mesh has vertices.
    pub fn candidates(
        &mut self,
        mesh: &ContactMesh,
        sweep: &ContactSweep<'_>,
        par: Par,
    ) -> Vec<ContactPair> {
        self.update(mesh, &SweepFrame::new(sweep), par);
        let mut pairs = self.vertex_face(mesh, par);
        pairs.extend(self.edge_edge(mesh, par));
        pairs
    }

    fn update(&mut self, mesh: &ContactMesh, frame: &SweepFrame<'_>, par: Par) {
        self.update_surfaces(mesh, frame, par);
        let cloth = mesh.cloth_vertices();
        let vertex = |v: usize, frame| ElementBox::of(&[v as u32], frame);
        let (rest, outer) = (mesh.vertices() - cloth, frame.of_obstacle());
        (self.cloth_vertices).update(par, cloth, |v| vertex(v, frame));
        (self.obstacle_vertices).update(par, rest, |v| vertex(v + cloth, &outer));
    }

    fn update_surfaces(&mut self, mesh: &ContactMesh, frame: &SweepFrame<'_>, par: Par) {
        let face = |f: usize, frame| ElementBox::of(&mesh.faces()[f], frame);
        let edge = |e: usize, frame| ElementBox::of(&mesh.edges()[e], frame);
        let outer = frame.of_obstacle();
        let own = mesh.cloth_faces();
        let rest = mesh.faces().len() - own;
        (self.cloth_faces).update(par, own, |f| face(f, frame));
        (self.obstacle_faces).update(par, rest, |f| face(f + own, &outer));
        let own = mesh.cloth_edges();
        let rest = mesh.edges().len() - own;
        (self.cloth_edges).update(par, own, |e| edge(e, frame));
        (self.obstacle_edges).update(par, rest, |e| edge(e + own, &outer));
    }

    fn vertex_face(&self, mesh: &ContactMesh, par: Par) -> Vec<ContactPair> {
        let vertex = mesh.cloth_vertices() as u32;
        let (own, other) = mesh.faces().split_at(mesh.cloth_faces());
        let pairs = |found: Vec<[u32; 2]>, first: u32, faces: &[Face]| -> Vec<ContactPair> {
            let pair = |[v, f]: [u32; 2]| ContactPair::VertexFace {
                v: v + first,
                f: faces[f as usize],
            };
            found.into_iter().map(pair).collect()
        };
        let apart = |v: u32, f: &Face| !mesh.are_incident(&[v], f);
        let cloth = &self.cloth_vertices;
        let on_cloth = cloth.join(par, &self.cloth_faces, |v, f| apart(v, &own[f as usize]));
        let on_obstacle = cloth.join(par, &self.obstacle_faces, |v, f| {
            apart(v, &other[f as usize])
        });
        let below = |v: u32, f: u32| apart(v + vertex, &own[f as usize]);
        let of_obstacle = self.obstacle_vertices.join(par, &self.cloth_faces, below);
        let mut all = pairs(on_cloth, 0, own);
        all.extend(pairs(on_obstacle, 0, other));
        all.extend(pairs(of_obstacle, vertex, own));
        all
    }

    fn edge_edge(&self, mesh: &ContactMesh, par: Par) -> Vec<ContactPair> {
        let (own, other) = mesh.edges().split_at(mesh.cloth_edges());
        let apart = |a: u32, b: &[u32; 2]| !mesh.are_incident(&own[a as usize], b);
        let pairs = |found: Vec<[u32; 2]>, edges: &[[u32; 2]]| -> Vec<ContactPair> {
            let pair = |[a, b]: [u32; 2]| ContactPair::EdgeEdge {
                a: own[a as usize],
                b: edges[b as usize],
            };
            found.into_iter().map(pair).collect()
        };
        let cloth = &self.cloth_edges;
        let on_cloth = cloth.self_join(par, |a, b| apart(a, &own[b as usize]));
        let on_obstacle = cloth.join(par, &self.obstacle_edges, |a, b| {
            apart(a, &other[b as usize])
        });
        let mut all = pairs(on_cloth, own);
        all.extend(pairs(on_obstacle, other));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactSurface;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Every pair, filtered by boxes and incidence.
    fn brute_force(mesh: &ContactMesh, sweep: &ContactSweep<'_>) -> Vec<ContactPair> {
        let frame = SweepFrame::new(sweep);
        let (cloth, outer) = (mesh.cloth_vertices() as u32, frame.of_obstacle());
        let boxed = |v: &[u32]| {
            let frame = if v[0] < cloth { &frame } else { &outer };
            ElementBox::of(v, frame)
        };
        let near = |a: &[u32], b: &[u32]| !mesh.are_incident(a, b) && boxed(a).overlaps(&boxed(b));
        let (own, other) = mesh.faces().split_at(mesh.cloth_faces());
        let mut pairs = Vec::new();
        let all = cloth..mesh.vertices() as u32;
        for (vertices, faces) in [(0..cloth, own), (0..cloth, other), (all, own)] {
            for v in vertices {
                let close = faces.iter().filter(|f| near(&[v], *f));
                pairs.extend(close.map(|f| ContactPair::VertexFace { v, f: *f }));
            }
        }
        let (own, other) = mesh.edges().split_at(mesh.cloth_edges());
        for (is_self, edges) in [(true, own), (false, other)] {
            for (k, a) in own.iter().enumerate() {
                let later = edges.iter().skip(if is_self { k + 1 } else { 0 });
                let close = later.filter(|b| near(a, *b));
                pairs.extend(close.map(|b| ContactPair::EdgeEdge { a: *a, b: *b }));
            }
        }
        pairs
    }

    fn strip(vertices: usize) -> Vec<Face> {
        (2..vertices as u32).map(|k| [k - 2, k - 1, k]).collect()
    }

    fn random_points(random: &mut Pcg64Mcg, count: usize, size: f64) -> Vec<V3d> {
        let mut point = || V3d::from_fn(|_, _| random.random_range(-1.0..1.0) * size);
        (0..count).map(|_| point()).collect()
    }

    #[test]
    fn candidates_are_those_of_brute_force_at_any_thread_count() {
        let mut random = Pcg64Mcg::seed_from_u64(7);
        let mut broad_phase = BroadPhase::default();
        for (cloth, obstacle, step, distance) in [
            (0, 0, 0.0, 0.1),
            (60, 0, 0.0, 0.02),
            (60, 40, 0.1, 0.0),
            (40, 60, 3.0, 1e-3),
            (30, 30, 0.1, 1.0),
        ] {
            let (own, other) = (strip(cloth), strip(obstacle));
            let surface = |vertices, faces| ContactSurface { vertices, faces };
            let mut mesh =
                ContactMesh::new(surface(cloth, &own), surface(obstacle, &other)).expect("a mesh");
            mesh.exclude(&[[3, 20], [5, 7]]);
            // A chain with short links, so that boxes are small beside the whole.
            let mut start = random_points(&mut random, cloth + obstacle, 0.2);
            for k in 1..start.len() {
                start[k] = start[k] + start[k - 1];
            }
            let moves = random_points(&mut random, start.len(), step);
            let end: Vec<V3d> = start.iter().zip(&moves).map(|(p, m)| p + m).collect();
            let sweep = ContactSweep {
                start: &start,
                end: &end,
                distance,
                obstacle_distance: 1.5 * distance,
            };
            let found = broad_phase.candidates(&mesh, &sweep, Par::Seq);
            assert_eq!(found, brute_force(&mesh, &sweep));
            let again = broad_phase.candidates(&mesh, &sweep, Par::Rayon);
            assert_eq!(found, again);
        }
    }

    #[test]
    fn positions_that_are_not_finite_are_near_everything() {
        let faces = strip(9);
        let cloth = ContactSurface {
            vertices: 9,
            faces: &faces,
        };
        let mesh = ContactMesh::new(cloth, ContactSurface::default()).expect("a mesh");
        let mut x: Vec<V3d> = (0..9)
            .map(|k| V3d::new(10.0 * f64::from(k), 0.0, 0.0))
            .collect();
        x[4].y = f64::NAN;
        x[8].z = f64::INFINITY;
        let sweep = ContactSweep {
            start: &x,
            end: &x,
            distance: 0.0,
            obstacle_distance: 0.0,
        };
        let found = BroadPhase::default().candidates(&mesh, &sweep, Par::Seq);
        assert_eq!(found, brute_force(&mesh, &sweep));
        assert!(found.contains(&ContactPair::VertexFace { v: 4, f: [0, 1, 2] }));
    }
}
