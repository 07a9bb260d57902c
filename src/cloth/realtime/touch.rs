//! Which planes of the body keep a vertex outside, and where anchors go.

use super::model::Model;
use super::piled::Piled;
use super::state::{GarmentState, PatchScratch};
use crate::cloth::small_steps::{Fabric, Plane, Tie, V4};
use crate::contact::{Buried, Closest, DepthMaps, NearSkin, SurfaceFrame};
use crate::garment::Region;
use crate::math::{P3, V3};

/// Surfaces further than this from a vertex are not looked at in a round, metres.
const REACH: f32 = 0.04;
/// Cloth that ends a call under the skin is put this far above it, metres: less than a fabric's thickness.
const LIFTED: f32 = 5e-4;
/// Deeper in another part of the body cloth is left where it is, metres: it may have come from the other side.
const OTHER_DEPTH: f32 = 0.01;
/// Cloth longer than this, over its rest length, is about to tear: more than knitwear is worn at.
const TORN: f32 = 1.5;
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

fn p3(v: V4) -> P3 {
    P3::new(v.0[0], v.0[1], v.0[2])
}

fn v4(v: &V3) -> V4 {
    V4::new(v.x, v.y, v.z)
}

impl Touch<'_> {
    /// Planes of a patch for this round.
    pub(super) fn find(&self, garment: usize, f: &Fabric, maps: Option<&DepthMaps>, p: &mut PatchScratch) {
        let g = &self.model.garments[garment];
        let offset = g.offset as f32;
        let highest = self.piled.most(garment, offset);
        let reach = self.model.config.reach as f32;
        // Planes that contradict each other would tear cloth apart: it gives way, and hangs on its neighbours.
        p.motion.overstretched(f, TORN, &mut p.free);
        p.torn.clear();
        p.torn.resize(f.vertices.len(), false);
        for (i, &v) in f.vertices.iter().enumerate() {
            if p.tied[i] {
                continue;
            }
            if p.free[i] {
                p.torn[i] = true;
                continue;
            }
            let masks = [g.own[v as usize], g.other[v as usize]];
            let x = p3(p.motion.position(i));
            let speed = p.motion.velocity[i].dot(p.motion.velocity[i]).sqrt();
            let travel = (speed + self.fastest) * self.span;
            let mut found: [Option<Closest>; 2] = [None, None];
            if let Some(maps) = maps {
                self.propose(maps, &x, masks, &mut p.nearest[i]);
                self.ask_neighbour(garment, v, &x, &mut p.nearest[i]);
            }
            for k in 0..2 {
                if masks[k] == 0 {
                    continue;
                }
                if p.clear[i][k] > travel {
                    p.clear[i][k] -= travel;
                    p.report.searches_skipped += 1;
                    continue;
                }
                let surface = &self.model.surface;
                let wanted = (highest + reach + travel).min(REACH);
                let around = g.folds.surface.neighbours(v).iter();
                let told = around.map(|w| self.nearest[garment].nearest[*w as usize][k]);
                let (near, c) = surface.closest_unless_astray(self.now, &x, p.nearest[i][k], masks[k], wanted, told);
                p.nearest[i][k] = near;
                match c {
                    Err(room) => p.clear[i][k] = room + wanted - highest - reach,
                    Ok(mut c) => {
                        p.clear[i][k] = if c.rim { 0.0 } else { c.signed - highest - reach };
                        if c.rim && k == 0 {
                            // Beyond the own parts: whatever is nearest.
                            c = surface.closest(self.now, &x, near, Region::ALL.0);
                        }
                        let hidden = self.buried.holds_nothing(surface.faces()[c.face as usize]);
                        p.free[i] |= hidden && !c.rim && c.signed < offset;
                        if !hidden && !c.rim && c.signed < wanted {
                            found[k] = Some(c);
                        }
                    }
                }
            }
            let mut offsets = [offset; 2];
            if let Some(own) = &found[0] {
                offsets[0] = self.piled.over(garment, self.model.surface.faces()[own.face as usize], offset);
            }
            if let [Some(own), Some(other)] = &found {
                // Between skins that face each other cloth stays on its own half, so that two layers pass each other
                // nowhere; where the body lies in itself nothing holds it: it hangs on its neighbours, out of sight.
                if let Some(room) = own.room(other).filter(|room| *room < HALVED) {
                    p.report.pinched += usize::from(room < 2.0 * offset);
                    if room < 0.0 {
                        p.free[i] = true;
                        found = [None, None];
                    }
                    let half = 0.5 * room.max(0.0);
                    let gap = HALF_GAP.min(0.5 * half);
                    offsets = [offset.min(half - gap), half + gap];
                }
            }
            for (c, offset) in found.iter().zip(offsets).rev().filter_map(|(c, o)| c.map(|c| (c, o))) {
                let corners = self.model.surface.faces()[c.face as usize];
                let speed = (0..3).fold(V3::zeros(), |s, j| {
                    let v = corners[j] as usize;
                    s + (self.after[v] - self.before[v]) * (c.weights[j] / self.dt)
                });
                p.planes.push(Plane {
                    vertex: i as u32,
                    normal: v4(&c.normal),
                    level: c.normal.dot(&c.point.coords) + offset,
                    speed: v4(&speed),
                    friction: g.sheet.friction as f32,
                });
            }
        }
    }

    /// A walk may end on a finger that is not the nearest one, where no map sees the gap. Cloth beside it knows better.
    fn ask_neighbour(&self, garment: usize, v: u32, x: &P3, near: &mut [u32; 2]) {
        let around = self.model.garments[garment].folds.surface.neighbours(v);
        let Some(&w) = around.get(self.turn as usize % around.len().max(1)) else { return };
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
pub(super) fn anchors(model: &Model, garment: usize, patch: usize, touch: &Touch<'_>, p: &mut PatchScratch) {
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
        let firmness =
            if a.strength >= 1.0 { 1.0 } else { 1.0 - (-g.h * ANCHOR_RATE * a.strength / (1.0 - a.strength)).exp() };
        p.tied[local as usize] = a.strength >= 1.0;
        p.ties.push(Tie {
            vertex: local,
            place: v4(&start.coords),
            speed: v4(&((end - start) / touch.span)),
            firmness: firmness as f32,
        });
    }
}

fn place(a: &super::AnchorBinding, body: &[P3]) -> P3 {
    above(a, a.body.map(|v| body[v as usize]))
}

fn above(a: &super::AnchorBinding, [p, q, r]: [P3; 3]) -> P3 {
    let on = p.coords * a.weights[0] + q.coords * a.weights[1] + r.coords * a.weights[2];
    let normal = (q - p).cross(&(r - p)).try_normalize(0.0).unwrap_or_else(V3::zeros);
    P3::from(on + normal * a.height)
}

/// The body at the end of a call.
pub(super) struct Settled<'a> {
    pub(super) skin: &'a SurfaceFrame,
    pub(super) near: &'a NearSkin,
    pub(super) buried: &'a Buried,
}

/// Measures how deep cloth is under the skin, and lifts what is.
pub(super) fn settle(model: &Model, garment: usize, patch: usize, body: &Settled<'_>, p: &mut PatchScratch) {
    let g = &model.garments[garment];
    let f = &g.patches[patch];
    let mut planes = p.planes[..p.body_planes].iter().map(|plane| plane.vertex as usize).peekable();
    for i in 0..f.owned {
        let mut held = p.torn[i];
        while planes.next_if(|v| *v == i).is_some() {
            held = true;
        }
        // What was far from all skin when that was looked for may be under it now: drawn cloth snaps back by 2 cm in a
        // round, and the nearest skin may have been the other leg's.
        if !held && (p.tied[i] || p.clear[i][0] <= 0.0) {
            continue;
        }
        let v = f.vertices[i] as usize;
        let masks = [g.own[v], g.other[v]];
        let surface = &model.surface;
        let mut near = body.near.around(surface, body.skin, &p3(p.motion.position(i)), masks);
        // What is above the skin around it needs no walk.
        let under = near[0].under() || held && (near[1].under() || !near[0].seen());
        if !under {
            continue;
        }
        // The own parts have the last word.
        for side in [1, 0].into_iter().filter(|s| masks[*s] != 0) {
            let x = p3(p.motion.position(i));
            // Skin of other parts is far from most cloth.
            let reach = if side == 1 { OTHER_DEPTH } else { f32::MAX };
            let (vertex, walked) = surface.closest_within(body.skin, &x, p.nearest[i][side], masks[side], reach);
            let found = near[side].or_nearer(surface, body.skin, &x, walked.ok(), masks[side]);
            p.nearest[i][side] = found.map_or(vertex, |c| c.vertex);
            let Some(c) = found else { continue };
            let elsewhere = side == 1 && c.signed < -OTHER_DEPTH;
            let nothing = body.buried.holds_nothing(surface.faces()[c.face as usize]);
            if c.rim || c.signed >= LIFTED || elsewhere || nothing {
                continue;
            }
            p.report.penetration = p.report.penetration.max(f64::from(-c.signed));
            p.motion.moved[i] = v4(&(c.point + c.normal * LIFTED - p3(p.motion.start[i])));
            let lifted = p3(p.motion.position(i));
            let again = surface.closest(body.skin, &lifted, c.vertex, masks[side]);
            p.report.penetration_left = p.report.penetration_left.max(f64::from(-again.signed));
            near = body.near.around(surface, body.skin, &lifted, masks);
        }
    }
}
