//! Contact of cloth with cloth: half-spaces between near pairs of features, laid anew in each block of substeps.
//!
//! A pair is a vertex and a face or two edges, of two garments or of one; its direction is that of the closest points at the
//! query. In each block the gap between both sides along it is divided, and both halves become half-spaces that move at the
//! pair's mean velocity, or with the side that the body moves ("divide and truncate", Chen et al. 2025, along one
//! direction): sliding stays free. Of the pairs of one vertex with like directions the narrowest counts, so a vertex has one
//! half-space for each sheet beside it.

use super::chunk::ContactChunk;
use super::near_pairs::{NearPair, NearPairs};
use crate::cloth::outfit_model::Model;
use crate::cloth::patch::{PatchWork, v4};
use crate::cloth::solver::explicit::ContactPlane;
use crate::cloth::state::State;
use crate::math::{P3, V3};
use crate::mesh::Csr;
use crate::par;

/// Longest block, s. With 8.3 ms crossings with the body rise, with 2.8 ms the time by 4 %.
const BLOCK: f64 = 1.0 / 240.0;
/// Distance left between both halves of a gap, metres: with 1 and 2 mm there are more crossings in a dance (decision 071).
const GAP: f32 = 0.0015;
/// Cosine of the angle between like directions. With 0.95 there are more planes and as many crossings.
const ALIKE: f32 = 0.9;
/// Directions of a vertex: more join the nearest one.
const DIRECTIONS: usize = 8;
/// Friction of cloth on cloth: below the measured 0.3, as planes that are renewed resist sliding already.
const FRICTION: f32 = 0.1;
/// Weight of the side that the body moves in the velocity of a pair's half-spaces, the other being 1. With 1 a leg's kick
/// passes through a skirt.
const DRIVEN_WEIGHT: f32 = 20.0;
/// Relaxation of each smoothing of velocities over neighbours: by super time stepping (Alexiades et al. 1996, damping 0.05,
/// largest eigenvalue 1.5) four smooth as far as eleven means. Unsmoothed, a shirt and a skirt shake each other: 10 µm of
/// noise become 16 to 48 mm in a second of walking.
const SMOOTHING: [f32; 4] = [7.738, 1.942, 0.943, 0.692];
const NONE: u32 = u32::MAX;

/// Part of a step between two layings of the planes.
#[derive(Clone, Copy, Debug)]
pub(in crate::cloth) struct Block {
    /// Begin since the query and length, s.
    pub(in crate::cloth) t: f32,
    pub(in crate::cloth) span: f32,
}

impl Block {
    /// Number of equal blocks in an interval of `span` seconds.
    pub(in crate::cloth) fn count(span: f64) -> usize {
        /// Share of a block by which an interval may be longer without another one.
        const SLACK: f64 = 1e-3;
        (span / BLOCK - SLACK).ceil().max(1.0) as usize
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
pub(in crate::cloth) struct PairContacts {
    near: NearPairs,
    /// Positions at the beginning of the last block but one, metres.
    last: Vec<P3>,
    /// Vertices that the body moves in the block.
    driven: Vec<bool>,
    middles: Vec<Middle>,
    slots: Vec<PlaneSlot>,
    /// Slots of each vertex.
    of_vertex: Vec<[u32; DIRECTIONS]>,
    /// PlaneSlot and pair.
    members: Vec<(u32, u32)>,
    by_slot: Csr,
    half_spaces: Vec<HalfSpace>,
}

impl PairContacts {
    /// Finds the near pairs at the beginning of an interval of `span` seconds.
    pub(in crate::cloth) fn query(
        &mut self,
        model: &Model,
        state: &State,
        patches: &[PatchWork],
        span: f32,
    ) {
        self.near.number(model);
        self.near.gather(model, patches, |p, i, _| p.velocity(i));
        self.near.find(model, state, span);
        self.assign();
    }

    /// Number of near pairs.
    pub(in crate::cloth) fn len(&self) -> usize {
        self.near.pairs.len()
    }

    /// Takes over the positions after a block of `span` seconds; velocities are the mean ones of the block.
    pub(in crate::cloth) fn advance(&mut self, model: &Model, patches: &[PatchWork], span: f32) {
        if self.near.pairs.is_empty() {
            return;
        }
        let last = &mut self.last;
        last.clone_from(&self.near.x);
        self.near
            .gather(model, patches, |p, i, v| (p.position(i) - last[v]) / span);
    }

    /// Groups the directions of the pairs by vertex.
    fn assign(&mut self) {
        self.of_vertex.clear();
        self.of_vertex.resize(self.near.x.len(), [NONE; DIRECTIONS]);
        self.slots.clear();
        self.members.clear();
        for (k, p) in self.near.pairs.iter().enumerate() {
            let is_layer = self.near.is_between_garments(p);
            for (i, v) in p.vertices.iter().enumerate() {
                let new = PlaneSlot {
                    vertex: *v,
                    normal: p.outward(i),
                    is_layer,
                };
                let own = &mut self.of_vertex[*v as usize];
                let slot = join(own, &mut self.slots, new);
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
        self.driven.resize(self.near.x.len(), false);
        for c in chunks {
            let f = &model.garments[c.garment].patches[c.patch];
            let motion = &patches[c.at].motion;
            for plane in c
                .body_planes
                .iter()
                .filter(|p| (p.vertex as usize) < f.owned)
            {
                let i = plane.vertex as usize;
                let v = self.near.number_of(c.garment, f.vertices[i]);
                let gap = plane.gap(motion.position(i), block.t).max(0.0);
                let normal = plane.normal.point().coords;
                let lacking = plane.rate() - normal.dot(&self.near.velocity[v]) - gap / block.span;
                if lacking > 0.0 {
                    self.near.velocity[v] += normal * lacking;
                    self.driven[v] = true;
                }
            }
        }
    }

    /// Lays the half-spaces of a block.
    pub(in crate::cloth) fn lay(
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
        for share in SMOOTHING {
            self.near.smooth_velocities(model, share);
        }
        let (par, near, driven) = (model.config.par, &self.near, &self.driven);
        par::map_into(par, near.pairs.len(), 1024, &mut self.middles, |k| {
            let motion = |v: usize| (near.x[v], near.velocity[v], driven[v]);
            middle(&near.pairs[k], motion)
        });
        let (slots, by_slot, middles) = (&self.slots, &self.by_slot, &self.middles);
        par::map_into(par, slots.len(), 512, &mut self.half_spaces, |s| {
            let of = by_slot
                .row(s)
                .iter()
                .map(|k| (&near.pairs[*k as usize], &middles[*k as usize]));
            half_space(&slots[s], &near.x[slots[s].vertex as usize], of, block)
        });
    }

    /// Contact planes of a patch in the last laid block.
    pub(in crate::cloth) fn planes(
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
            let own = &self.of_vertex[self.near.number_of(garment, *v)];
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
                    friction: FRICTION,
                });
            }
        }
    }
}

/// The slot of a vertex with a like direction, a new one, or without a free one that with the nearest direction.
fn join(own: &mut [u32; DIRECTIONS], slots: &mut Vec<PlaneSlot>, new: PlaneSlot) -> u32 {
    let mut best = (f32::NEG_INFINITY, NONE);
    for s in own {
        if *s == NONE {
            *s = slots.len() as u32;
            slots.push(new);
            return *s;
        }
        let slot = &slots[*s as usize];
        let alike = slot.normal.dot(&new.normal);
        if alike > ALIKE && slot.is_layer == new.is_layer {
            return *s;
        }
        if alike > best.0 || best.1 == NONE {
            best = (alike, *s);
        }
    }
    best.1
}

/// The middle of a pair, from position, velocity and whether the body moves it of each vertex.
fn middle(p: &NearPair, motion: impl Fn(usize) -> (P3, V3, bool)) -> Middle {
    let mut bounds = [f32::NEG_INFINITY; 2];
    let mut sums = [V3::zeros(); 2];
    let mut weights = [1.0f32; 2];
    for (i, v) in p.vertices.iter().enumerate() {
        let (x, velocity, is_driven) = motion(*v as usize);
        let side = usize::from(i >= p.below);
        bounds[side] = bounds[side].max(-p.outward(i).dot(&x.coords));
        sums[side] += velocity;
        if is_driven {
            weights[side] = DRIVEN_WEIGHT;
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
    block: Block,
) -> HalfSpace {
    let (mut narrowest, mut room, mut velocity) = (f32::NEG_INFINITY, 0.0, V3::zeros());
    for (p, m) in pairs {
        let is_below = p.vertices[..p.below].contains(&slot.vertex);
        let side = if is_below { -1.0 } else { 1.0 };
        let above = side * (p.normal.dot(&x.coords) - m.height) - 0.5 * GAP;
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

#[cfg(test)]
mod tests {
    use super::*;

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
        let m = middle(&pair, |v| (x[v], u[v], driven == Some(v)));
        let half_spaces = std::array::from_fn(|i| {
            let slot = PlaneSlot {
                vertex: i as u32,
                normal: pair.outward(i),
                is_layer: false,
            };
            half_space(&slot, &x[i], [(&pair, &m)].into_iter(), BLOCK)
        });
        (x, half_spaces, m.velocity)
    }

    #[test]
    fn half_spaces_of_both_sides_leave_a_gap_and_move_together() {
        let (_, half_spaces, velocity) = approach(0.004, 1.0, None);
        assert_eq!(velocity, V3::z() * 0.5, "the mean of both sides");
        let highest = -half_spaces[0].offset;
        for face in &half_spaces[1..] {
            assert!(
                (face.offset - highest - GAP).abs() < 1e-7,
                "{} {highest}",
                face.offset
            );
            assert_eq!(face.velocity, velocity);
        }
        assert!((highest + 0.5 * (0.004 + GAP)).abs() < 1e-7, "half-way");
    }

    #[test]
    fn half_spaces_follow_the_side_that_the_body_moves() {
        let (.., velocity) = approach(0.004, 1.0, Some(0));
        let share = DRIVEN_WEIGHT / (DRIVEN_WEIGHT + 1.0);
        assert!((velocity - V3::z() * share).norm() < 1e-6, "{velocity}");
        let (.., velocity) = approach(0.004, 1.0, Some(3));
        assert!(
            (velocity - V3::z() * (1.0 - share)).norm() < 1e-6,
            "{velocity}"
        );
    }

    #[test]
    fn nearer_than_the_gap_no_half_space_lies_beyond_its_vertex() {
        let (x, half_spaces, _) = approach(0.5 * GAP, 0.0, None);
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
        assert_eq!(join(&mut own, &mut slots, turned(0.0)), 0);
        assert_eq!(join(&mut own, &mut slots, turned(0.3)), 0);
        for k in 1..DIRECTIONS {
            assert_eq!(join(&mut own, &mut slots, turned(0.7 * k as f32)), k as u32);
        }
        let up = PlaneSlot {
            vertex: 0,
            normal: V3::new(0.8, 0.0, 0.6),
            is_layer: false,
        };
        assert_eq!(join(&mut own, &mut slots, up), 0);
        assert_eq!(slots.len(), DIRECTIONS);

        let (mut own, mut slots) = ([NONE; DIRECTIONS], Vec::new());
        join(&mut own, &mut slots, turned(0.0));
        let layer = PlaneSlot {
            is_layer: true,
            ..turned(0.0)
        };
        assert_eq!(join(&mut own, &mut slots, layer), 1, "another garment");
        assert_eq!(join(&mut own, &mut slots, layer), 1);
    }

    /// Of a mode whose distance from its neighbours' mean is `k` times itself this much is left.
    #[test]
    fn smoothing_amplifies_no_mode_and_equals_eleven_means_of_long_waves() {
        let left = |k: f64| {
            let steps = SMOOTHING.iter().map(|s| 1.0 - f64::from(*s) * k);
            steps.product::<f64>()
        };
        assert!((0..=150).all(|k| left(f64::from(k) * 0.01).abs() <= 1.0));
        let means = -(left(1e-6) - 1.0) / 1e-6;
        assert!((means - 11.3).abs() < 0.1, "{means}");
        assert!((10..=150).all(|k| left(f64::from(k) * 0.01).abs() < 0.33));
    }
}
