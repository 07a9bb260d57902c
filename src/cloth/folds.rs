//! The folds of one sheet held off each other, in worn garments and in scenes.
//!
//! A vertex is kept on its side of the nearest triangle of another fold. Each of the two is held off the other and both
//! move on as they do on average; nothing needs a common solution.

use crate::cloth::solver::explicit::{ContactPlane, V4};
use crate::contact::{Closest, SurfaceFrame, SurfaceModel};
use crate::math::{P3, V3};
use crate::mesh::Csr;
use crate::par::Par;
use crate::spatial::HashGrid;
use wide::f32x4;

/// Folds close at up to this speed, m/s.
pub(crate) const CLOSING: f32 = 1.0;
/// Folds nearer than this are looked at, metres: what they come within a round of 8 ms. Farther ones hold each other over the
/// air between them: with 11 mm in a dancer's rounds and 20 mm while dressing her skirt tore (stretch 176 % instead of 7 %).
const MOST_REACH: f32 = 0.01;
/// The same in lengths of the sheet's edges: the third ring of neighbours, the first that counts as another fold, lies
/// farther in a fold that is not sharper than the mesh can hold. 0.85 leaves edges of 11.8 mm what they had.
const REACH_EDGES: f32 = 0.85;
/// The most that folds are held apart, in lengths of edges: more, and the sheet around a sharp fold is held open.
const THICKNESS_EDGES: f32 = 0.25;
/// Corners are looked for so much further than needed, in lengths of edges: what they are farther off is room that they
/// may come nearer by until they are looked for again.
const ROOM_EDGES: f32 = 0.75;
/// Friction of cloth on cloth: lower than measured (0.3), as planes that are looked for anew in each round hold already.
pub(crate) const FRICTION: f32 = 0.1;
/// Rounds of averaging speeds over neighbours before they are extrapolated through a round. A vertex that vibrates at
/// 3 m/s would else carry what touches it by 1 cm each way; a dancer's skirt shook itself to pieces (without it 10k
/// vertices stretch by 243 %, with one round by 12.6 %, with two by 8.7 %, as without contact of cloth with cloth).
const CALMING: usize = 2;
/// One normal and calm velocity that is computed when it is wanted costs as much as so many of all in their order.
const DEAR: usize = 32;

/// A sheet as something that touches itself.
#[derive(Debug)]
pub(crate) struct FoldModel {
    pub(crate) surface: SurfaceModel,
    /// Vertices too near on the sheet to count as another fold.
    close: Csr,
    /// Length that 95 % of the edges do not exceed, metres.
    edge: f32,
}

/// The sheet when its folds are looked for.
#[derive(Debug, Default)]
pub(crate) struct FoldFrame {
    pub(crate) surface: SurfaceFrame,
    /// m/s.
    pub(crate) velocities: Vec<V3>,
    /// The same calmed, m/s; empty where each is computed when it is wanted.
    calm: Vec<f32x4>,
    /// Scratch.
    calmer: Vec<f32x4>,
    grid: HashGrid,
}

impl FoldFrame {
    /// Calm velocity of a vertex, m/s.
    fn speed(&self, g: &SurfaceModel, v: u32) -> V3 {
        let calm = self.calm.get(v as usize).copied();
        let [x, y, z, _] = calm
            .unwrap_or_else(|| calmed(g, &self.velocities, v, CALMING))
            .to_array();
        V3::new(x, y, z)
    }
}

/// Velocity of a vertex after so many rounds of averaging over neighbours, m/s.
fn calmed(g: &SurfaceModel, sharp: &[V3], v: u32, rounds: usize) -> f32x4 {
    if rounds == 0 {
        lanes(&sharp[v as usize])
    } else {
        mean(g, v, |w| calmed(g, sharp, w, rounds - 1))
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

/// How far one search looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Search {
    /// Distance between two folds, metres.
    pub(crate) thickness: f32,
    /// Nearer folds get a plane, metres.
    pub(crate) reach: f32,
    /// No corner of another fold is nearer: none of its triangles is within reach, metres.
    needed: f32,
    /// Corners are looked for within this, metres.
    pub(crate) corner: f32,
    /// Folds meet half-way and are let go where they part; else each is kept off where the other was.
    halfway: bool,
}

impl FoldModel {
    /// From the sheet as a surface and the lengths of its edges.
    pub(crate) fn new(surface: SurfaceModel, lengths: impl Iterator<Item = f32>) -> Self {
        let mut lengths: Vec<f32> = lengths.collect();
        lengths.sort_unstable_by(f32::total_cmp);
        let edge = lengths
            .get(lengths.len() * 95 / 100)
            .copied()
            .unwrap_or(0.0);
        Self {
            close: surface.second_neighbours(),
            surface,
            edge,
        }
    }
    /// Length that 95 % of the edges do not exceed, metres.
    pub(crate) fn edge(&self) -> f32 {
        self.edge
    }
    /// A search in worn garments, whose planes are kept for `span` seconds.
    pub(crate) fn search(&self, thickness: f32, span: f32) -> Search {
        let reach = (thickness + CLOSING * span)
            .min(MOST_REACH)
            .min(REACH_EDGES * self.edge);
        // Half-way, a shirt that was being put on a heavy body stretched by 20 %, the limit of a test.
        Search {
            halfway: false,
            ..self.looking(thickness, reach, CLOSING * span)
        }
    }
    /// A search where no two places of the sheet come together by more than `way` metres until the next one.
    pub(crate) fn search_all(&self, thickness: f32, way: f32) -> Search {
        self.looking(
            thickness,
            (thickness + way).min(REACH_EDGES * self.edge),
            ROOM_EDGES * self.edge,
        )
    }
    fn looking(&self, thickness: f32, reach: f32, further: f32) -> Search {
        // The nearest corner of an even triangle is at most its circumradius beside the nearest point.
        let beside = self.edge / 3f32.sqrt();
        let thickness = thickness.min(THICKNESS_EDGES * self.edge);
        Search {
            thickness,
            reach,
            needed: reach.hypot(beside),
            corner: (reach + further).hypot(beside),
            halfway: true,
        }
    }
    /// Prepares a frame whose positions and velocities have been set; with a search also for that. `touches`: how many
    /// planes are expected. For few of them normals and calm velocities are computed when they are wanted.
    pub(crate) fn begin(
        &self,
        par: Par,
        frame: &mut FoldFrame,
        search: Option<&Search>,
        touches: usize,
    ) {
        frame.calm.clear();
        frame.surface.normals.clear();
        if touches * DEAR > self.surface.vertices() {
            frame.calm.extend(frame.velocities.iter().map(lanes));
            for _ in 0..CALMING {
                let calm = &frame.calm;
                crate::par::map_into(par, calm.len(), 1024, &mut frame.calmer, |v| {
                    mean(&self.surface, v as u32, |w| calm[w as usize])
                });
                std::mem::swap(&mut frame.calm, &mut frame.calmer);
            }
            self.surface.update_normals(par, &mut frame.surface);
        }
        if let Some(search) = search {
            frame
                .grid
                .fill(&frame.surface.vertices, 2.0 * search.corner);
        }
    }
    /// Nearest vertex to the place `x` of vertex `v` that is no neighbour on the sheet. `neighbour_of` holds for each
    /// vertex the last one that it was a neighbour of. And how far it is, metres.
    pub(crate) fn corner(
        &self,
        frame: &FoldFrame,
        v: u32,
        x: &P3,
        search: &Search,
        neighbour_of: &mut [u32],
    ) -> Option<(u32, f32)> {
        self.close
            .row(v as usize)
            .iter()
            .for_each(|w| neighbour_of[*w as usize] = v);
        let mut best = (search.corner * search.corner, u32::MAX);
        frame.grid.within(x, search.corner, |j, d| {
            if (d, j) < best && neighbour_of[j as usize] != v {
                best = (d, j);
            }
        });
        (best.1 != u32::MAX).then_some((best.1, best.0.sqrt()))
    }
    /// How much nearer a corner so far away, or one that was not found, may come before it matters, metres.
    pub(crate) fn room(search: &Search, corner: Option<(u32, f32)>) -> f32 {
        corner.map_or(search.corner, |c| c.1) - search.needed
    }
    /// Where the triangles around a corner of another fold are nearest to vertex `v` at `x`.
    pub(crate) fn other_fold(
        &self,
        frame: &FoldFrame,
        v: u32,
        x: &P3,
        corner: u32,
    ) -> Option<Closest> {
        let g = &self.surface;
        let hit = g.closest_around(&frame.surface, x, corner, u8::MAX);
        let same = g.faces()[hit.face as usize]
            .iter()
            .any(|&c| c == v || g.neighbours(v).contains(&c));
        (!same && !g.on_rim(&hit)).then_some(hit)
    }
    /// What holds vertex `v` at `x` off the triangles around a corner of another fold, and how far they are, metres.
    /// `i` is the vertex that the plane names.
    pub(crate) fn plane(
        &self,
        frame: &FoldFrame,
        i: usize,
        v: u32,
        x: &P3,
        corner: u32,
        search: &Search,
    ) -> Option<(ContactPlane, f32)> {
        let g = &self.surface;
        let hit = self.other_fold(frame, v, x, corner)?;
        let far = hit.signed.abs();
        if !(far < search.reach) {
            return None;
        }
        // Which side it is on now is the side it stays on, and folds nearer than their thickness are not thrown apart.
        // An impact without bounce.
        let side = if hit.signed >= 0.0 { 1.0 } else { -1.0 };
        // Half-way to where they touch: both move on as on average, and neither passes the other in the meantime.
        let gap = match far > search.thickness {
            true if search.halfway => 0.5 * (far + search.thickness),
            true => search.thickness,
            false => far,
        };
        let mut plane = touching(g, frame, i, &hit, side, gap);
        let own = frame.speed(g, v);
        let own = V4::new(own.x, own.y, own.z);
        plane.velocity = (plane.velocity + own).scale(0.5);
        // Folds that part need no plane: one that follows them would carry what has long met something else.
        if search.halfway && plane.normal.dot(own - plane.velocity) > 0.0 {
            return None;
        }
        Some((plane, far))
    }
}

/// The plane at a hit, `gap` away from it on its `side`, as fast as its corners.
pub(crate) fn touching(
    g: &SurfaceModel,
    frame: &FoldFrame,
    i: usize,
    hit: &Closest,
    side: f32,
    gap: f32,
) -> ContactPlane {
    let corners = g.faces()[hit.face as usize];
    let speed = (0..3).fold(V3::zeros(), |a, k| {
        a + frame.speed(g, corners[k]) * hit.weights[k]
    });
    let n = hit.normal * side;
    ContactPlane {
        vertex: i as u32,
        normal: V4::new(n.x, n.y, n.z),
        offset: n.dot(&hit.point.coords) + gap,
        velocity: V4::new(speed.x, speed.y, speed.z),
        friction: FRICTION,
    }
}
