//! Takes garments out of themselves while they are worn.
//!
//! Planes keep a fold on the side it is on, also where that is the wrong one: a hem that was kicked up through itself stayed
//! up. So each garment is looked at now and then as a whole, and what passes through it goes back a little. Where that does
//! not help for a while, cloth is ironed: drawn flat between what lies around it, and it falls into other folds.

use super::Model;
use super::state::{GarmentState, State};
use crate::cloth::untangle::Untangler;
use crate::contact::SurfaceFrame;
use crate::garment::Region;
use crate::math::{P3, V3d};

/// Rounds that a look takes at most, and how far each moves cloth, metres.
const ROUNDS: usize = 8;
const STEP: f64 = 0.003;
/// Most that they move it together, metres: with 5 mm armpits without room for two layers stretched by 18 %. The rest is
/// left to the next look.
const MOST: f64 = 0.003;
/// Looks in which a vertex crossed, less those in which it did not, from which on it is ironed (docs/benchmarks.md), and what is
/// counted at most, so that what came free is left alone after four more looks.
const STUCK: [u8; 2] = [3, 6];
/// Rings of vertices that are ironed around it, and how far a look moves them at most, metres (docs/benchmarks.md).
const IRONED: (usize, f64) = (2, 0.015);
/// Distance that what was on the wrong side is put at, metres.
const GAP: f64 = 0.001;
/// Nothing is moved nearer to the skin than this, metres: less than a fabric's thickness.
const ABOVE: f64 = 5e-4;
/// Skin further away than this says nothing about where inside is, metres.
const NEAR: f64 = 0.02;

/// Once a body has been still for so long nothing is looked at: what no room has to come apart would never rest, s.
const LAST: f64 = 1.0;

/// Scratch of it.
#[derive(Debug, Default)]
pub(super) struct Untangle {
    /// Of each garment.
    sheets: Vec<Untangler>,
    /// Of one garment, before the look and now, metres.
    from: Vec<V3d>,
    x: Vec<V3d>,
    held: Vec<bool>,
}

impl Untangle {
    /// Looks at the garments whose turn it is in a call of `dt` seconds and that do not sleep, on the body of the last
    /// call. Says how many edges passed through triangles.
    pub(super) fn look(
        &mut self,
        model: &Model,
        state: &mut State,
        body: &SurfaceFrame,
        dt: f64,
    ) -> usize {
        let resting = model.config.sleep && state.quiet_for > LAST;
        if model.config.untangle <= 0.0 || resting {
            return 0;
        }
        let every = (model.config.untangle / dt).round().max(1.0) as u64;
        let mut found = 0;
        for (k, m) in model.garments.iter().enumerate() {
            // In turn, so that no call pays for all.
            if !(state.frames + k as u64).is_multiple_of(every) {
                continue;
            }
            let State { garments, rest, .. } = state;
            let positions = &mut garments[k].positions;
            self.held.clear();
            self.held
                .extend((0..positions.len() as u32).map(|v| rest.sleeps(model, k, v)));
            if self.held.iter().all(|h| *h) {
                continue;
            }
            let anchors = &model.outfit.anchors[k];
            anchors
                .iter()
                .filter(|a| a.strength >= 1.0)
                .for_each(|a| self.held[a.vertex as usize] = true);
            self.x.clear();
            self.x
                .extend(positions.iter().map(|p| p.coords.cast::<f64>()));
            for g in self.sheets.len()..=k {
                let at: Vec<V3d> = garments[g]
                    .positions
                    .iter()
                    .map(|p| p.coords.cast())
                    .collect();
                self.sheets
                    .push(Untangler::new(&model.outfit.garments[g].faces, &at));
            }
            let weight = |v: usize| {
                if self.held[v] {
                    0.0
                } else {
                    1.0 / m.sheet.mass[v]
                }
            };
            self.from.clone_from(&self.x);
            let sheet = &mut self.sheets[k];
            sheet.look_anew();
            let stuck = &mut garments[k].stuck;
            stuck.resize(self.x.len(), 0);
            for r in 0..ROUNDS {
                let crossings = sheet
                    .round(model.config.par, &mut self.x, weight, STEP, GAP)
                    .crossings;
                if r == 0 {
                    found += crossings;
                    let count = |(n, crossed): (&mut u8, bool)| {
                        *n = if crossed {
                            (*n + 1).min(STUCK[1])
                        } else {
                            n.saturating_sub(1)
                        };
                    };
                    stuck.iter_mut().zip(sheet.crossed()).for_each(count);
                }
                if crossings == 0 {
                    break;
                }
            }
            let g = &mut garments[k];
            g.passing.clear();
            for (v, (from, to)) in self
                .from
                .iter()
                .zip(&self.x)
                .enumerate()
                .filter(|(_, w)| w.0 != w.1)
            {
                let way = (to - from).cap_magnitude(MOST);
                g.go(v, from, way, body);
                // What has further to go than that is still on the wrong side.
                if sheet.pushes[v].1 > 0.0 || way != to - from {
                    g.passing.push(v as u32);
                }
            }
            let stuck: Vec<bool> = g.stuck.iter().map(|n| *n >= STUCK[0]).collect();
            if stuck.contains(&true) {
                self.from
                    .iter_mut()
                    .zip(&g.positions)
                    .for_each(|(x, p)| *x = p.coords.cast());
                self.x.clone_from(&self.from);
                // A sleeve that was ironed left its cuff behind and turned inside out.
                let movable = |v: usize| !self.held[v] && !Region(m.own[v]).meets(Region::ARMS);
                sheet.iron(&mut self.x, stuck, movable, IRONED.0);
                for (v, (from, to)) in self
                    .from
                    .iter()
                    .zip(&self.x)
                    .enumerate()
                    .filter(|(_, w)| w.0 != w.1)
                {
                    g.go(v, from, (to - from).cap_magnitude(IRONED.1), body);
                }
            }
        }
        found
    }
}

impl GarmentState {
    /// Puts a vertex `way` from `from`, metres, but not into the skin.
    fn go(&mut self, v: usize, from: &V3d, way: V3d, body: &SurfaceFrame) {
        self.positions[v] =
            P3::from((from + off_skin(from, way, self.nearest[v], body)).cast::<f32>());
    }
}

/// A way from `x` without what of it goes into the skin at the two nearest vertices of the body.
fn off_skin(x: &V3d, mut way: V3d, nearest: [u32; 2], body: &SurfaceFrame) -> V3d {
    for v in nearest {
        let (Some(at), Some(normal)) =
            (body.vertices.get(v as usize), body.normals.get(v as usize))
        else {
            continue;
        };
        let (normal, height) = (
            normal.cast::<f64>(),
            (x - at.coords.cast::<f64>()).dot(&normal.cast()),
        );
        let lowest = ABOVE.min(height);
        let sinks = lowest - (height + way.dot(&normal));
        if height < NEAR && sinks > 0.0 {
            way += normal * sinks;
        }
    }
    way
}
