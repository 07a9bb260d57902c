//! Which planes of the body keep a vertex outside, and where anchors go.

use super::model::Model;
use super::piece::Piece;
use super::piled::Piled;
use super::state::{GarmentState, PatchScratch};
use crate::cloth::solver::explicit::{ContactPlane, Pin, V4};
use crate::contact::{Buried, Closest, DepthMaps, NearSkin, SurfaceFrame};
use crate::garment::Region;
use crate::math::{P3, V3};

/// Surfaces further than this from a vertex are not looked at in a round, metres.
const REACH: f32 = 0.04;
/// Cloth that ends a call under the skin is put this far above it, metres: less than a fabric's thickness.
const LIFTED: f32 = 5e-4;
/// Deeper in another part of the body cloth is left where it is, metres: it may have come from the other side.
const OTHER_DEPTH: f32 = 0.01;
/// Between skins with less room than this cloth stays on its own half, metres, and so far from the middle.
const HALVED: f32 = 0.03;
const HALF_GAP: f32 = 0.00125;
/// Anchors of strength ½ go to their place at this rate, 1/s.
const ANCHOR_RATE: f64 = 120.0;

/// The body during one round.
pub(super) struct Touch<'a> {
    pub(super) model: &'a Model,
    pub(super) buried: &'a Buried,
    pub(super) now: &'a SurfaceFrame,
    pub(super) before: &'a [P3],
    pub(super) after: &'a [P3],
    /// Time from `before` to `after`, s.
    pub(super) dt: f32,
    /// Fastest body vertex, m/s.
    pub(super) fastest: f32,
    /// Length of the round, s.
    pub(super) span: f32,
    /// Calls so far.
    pub(super) turn: u64,
    /// What lies on the skin at the beginning of the call.
    pub(super) piled: &'a Piled,
    /// Nearest body vertices of each garment's vertices at the beginning of the call.
    pub(super) nearest: &'a [GarmentState],
}

fn v4(v: &V3) -> V4 {
    V4::new(v.x, v.y, v.z)
}

impl Touch<'_> {
    /// Planes of the body for a piece of a patch in this round.
    pub(super) fn find(&self, maps: Option<&DepthMaps>, p: &PatchScratch, q: &mut Piece) {
        let (garment, (g, f)) = (q.garment, q.model(self.model));
        let offset = g.offset as f32;
        let highest = self.piled.most(garment, offset);
        let reach = self.model.config.reach as f32;
        if !self.model.config.skip_far {
            q.clear.fill([0.0; 2]);
        }
        q.body.clear();
        for (j, i) in q.range.clone().enumerate() {
            // Planes that contradict each other would tear cloth apart: it gives way, and hangs on its neighbours.
            q.free[j] = p.torn[i];
            if p.tied[i] || p.torn[i] {
                continue;
            }
            let v = f.vertices[i];
            let masks = [g.own[v as usize], g.other[v as usize]];
            let x = p.place(i);
            let speed = p.motion.velocity[i].dot(p.motion.velocity[i]).sqrt();
            let travel = (speed + self.fastest) * self.span;
            let mut found: [Option<Closest>; 2] = [None, None];
            if let Some(maps) = maps {
                self.propose(maps, &x, masks, &mut q.nearest[j]);
                self.ask_neighbour(garment, v, &x, &mut q.nearest[j]);
            }
            for k in 0..2 {
                if masks[k] == 0 {
                    continue;
                }
                if q.clear[j][k] > travel {
                    q.clear[j][k] -= travel;
                    q.report.searches_skipped += 1;
                    continue;
                }
                let surface = &self.model.surface;
                let wanted = (highest + reach + travel).min(REACH);
                let around = g.folds.surface.neighbours(v).iter();
                let told = around.map(|w| self.nearest[garment].nearest[*w as usize][k]);
                let (near, c) = surface.closest_unless_astray(
                    self.now,
                    &x,
                    q.nearest[j][k],
                    masks[k],
                    wanted,
                    told,
                );
                q.nearest[j][k] = near;
                match c {
                    Err(room) => q.clear[j][k] = room + wanted - highest - reach,
                    Ok(mut c) => {
                        q.clear[j][k] = if c.rim {
                            0.0
                        } else {
                            c.signed - highest - reach
                        };
                        if c.rim && k == 0 {
                            // Beyond the own parts: whatever is nearest.
                            c = surface.closest(self.now, &x, near, Region::ALL.0);
                        }
                        let hidden = self.buried.holds_nothing(surface.faces()[c.face as usize]);
                        q.free[j] |= hidden && !c.rim && c.signed < offset;
                        if !hidden && !c.rim && c.signed < wanted {
                            found[k] = Some(c);
                        }
                    }
                }
            }
            let mut offsets = [offset; 2];
            if let Some(own) = &found[0] {
                offsets[0] = self.piled.over(
                    garment,
                    self.model.surface.faces()[own.face as usize],
                    offset,
                );
            }
            if let [Some(own), Some(other)] = &found {
                // Between skins that face each other cloth stays on its own half, so that two layers pass each other
                // nowhere; where the body lies in itself nothing holds it: it hangs on its neighbours, out of sight.
                if let Some(room) = own.room(other).filter(|room| *room < HALVED) {
                    q.report.pinched += usize::from(room < 2.0 * offset);
                    if room < 0.0 {
                        q.free[j] = true;
                        found = [None, None];
                    }
                    let half = 0.5 * room.max(0.0);
                    let gap = HALF_GAP.min(0.5 * half);
                    offsets = [offset.min(half - gap), half + gap];
                }
            }
            for (c, offset) in found
                .iter()
                .zip(offsets)
                .rev()
                .filter_map(|(c, o)| c.map(|c| (c, o)))
            {
                let corners = self.model.surface.faces()[c.face as usize];
                let speed = (0..3).fold(V3::zeros(), |s, k| {
                    let v = corners[k] as usize;
                    s + (self.after[v] - self.before[v]) * (c.weights[k] / self.dt)
                });
                q.body.push(ContactPlane {
                    vertex: i as u32,
                    normal: v4(&c.normal),
                    offset: c.normal.dot(&c.point.coords) + offset,
                    velocity: v4(&speed),
                    friction: g.sheet.friction as f32,
                });
            }
        }
    }

    /// A walk may end on a finger that is not the nearest one, where no map sees the gap. Cloth beside it knows better.
    fn ask_neighbour(&self, garment: usize, v: u32, x: &P3, near: &mut [u32; 2]) {
        let around = self.model.garments[garment].folds.surface.neighbours(v);
        let Some(&w) = around.get(self.turn as usize % around.len().max(1)) else {
            return;
        };
        for (k, &told) in self.nearest[garment].nearest[w as usize].iter().enumerate() {
            let far = |b: u32| (self.now.vertices[b as usize] - x).norm_squared();
            if told != near[k] && far(told) < far(near[k]) {
                near[k] = told;
            }
        }
    }

    /// Better starting points for the walks, from the depth maps.
    fn propose(&self, maps: &DepthMaps, x: &P3, masks: [u8; 2], near: &mut [u32; 2]) {
        let surface = &self.model.surface;
        let mut best = near.map(|v| (self.now.vertices[v as usize] - x).norm_squared());
        for face in maps.proposals(x) {
            let v = surface.faces()[face as usize][0];
            let d = (self.now.vertices[v as usize] - x).norm_squared();
            for k in 0..2 {
                if d < best[k] && surface.part(v) & masks[k] != 0 {
                    best[k] = d;
                    near[k] = v;
                }
            }
        }
    }
}

/// Where a patch's anchors go during a round.
pub(super) fn anchors(
    model: &Model,
    garment: usize,
    patch: usize,
    touch: &Touch<'_>,
    p: &mut PatchScratch,
) {
    p.ties.clear();
    p.tied.clear();
    let g = &model.garments[garment];
    // Cloth that sleeps is held by nothing else either.
    p.tied.extend_from_slice(&p.asleep);
    for (local, a) in model.anchors_of(garment, patch) {
        if a.strength <= 0.0 || p.asleep[local as usize] {
            continue;
        }
        let start = place(a, &touch.now.vertices);
        let moving = a.body.map(|v| {
            let v = v as usize;
            touch.now.vertices[v] + (touch.after[v] - touch.before[v]) * (touch.span / touch.dt)
        });
        let end = above(a, moving);
        let stiffness = if a.strength >= 1.0 {
            1.0
        } else {
            1.0 - (-g.h * ANCHOR_RATE * a.strength / (1.0 - a.strength)).exp()
        };
        p.tied[local as usize] = a.strength >= 1.0;
        p.ties.push(Pin {
            vertex: local,
            target: v4(&start.coords),
            velocity: v4(&((end - start) / touch.span)),
            stiffness: stiffness as f32,
        });
    }
}

fn place(a: &super::AnchorBinding, body: &[P3]) -> P3 {
    above(a, a.body.map(|v| body[v as usize]))
}

fn above(a: &super::AnchorBinding, [p, q, r]: [P3; 3]) -> P3 {
    let on = p.coords * a.weights[0] + q.coords * a.weights[1] + r.coords * a.weights[2];
    let normal = (q - p)
        .cross(&(r - p))
        .try_normalize(0.0)
        .unwrap_or_else(V3::zeros);
    P3::from(on + normal * a.height)
}

/// The body at the end of a call.
pub(super) struct Settled<'a> {
    pub(super) skin: &'a SurfaceFrame,
    pub(super) near: &'a NearSkin,
    pub(super) buried: &'a Buried,
}

/// Measures how deep cloth is under the skin, and lifts what is.
pub(super) fn settle(model: &Model, body: &Settled<'_>, p: &PatchScratch, q: &mut Piece) {
    let (g, f) = q.model(model);
    q.lifted.clear();
    let mut planes = q.body.iter().map(|plane| plane.vertex as usize).peekable();
    for (j, i) in q.owned(f) {
        if p.tied[i] {
            continue;
        }
        let mut held = p.torn[i];
        while planes.next_if(|v| *v == i).is_some() {
            held = true;
        }
        // What was far from all skin when that was looked for may be under it now: drawn cloth snaps back by 2 cm in a
        // round, and the nearest skin may have been the other leg's.
        if !held && q.clear[j][0] <= 0.0 {
            continue;
        }
        let v = f.vertices[i] as usize;
        let masks = [g.own[v], g.other[v]];
        let surface = &model.surface;
        let mut x = p.place(i);
        let mut near = body.near.around(surface, body.skin, &x, masks);
        // What is above the skin around it needs no walk.
        let under = near[0].under() || held && (near[1].under() || !near[0].seen());
        if !under {
            continue;
        }
        // The own parts have the last word.
        for side in [1, 0].into_iter().filter(|s| masks[*s] != 0) {
            // Skin of other parts is far from most cloth.
            let reach = if side == 1 { OTHER_DEPTH } else { f32::MAX };
            let (vertex, walked) =
                surface.closest_within(body.skin, &x, q.nearest[j][side], masks[side], reach);
            let found = near[side].or_nearer(surface, body.skin, &x, walked.ok(), masks[side]);
            q.nearest[j][side] = found.map_or(vertex, |c| c.vertex);
            let Some(c) = found else { continue };
            let elsewhere = side == 1 && c.signed < -OTHER_DEPTH;
            let nothing = body.buried.holds_nothing(surface.faces()[c.face as usize]);
            if c.rim || c.signed >= LIFTED || elsewhere || nothing {
                continue;
            }
            q.report.penetration = q.report.penetration.max(f64::from(-c.signed));
            let moved = v4(&(c.point + c.normal * LIFTED - p.motion.start[i].point()));
            q.lifted.push((i as u32, moved));
            x = (p.motion.start[i] + moved).point();
            let again = surface.closest(body.skin, &x, c.vertex, masks[side]);
            q.report.penetration_left = q.report.penetration_left.max(f64::from(-again.signed));
            near = body.near.around(surface, body.skin, &x, masks);
        }
    }
}
