//! Contact of cloth with cloth: half-spaces between near pairs of features, laid anew in each block of substeps.
//!
//! A pair is a vertex and a face or two edges, of two garments or of one; its direction is that of the closest points at the
//! query. In each block the gap between both sides along it is divided, and both halves become half-spaces that move at the
//! pair's mean velocity, or with the side that the body moves ("divide and truncate", Chen et al. 2025, along one
//! direction): sliding stays free. Of the pairs of one vertex with like directions the narrowest counts, so a vertex has one
//! half-space for each sheet beside it.

use super::chunk::ContactChunk;
use super::near_candidates::NearCandidates;
use super::near_pairs::{NearPair, NearPairs};
use super::outfit_vertices::OutfitVertices;
use crate::live::outfit_model::Model;
use crate::live::patch::{PatchWork, v4};
use crate::live::solver::explicit::ContactPlane;
use crate::live::state::State;
use crate::settings::NearPairSettings;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Csr;
use tryon_geometry::par::{self, Par};

/// Directions of a vertex: more join the nearest one.
const DIRECTIONS: usize = 8;
const NONE: u32 = u32::MAX;

/// Part of a step between two layings of the planes.
#[derive(Clone, Copy, Debug)]
pub(in crate::live) struct Block {
    /// Begin since the query and length, s.
    pub(in crate::live) t: f32,
    pub(in crate::live) span: f32,
}

impl Block {
    /// Number of equal blocks in an interval of `span` seconds.
    pub(in crate::live) fn count(span: f64, settings: &NearPairSettings) -> usize {
        /// Share of a block by which an interval may be longer without another one.
        const SLACK: f64 = 1e-3;
        (span / settings.block - SLACK).ceil().max(1.0) as usize
    }
}

/// Middle between both sides of a pair along its direction, metres, and their mean velocity, m/s.
#[derive(Clone, Copy, Debug, Default)]
struct Middle {
    height: f32,
    velocity: V3,
}

/// Half-space of a vertex in one of its directions: offset at the query, metres, and velocity, m/s.
#[derive(Clone, Copy, Debug, Default)]
struct HalfSpace {
    offset: f32,
    velocity: V3,
}

/// Vertex and direction that like pairs share.
#[derive(Clone, Copy, Debug)]
struct PlaneSlot {
    vertex: u32,
    normal: V3,
    /// Pairs with another garment.
    is_layer: bool,
}

/// Positions of an outfit, its near pairs and their half-spaces. Vertices of all garments are numbered through.
#[derive(Debug, Default)]
pub(in crate::live) struct PairContacts {
    all: OutfitVertices,
    candidates: NearCandidates,
    near: NearPairs,
    smoothing: Smoothing,
    /// Vertices that the body moves in the block.
    driven: Vec<bool>,
    middles: Vec<Middle>,
    slots: Vec<PlaneSlot>,
    /// Slots of each vertex.
    of_vertex: Vec<[u32; DIRECTIONS]>,
    /// Plane slot and pair.
    members: Vec<(u32, u32)>,
    by_slot: Csr,
    half_spaces: Vec<HalfSpace>,
}

impl PairContacts {
    /// Finds what may come near at the beginning of a step of `span` seconds.
    pub(in crate::live) fn begin(
        &mut self,
        model: &Model,
        state: &State,
        patches: &[PatchWork],
        span: f32,
    ) {
        self.all.number(model);
        self.all.gather(model, patches);
        self.candidates.find(model, state, &self.all, span);
    }

    /// Finds the near pairs at the beginning of an interval of `span` seconds.
    pub(in crate::live) fn query(&mut self, model: &Model, patches: &[PatchWork], span: f32) {
        self.near.pairs.clear();
        if self.candidates.is_empty() {
            self.slots.clear();
            return;
        }
        self.all.gather(model, patches);
        self.near.find(model, &self.all, &self.candidates, span);
        self.smoothing.surround(model, &self.all, &self.near.pairs);
        self.assign(model.config.contact.pairs.alike);
    }

    /// Number of near pairs.
    pub(in crate::live) fn len(&self) -> usize {
        self.near.pairs.len()
    }

    /// Takes over the motion after a block. A mean velocity of the block would lag behind, and half-spaces that lag brake cloth
    /// in free flight.
    pub(in crate::live) fn advance(&mut self, model: &Model, patches: &[PatchWork]) {
        if !self.near.pairs.is_empty() {
            self.all.gather(model, patches);
        }
    }

    /// Groups the directions of the pairs by vertex.
    fn assign(&mut self, alike: f32) {
        self.of_vertex.clear();
        self.of_vertex.resize(self.all.len(), [NONE; DIRECTIONS]);
        self.slots.clear();
        self.members.clear();
        for (k, p) in self.near.pairs.iter().enumerate() {
            let [a, .., b] = p.vertices.map(|v| self.all.garment_of(v));
            let is_layer = a != b;
            for (i, v) in p.vertices.iter().enumerate() {
                let new = PlaneSlot {
                    vertex: *v,
                    normal: p.outward(i),
                    is_layer,
                };
                let own = &mut self.of_vertex[*v as usize];
                let slot = join(own, &mut self.slots, new, alike);
                self.members.push((slot, k as u32));
            }
        }
        self.by_slot = Csr::from_pairs(self.slots.len(), &self.members);
    }

    /// Predicts the velocities of the vertices that the body will move in a block: without, the half-spaces hold still for
    /// a block what a leg kicks.
    fn predict(
        &mut self,
        model: &Model,
        patches: &[PatchWork],
        chunks: &[ContactChunk],
        block: Block,
    ) {
        self.driven.clear();
        self.driven.resize(self.all.x.len(), false);
        for c in chunks {
            let f = &model.garments[c.garment].patches[c.patch];
            let motion = &patches[c.at].motion;
            for plane in c
                .body_planes
                .iter()
                .filter(|p| (p.vertex as usize) < f.owned)
            {
                let i = plane.vertex as usize;
                let v = self.all.number_of(c.garment, f.vertices[i]);
                let gap = plane.gap(motion.position(i), block.t).max(0.0);
                let normal = plane.normal.point().coords;
                let lacking = plane.rate() - normal.dot(&self.all.velocity[v]) - gap / block.span;
                if lacking > 0.0 {
                    self.all.velocity[v] += normal * lacking;
                    self.driven[v] = true;
                }
            }
        }
    }

    /// Lays the half-spaces of a block.
    pub(in crate::live) fn lay(
        &mut self,
        model: &Model,
        patches: &[PatchWork],
        chunks: &[ContactChunk],
        block: Block,
    ) {
        if self.near.pairs.is_empty() {
            return;
        }
        self.predict(model, patches, chunks, block);
        let settings = &model.config.contact.pairs;
        for share in settings.smoothing {
            self.smoothing
                .apply(model.config.par, &mut self.all.velocity, share);
        }
        let (par, near, driven) = (model.config.par, &self.near, &self.driven);
        let all = &self.all;
        par::map_into(par, near.pairs.len(), 1024, &mut self.middles, |k| {
            let motion = |v: usize| (all.x[v], all.velocity[v], driven[v]);
            middle(&near.pairs[k], settings.driven_weight, motion)
        });
        let (slots, by_slot, middles) = (&self.slots, &self.by_slot, &self.middles);
        par::map_into(par, slots.len(), 512, &mut self.half_spaces, |s| {
            let of = by_slot
                .row(s)
                .iter()
                .map(|k| (&near.pairs[*k as usize], &middles[*k as usize]));
            half_space(
                &slots[s],
                &all.x[slots[s].vertex as usize],
                of,
                (block, settings.gap),
            )
        });
    }

    /// Contact planes of a patch in the last laid block.
    pub(in crate::live) fn planes(
        &self,
        model: &Model,
        garment: usize,
        patch: usize,
        p: &mut PatchWork,
    ) {
        p.cloth_planes.clear();
        if self.slots.is_empty() {
            return;
        }
        let f = &model.garments[garment].patches[patch];
        for (i, v) in f.vertices.iter().enumerate() {
            // Contradicting planes would tear cloth: overstretched vertices hang on their neighbours.
            if p.pinned[i] || p.overstretched[i] {
                continue;
            }
            let own = &self.of_vertex[self.all.number_of(garment, *v)];
            for s in own.iter().take_while(|s| **s != NONE).map(|s| *s as usize) {
                let (slot, half) = (&self.slots[s], &self.half_spaces[s]);
                // Held between the skin and another garment, taut cloth would tear too.
                if slot.is_layer && p.taut[i] {
                    continue;
                }
                p.cloth_planes.push(ContactPlane {
                    vertex: i as u32,
                    normal: v4(&slot.normal),
                    offset: half.offset,
                    velocity: v4(&half.velocity),
                    friction: model.config.contact.pairs.friction,
                });
            }
        }
    }
}

/// The slot of a vertex with a like direction, a new one, or without a free one that with the nearest direction.
fn join(
    own: &mut [u32; DIRECTIONS],
    slots: &mut Vec<PlaneSlot>,
    new: PlaneSlot,
    alike: f32,
) -> u32 {
    let mut best = (f32::NEG_INFINITY, NONE);
    for s in own {
        if *s == NONE {
            *s = slots.len() as u32;
            slots.push(new);
            return *s;
        }
        let slot = &slots[*s as usize];
        let cosine = slot.normal.dot(&new.normal);
        if cosine > alike && slot.is_layer == new.is_layer {
            return *s;
        }
        if cosine > best.0 || best.1 == NONE {
            best = (cosine, *s);
        }
    }
    best.1
}

/// The middle of a pair, from position, velocity and whether the body moves it of each vertex.
fn middle(p: &NearPair, driven_weight: f32, motion: impl Fn(usize) -> (P3, V3, bool)) -> Middle {
    let mut bounds = [f32::NEG_INFINITY; 2];
    let mut sums = [V3::zeros(); 2];
    let mut weights = [1.0f32; 2];
    for (i, v) in p.vertices.iter().enumerate() {
        let (x, velocity, is_driven) = motion(*v as usize);
        let side = usize::from(i >= p.below);
        bounds[side] = bounds[side].max(-p.outward(i).dot(&x.coords));
        sums[side] += velocity;
        if is_driven {
            weights[side] = driven_weight;
        }
    }
    let [below, above] = weights.map(|w| w / (weights[0] + weights[1]));
    let counts = [p.below, 4 - p.below].map(|n| n as f32);
    Middle {
        height: 0.5 * (bounds[0] - bounds[1]),
        velocity: sums[0] * (below / counts[0]) + sums[1] * (above / counts[1]),
    }
}

/// The narrowest half-space of the pairs of a slot whose vertex is at `x`. It never lies above the vertex.
fn half_space<'a>(
    slot: &PlaneSlot,
    x: &P3,
    pairs: impl Iterator<Item = (&'a NearPair, &'a Middle)>,
    (block, gap): (Block, f32),
) -> HalfSpace {
    let (mut narrowest, mut room, mut velocity) = (f32::NEG_INFINITY, 0.0, V3::zeros());
    for (p, m) in pairs {
        let is_below = p.vertices[..p.below].contains(&slot.vertex);
        let side = if is_below { -1.0 } else { 1.0 };
        let above = side * (p.normal.dot(&x.coords) - m.height) - 0.5 * gap;
        let above = above.max(0.0);
        let at_end = slot.normal.dot(&m.velocity) * block.span - above;
        if at_end > narrowest {
            (narrowest, room, velocity) = (at_end, above, m.velocity);
        }
    }
    let n = &slot.normal;
    HalfSpace {
        offset: n.dot(&x.coords) - room - n.dot(&velocity) * block.t,
        velocity,
    }
}

/// Vertices whose velocities are smoothed: those of the pairs and the rings around them that smoothing reaches.
#[derive(Debug, Default)]
struct Smoothing {
    vertices: Vec<u32>,
    /// End of the neighbours of each.
    ends: Vec<u32>,
    neighbours: Vec<u32>,
    is_in: Vec<bool>,
    smoothed: Vec<V3>,
}

impl Smoothing {
    fn surround(&mut self, model: &Model, all: &OutfitVertices, pairs: &[NearPair]) {
        self.is_in.clear();
        self.is_in.resize(all.len(), false);
        self.vertices.clear();
        for v in pairs.iter().flat_map(|p| p.vertices) {
            if !std::mem::replace(&mut self.is_in[v as usize], true) {
                self.vertices.push(v);
            }
        }
        let mut ring = 0..self.vertices.len();
        for _ in 1..model.config.contact.pairs.smoothing.len() {
            for k in ring.clone() {
                for w in all.neighbours(model, self.vertices[k]) {
                    if !std::mem::replace(&mut self.is_in[w as usize], true) {
                        self.vertices.push(w);
                    }
                }
            }
            ring = ring.end..self.vertices.len();
        }
        self.vertices.sort_unstable();
        self.ends.clear();
        self.neighbours.clear();
        for v in &self.vertices {
            self.neighbours.extend(all.neighbours(model, *v));
            self.ends.push(self.neighbours.len() as u32);
        }
    }

    /// Moves velocities towards the means with their neighbours by a share.
    fn apply(&mut self, par: Par, velocity: &mut [V3], share: f32) {
        let (vertices, ends, neighbours) = (&self.vertices, &self.ends, &self.neighbours);
        let from = &*velocity;
        par::map_into(par, vertices.len(), 1024, &mut self.smoothed, |k| {
            let own = from[vertices[k] as usize];
            let first = k.checked_sub(1).map_or(0, |k| ends[k]);
            let around = &neighbours[first as usize..ends[k] as usize];
            let sum = around.iter().fold(own, |s, w| s + from[*w as usize]);
            own + (sum / (1 + around.len()) as f32 - own) * share
        });
        for (v, u) in vertices.iter().zip(&self.smoothed) {
            velocity[*v as usize] = *u;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{live_run, parse};
    use rand::{Rng, SeedableRng};
    use std::fmt::Write as _;
    use std::path::Path;
    use tryon_geometry::spatial::closest_on_triangle;

    fn settings() -> NearPairSettings {
        NearPairSettings::default()
    }

    const BLOCK: Block = Block {
        t: 0.0,
        span: 0.004,
    };

    /// A vertex `height` metres below a face in the plane z = 0, and the half-spaces of both.
    fn approach(
        height: f32,
        velocity: f32,
        driven: Option<usize>,
    ) -> (Vec<P3>, [HalfSpace; 4], V3) {
        let x: Vec<P3> = [
            [0.2, 0.2, -height],
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
        ]
        .map(P3::from)
        .into();
        let u = [V3::z() * velocity, V3::zeros(), V3::zeros(), V3::zeros()];
        let pair = NearPair {
            vertices: [0, 1, 2, 3],
            below: 1,
            normal: V3::z(),
        };
        let m = middle(&pair, settings().driven_weight, |v| {
            (x[v], u[v], driven == Some(v))
        });
        let half_spaces = std::array::from_fn(|i| {
            let slot = PlaneSlot {
                vertex: i as u32,
                normal: pair.outward(i),
                is_layer: false,
            };
            half_space(
                &slot,
                &x[i],
                [(&pair, &m)].into_iter(),
                (BLOCK, settings().gap),
            )
        });
        (x, half_spaces, m.velocity)
    }

    /// A sheet of 16 by 8 cells of 2 cm as its folds of four cells, 6 mm apart and uneven, lie on each other.
    fn folded() -> (Model, State) {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(7);
        let (mut flat, mut at) = (String::new(), Vec::new());
        for (i, j) in (0..=16u8).flat_map(|i| (0..=8u8).map(move |j| (i, j))) {
            let [x, z] = [i, j].map(|k| 0.02 * f32::from(k));
            writeln!(flat, "v {x} 0 {z}").expect("a string");
            let (fold, along) = (i / 4, 0.02 * f32::from(i % 4));
            let x = if fold % 2 == 0 { along } else { 0.08 - along };
            let y = 0.006 * f32::from(fold) + rng.random_range(-0.001..0.001);
            at.push(P3::new(x + rng.random_range(-0.003..0.003), y, z));
        }
        for (i, j) in (0..16).flat_map(|i| (0..8).map(move |j| (i, j))) {
            let [a, b] = [i, i + 1].map(|i| i * 9 + j + 1);
            writeln!(flat, "f {a} {} {b}\nf {} {} {b}", a + 1, a + 1, b + 1).expect("a string");
        }
        let scene = serde_json::json!({
            "mesh_obj": flat, "colliders": [], "gravity": [0.0, 0.0, 0.0], "duration_s": 0.1, "output_fps": 60.0,
            "material": {
                "area_density_kg_m2": 0.2, "thickness_m": 5e-4, "young_membrane_N_m": 300.0, "poisson": 0.3,
                "bending_rigidity_N_m": 1e-5, "friction": 0.3,
            },
        });
        let scene = parse(&scene.to_string(), Path::new("folds"), None).expect("a scene");
        let (model, mut state) = live_run::outfit(&scene);
        state.garments[0].positions = at;
        (model, state)
    }

    #[test]
    fn of_folded_cloth_every_vertex_and_face_within_reach_are_a_pair() {
        let (model, state) = folded();
        let mut patches = Vec::new();
        crate::live::patch::begin(&model, &state, &mut patches);
        let mut contacts = PairContacts::default();
        contacts.begin(&model, &state, &patches, 1.0 / 30.0);
        contacts.query(&model, &patches, 1.0 / 120.0);

        let g = &model.garments[0].topology;
        let x = &state.garments[0].positions;
        let reach = settings().reach_edges * g.edge();
        let mut expected = 0;
        for v in 0..x.len() as u32 {
            let around = g.within_two_rings(v);
            let others = g.surface.faces().iter();
            for f in others.filter(|f| !f.iter().any(|c| *c == v || around.contains(c))) {
                let corners = f.map(|c| x[c as usize]);
                let at = &x[v as usize];
                let w = closest_on_triangle(at, corners);
                let offset = corners
                    .iter()
                    .zip(w)
                    .fold(-at.coords, |sum, (c, w)| sum + c.coords * w);
                let is_inside = w.iter().all(|w| *w > 1e-3);
                if is_inside && offset.norm() < 0.999 * reach {
                    let vertices = [v, f[0], f[1], f[2]];
                    let pair = |n: &NearPair| n.below == 1 && n.vertices == vertices;
                    assert!(
                        contacts.near.pairs.iter().any(pair),
                        "vertex {v}, face {f:?}"
                    );
                    expected += 1;
                }
            }
        }
        assert!(expected > 100, "{expected}: nothing would be tested");
    }

    #[test]
    fn half_spaces_of_both_sides_leave_a_gap_and_move_together() {
        let (_, half_spaces, velocity) = approach(0.004, 1.0, None);
        assert_eq!(velocity, V3::z() * 0.5, "the mean of both sides");
        let highest = -half_spaces[0].offset;
        for face in &half_spaces[1..] {
            assert!(
                (face.offset - highest - settings().gap).abs() < 1e-7,
                "{} {highest}",
                face.offset
            );
            assert_eq!(face.velocity, velocity);
        }
        assert!(
            (highest + 0.5 * (0.004 + settings().gap)).abs() < 1e-7,
            "half-way"
        );
    }

    #[test]
    fn half_spaces_follow_the_side_that_the_body_moves() {
        let (.., velocity) = approach(0.004, 1.0, Some(0));
        let weight = settings().driven_weight;
        let share = weight / (weight + 1.0);
        assert!((velocity - V3::z() * share).norm() < 1e-6, "{velocity}");
        let (.., velocity) = approach(0.004, 1.0, Some(3));
        assert!(
            (velocity - V3::z() * (1.0 - share)).norm() < 1e-6,
            "{velocity}"
        );
    }

    #[test]
    fn nearer_than_the_gap_no_half_space_lies_beyond_its_vertex() {
        let (x, half_spaces, _) = approach(0.5 * settings().gap, 0.0, None);
        assert!((half_spaces[0].offset + x[0].z).abs() < 1e-9);
        assert!(half_spaces[1..].iter().all(|h| h.offset.abs() < 1e-9));
    }

    #[test]
    fn like_directions_share_a_slot_and_the_rest_joins_the_nearest() {
        let (mut own, mut slots) = ([NONE; DIRECTIONS], Vec::new());
        let turned = |k: f32| PlaneSlot {
            vertex: 0,
            normal: V3::new(k.cos(), k.sin(), 0.0),
            is_layer: false,
        };
        assert_eq!(join(&mut own, &mut slots, turned(0.0), 0.9), 0);
        assert_eq!(join(&mut own, &mut slots, turned(0.3), 0.9), 0);
        for k in 1..DIRECTIONS {
            assert_eq!(
                join(&mut own, &mut slots, turned(0.7 * k as f32), 0.9),
                k as u32
            );
        }
        let up = PlaneSlot {
            vertex: 0,
            normal: V3::new(0.8, 0.0, 0.6),
            is_layer: false,
        };
        assert_eq!(join(&mut own, &mut slots, up, 0.9), 0);
        assert_eq!(slots.len(), DIRECTIONS);

        let (mut own, mut slots) = ([NONE; DIRECTIONS], Vec::new());
        join(&mut own, &mut slots, turned(0.0), 0.9);
        let layer = PlaneSlot {
            is_layer: true,
            ..turned(0.0)
        };
        assert_eq!(join(&mut own, &mut slots, layer, 0.9), 1, "another garment");
        assert_eq!(join(&mut own, &mut slots, layer, 0.9), 1);
    }

    /// Of a mode whose distance from its neighbours' mean is `k` times itself this much is left.
    #[test]
    fn smoothing_amplifies_no_mode_and_equals_eleven_means_of_long_waves() {
        let left = |k: f64| {
            let steps = settings()
                .smoothing
                .into_iter()
                .map(|s| 1.0 - f64::from(s) * k);
            steps.product::<f64>()
        };
        assert!((0..=150).all(|k| left(f64::from(k) * 0.01).abs() <= 1.0));
        let means = -(left(1e-6) - 1.0) / 1e-6;
        assert!((means - 11.3).abs() < 0.1, "{means}");
        assert!((10..=150).all(|k| left(f64::from(k) * 0.01).abs() < 0.33));
    }
}
