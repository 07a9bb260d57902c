//! Self-contact of one sheet, in worn garments and while dressing.
//!
//! A vertex stays on its side of the nearest triangle of another fold. Both folds keep their mean velocity; no constraint
//! needs a common solution.

use crate::contact::{ClosestPoint, SurfaceFrame, SurfaceModel};
use crate::live::solver::explicit::{ContactPlane, V4};
pub use crate::settings::SelfContactSettings;
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, edge_faces};
use tryon_geometry::par::Par;
use tryon_geometry::spatial::HashGrid;
use wide::f32x4;

/// Smoothing iterations of velocities before they are extrapolated through an interval. Unsmoothed, a dancer's skirt shakes
/// itself apart (stretch 243 %; with one iteration 12.6 %, with two 8.7 %, as without self-contact).
const SMOOTHING: usize = 2;
/// Cost of one normal and smoothed velocity on demand over their cost in a sweep over all.
const ON_DEMAND_COST: usize = 32;

/// Immutable data of a sheet's contact with itself.
#[derive(Debug)]
pub struct SelfContactModel {
    /// Faces and neighbours of the cloth.
    pub surface: SurfaceModel,
    /// Vertices within two rings, which do not count as another fold.
    excluded: Csr,
    /// Ends of each edge, the smaller first, and the edges of each face.
    pub(crate) edges: Vec<[u32; 2]>,
    pub(crate) face_edges: Vec<[u32; 3]>,
    /// 95th percentile of the edge lengths, metres.
    edge: f32,
    settings: SelfContactSettings,
}

/// Positions and velocities of a sheet at a contact query.
#[derive(Debug, Default)]
pub struct SelfContactFrame {
    /// The cloth at the last query.
    pub surface: SurfaceFrame,
    /// m/s.
    pub velocities: Vec<V3>,
    /// The same smoothed, m/s; empty: each is computed on demand.
    smoothed: Vec<f32x4>,
    /// Scratch.
    smoother: Vec<f32x4>,
    grid: HashGrid,
}

impl SelfContactFrame {
    /// Smoothed velocity of a vertex, m/s.
    fn velocity(&self, g: &SurfaceModel, v: u32) -> V3 {
        let known = self.smoothed.get(v as usize).copied();
        let [x, y, z, _] = known
            .unwrap_or_else(|| smoothed(g, &self.velocities, v, SMOOTHING))
            .to_array();
        V3::new(x, y, z)
    }
    /// Plane of vertex `i`, `gap` metres from a closest point on its `side`, with the velocity of its triangle.
    pub fn contact_plane(
        &self,
        model: &SelfContactModel,
        i: usize,
        hit: &ClosestPoint,
        side: f32,
        gap: f32,
    ) -> ContactPlane {
        let g = &model.surface;
        let corners = g.faces()[hit.face as usize];
        let velocity = (0..3).fold(V3::zeros(), |a, k| {
            a + self.velocity(g, corners[k]) * hit.weights[k]
        });
        let n = hit.normal * side;
        ContactPlane {
            vertex: i as u32,
            normal: V4::new(n.x, n.y, n.z),
            offset: n.dot(&hit.point.coords) + gap,
            velocity: V4::new(velocity.x, velocity.y, velocity.z),
            friction: model.settings.friction,
        }
    }
}

/// Velocity of a vertex after some smoothing iterations over neighbours, m/s.
fn smoothed(g: &SurfaceModel, velocities: &[V3], v: u32, iterations: usize) -> f32x4 {
    if iterations == 0 {
        lanes(&velocities[v as usize])
    } else {
        mean(g, v, |w| smoothed(g, velocities, w, iterations - 1))
    }
}

fn lanes(v: &V3) -> f32x4 {
    f32x4::new([v.x, v.y, v.z, 0.0])
}

/// Mean of a vertex and its neighbours.
#[inline(always)]
fn mean(g: &SurfaceModel, v: u32, of: impl Fn(u32) -> f32x4) -> f32x4 {
    let around = g.neighbours(v);
    around.iter().fold(of(v), |a, w| a + of(*w)) / f32x4::splat((1 + around.len()) as f32)
}

/// Distances of one contact query, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Distance kept between two folds.
    pub thickness: f32,
    /// Distance within which folds get a plane.
    pub reach: f32,
    /// Radius of the query for corners.
    pub corner: f32,
}

impl SelfContactModel {
    /// Takes the sheet as a surface and the lengths of its edges.
    pub fn new(
        surface: SurfaceModel,
        lengths: impl Iterator<Item = f32>,
        settings: SelfContactSettings,
    ) -> Self {
        let mut lengths: Vec<f32> = lengths.collect();
        let (mut edges, mut face_edges) = (Vec::new(), vec![[0; 3]; surface.faces().len()]);
        for of_edge in edge_faces(surface.faces()).chunk_by(|a, b| a.0 == b.0) {
            for (ends, face) in of_edge {
                let corners = surface.faces()[*face as usize];
                // The edge opposite to the corner that is no end.
                let k = (0..3).find(|k| !ends.contains(&corners[*k])).unwrap_or(0);
                face_edges[*face as usize][k] = edges.len() as u32;
            }
            edges.push(of_edge[0].0);
        }
        Self {
            excluded: surface.second_neighbours(),
            edges,
            face_edges,
            surface,
            edge: percentile(&mut lengths, 95).unwrap_or(0.0),
            settings,
        }
    }
    /// 95th percentile of the edge lengths, metres.
    pub fn edge(&self) -> f32 {
        self.edge
    }
    /// Vertices within two rings of a vertex, itself included.
    pub(crate) fn within_two_rings(&self, v: u32) -> &[u32] {
        self.excluded.row(v as usize)
    }
    /// Query of a sheet whose points approach each other by at most `motion` metres until the next one.
    pub fn search_all(&self, thickness: f32, motion: f32) -> Search {
        let s = &self.settings;
        self.with_reach(
            thickness,
            (thickness + motion).min(s.reach_edges * self.edge),
            s.margin_edges * self.edge,
        )
    }
    fn with_reach(&self, thickness: f32, reach: f32, margin: f32) -> Search {
        // The nearest corner of an equilateral triangle is at most its circumradius beside the closest point.
        let beside = self.edge / 3f32.sqrt();
        let thickness = thickness.min(self.settings.thickness_edges * self.edge);
        Search {
            thickness,
            reach,
            corner: (reach + margin).hypot(beside),
        }
    }
    /// Prepares a frame whose positions and velocities are set, for queries too if there is a `search`.
    /// For few `expected` planes, normals and smoothed velocities are computed on demand.
    pub fn begin(
        &self,
        par: Par,
        frame: &mut SelfContactFrame,
        search: Option<&Search>,
        expected: usize,
    ) {
        frame.smoothed.clear();
        frame.surface.normals.clear();
        if expected * ON_DEMAND_COST > self.surface.vertices() {
            frame.smoothed.extend(frame.velocities.iter().map(lanes));
            for _ in 0..SMOOTHING {
                let last = &frame.smoothed;
                tryon_geometry::par::map_into(par, last.len(), 1024, &mut frame.smoother, |v| {
                    mean(&self.surface, v as u32, |w| last[w as usize])
                });
                std::mem::swap(&mut frame.smoothed, &mut frame.smoother);
            }
            self.surface.update_normals(par, &mut frame.surface);
        }
        if let Some(search) = search {
            frame
                .grid
                .fill(&frame.surface.vertices, 2.0 * search.corner);
        }
    }
    /// Nearest vertex of another fold to vertex `v` at `x`. `neighbour_of` is scratch: for each vertex the last one that it was
    /// a neighbour of.
    pub fn candidate(
        &self,
        frame: &SelfContactFrame,
        v: u32,
        x: &P3,
        search: &Search,
        neighbour_of: &mut [u32],
    ) -> Option<u32> {
        self.excluded
            .row(v as usize)
            .iter()
            .for_each(|w| neighbour_of[*w as usize] = v);
        let mut best = (search.corner * search.corner, u32::MAX);
        frame.grid.within(x, search.corner, |j, d| {
            if (d, j) < best && neighbour_of[j as usize] != v {
                best = (d, j);
            }
        });
        (best.1 != u32::MAX).then_some(best.1)
    }
    /// Closest point to vertex `v` at `x` on the triangles around a corner of another fold.
    pub fn other_fold(
        &self,
        frame: &SelfContactFrame,
        v: u32,
        x: &P3,
        corner: u32,
    ) -> Option<ClosestPoint> {
        let g = &self.surface;
        let hit = g.closest_around(&frame.surface, x, corner, u8::MAX);
        let same = g.faces()[hit.face as usize]
            .iter()
            .any(|&c| c == v || g.neighbours(v).contains(&c));
        (!same && !g.is_on_border(&hit)).then_some(hit)
    }
    /// Contact plane of vertex `v` with its closest point on another fold, and their distance, metres. The plane names
    /// the vertex `i`.
    pub fn plane(
        &self,
        frame: &SelfContactFrame,
        i: usize,
        v: u32,
        hit: &ClosestPoint,
        search: &Search,
    ) -> Option<(ContactPlane, f32)> {
        let g = &self.surface;
        let far = hit.signed_distance.abs();
        if !(far < search.reach) {
            return None;
        }
        // It stays on its side. Folds nearer than their thickness are not driven apart: an impact without bounce.
        let side = if hit.signed_distance >= 0.0 {
            1.0
        } else {
            -1.0
        };
        // Half-way to contact: both keep their mean velocity and neither passes the other.
        let gap = match far > search.thickness {
            true => 0.5 * (far + search.thickness),
            false => far,
        };
        let mut plane = frame.contact_plane(self, i, hit, side, gap);
        let own = frame.velocity(g, v);
        let own = V4::new(own.x, own.y, own.z);
        plane.velocity = (plane.velocity + own).scale(0.5);
        // Folds that part need no plane.
        if plane.normal.dot(own - plane.velocity) > 0.0 {
            return None;
        }
        Some((plane, far))
    }
}
