//! Cloth against cloth: an outer layer outside the inner ones, and the folds of one garment off each other.
//!
//! A vertex is kept on its side of the nearest triangle. Outer layers press inner ones inwards and are not pushed back,
//! as the body bears them both: the other way round a bell of a skirt carried the shirt up (docs/hindsight.md). Between
//! two folds of one garment each is held off the other. Nothing needs a common solution.

use super::model::{GarmentModel, Model};
use super::state::{PatchScratch, SheetFrame};
use crate::cloth::small_steps::{Fabric, Plane, V4};
use crate::contact::{Closest, SurfaceModel};
use crate::math::{P3, V3};
use crate::par;

/// An outer layer is looked for within this distance outside a vertex, metres.
const LAYER_REACH: f32 = 0.02;
/// Distance between layers, metres: no more than there is between two of them on the skin.
const LAYER_GAP: f32 = 0.002;
/// Further than this outside an outer layer a vertex has nothing to do with it (a sleeve, the other side), metres.
const LAYER_DEPTH: f32 = 0.15;
/// An inner layer may stand out from under a hem as far as it is below it, up to this distance, metres: the edge of a
/// triangle.
const HEM: f32 = 0.03;
/// Folds close at up to this speed, m/s.
const CLOSING: f32 = 1.0;
/// Folds nearer than this are looked at, metres: what they come within a round of 8 ms. Farther ones hold each other over the
/// air between them: with 11 mm in a dancer's rounds and 20 mm while dressing her skirt tore (stretch 176 % instead of 7 %).
const FOLD_REACH: f32 = 0.01;
/// Friction of cloth on cloth: lower than measured (0.3), as planes that are looked for anew in each round hold already.
const FRICTION: f32 = 0.1;

/// Rounds of averaging speeds over neighbours before they are extrapolated through a round. A vertex that vibrates at
/// 3 m/s would else carry what touches it by 1 cm each way; a dancer's skirt shook itself to pieces (without it 10k
/// vertices stretch by 243 %, with one round by 12.6 %, with two by 8.7 %, as without contact of cloth with cloth).
const CALMING: usize = 2;

/// Garments at the beginning of a round.
pub(super) struct ClothTouch<'a> {
    pub(super) model: &'a Model,
    pub(super) sheets: &'a [SheetFrame],
    /// Length of the round, s.
    pub(super) span: f32,
}

/// How far from a vertex a corner is looked for, metres, where folds of triangles with such edges may come within reach in
/// this round or the next: the nearest corner of an even triangle is at most its circumradius beside the nearest point.
fn corner_reach(edge: f32, span: f32) -> f32 {
    (FOLD_REACH + CLOSING * span).hypot(edge / 3f32.sqrt())
}

/// Gathers the garments from their patches, where contact of cloth with cloth is wanted.
pub(super) fn sheets(model: &Model, patches: &[PatchScratch], span: f32, out: &mut Vec<SheetFrame>) {
    let c = &model.config;
    out.resize_with(model.garments.len(), SheetFrame::default);
    if !(c.self_collision || c.layers && model.garments.len() > 1) {
        return;
    }
    let mut first = 0;
    let starts: Vec<usize> = model
        .garments
        .iter()
        .map(|g| {
            first += g.patches.len();
            first - g.patches.len()
        })
        .collect();
    par::for_chunks(c.par, out, 1, |k, s| {
        let (g, s) = (&model.garments[k], &mut s[0]);
        let n = g.sheet.mass.len();
        s.surface.vertices.resize(n, P3::origin());
        s.velocities.resize(n, V3::zeros());
        for (f, p) in g.patches.iter().zip(&patches[starts[k]..]) {
            for i in 0..f.owned {
                let (v, x, u) = (f.vertices[i] as usize, p.motion.position(i).0, p.motion.velocity[i]);
                s.surface.vertices[v] = P3::new(x[0], x[1], x[2]);
                s.velocities[v] = V3::new(u.0[0], u.0[1], u.0[2]);
            }
        }
        for _ in 0..CALMING {
            let sharp = std::mem::take(&mut s.velocities);
            s.velocities.extend(sharp.iter().enumerate().map(|(v, own)| {
                let around = g.surface.neighbours(v as u32);
                around.iter().fold(*own, |a, w| a + sharp[*w as usize]) / (1 + around.len()) as f32
            }));
        }
        g.surface.update_normals(par::Par::Seq, &mut s.surface);
        if c.self_collision {
            s.grid.fill(&s.surface.vertices, 2.0 * corner_reach(g.edge, span));
        }
    });
}

impl ClothTouch<'_> {
    /// Adds the planes of a patch's own other folds for this round.
    pub(super) fn folds(&self, garment: usize, f: &Fabric, p: &mut PatchScratch) {
        if !self.model.config.self_collision {
            return;
        }
        let thickness = self.model.config.thickness as f32;
        let (g, s) = (&self.model.garments[garment], &self.sheets[garment]);
        for (i, &v) in f.vertices.iter().enumerate() {
            // Where no corner was near, no fold comes within reach before the round after this one.
            if p.tied[i] || p.free[i] || std::mem::take(&mut p.alone[i]) {
                continue;
            }
            let x = place(p, i);
            let Some(corner) = self.corner(g, s, v, &x, &mut p.neighbour_of) else {
                p.alone[i] = true;
                continue;
            };
            let Some(hit) = fold(&g.surface, s, v, &x, corner, FOLD_REACH) else {
                continue;
            };
            // Which side it is on now is the side it stays on, and folds nearer than their thickness are not thrown
            // apart. Both move on as they do on average: an impact without bounce.
            let side = if hit.signed >= 0.0 { 1.0 } else { -1.0 };
            let mut plane = plane(&g.surface, &s.velocities, i, &hit, side, thickness.min(hit.signed.abs()));
            let own = s.velocities[v as usize];
            plane.speed = (plane.speed + V4::new(own.x, own.y, own.z)).scale(0.5);
            p.planes.push(plane);
            p.report.cloth_contacts += usize::from(hit.signed.abs() <= thickness);
        }
    }

    /// Nearest vertex that is no neighbour on the sheet.
    fn corner(&self, g: &GarmentModel, s: &SheetFrame, v: u32, x: &P3, neighbour_of: &mut [u32]) -> Option<u32> {
        g.close.row(v as usize).iter().for_each(|w| neighbour_of[*w as usize] = v);
        let reach = corner_reach(g.edge, self.span);
        let mut best = (reach * reach, u32::MAX);
        s.grid.around(x, |j, q| {
            let d = (q - x).norm_squared();
            if (d, j) < best && neighbour_of[j as usize] != v {
                best = (d, j);
            }
        });
        (best.1 != u32::MAX).then_some(best.1)
    }

    /// Adds the planes of the garments outside of this one.
    pub(super) fn layers(&self, garment: usize, f: &Fabric, p: &mut PatchScratch) {
        if !self.model.config.layers {
            return;
        }
        for i in 0..f.vertices.len() {
            if p.tied[i] || p.free[i] {
                continue;
            }
            let x = place(p, i);
            // A skirt lies under the body of a shirt, never under its sleeves.
            let own = self.model.garments[garment].own[f.vertices[i] as usize];
            for outer in garment + 1..self.model.garments.len() {
                let (g, s) = (&self.model.garments[outer].surface, &self.sheets[outer]);
                let (near, hit) = g.closest_within(&s.surface, &x, p.layers[outer][i], own, LAYER_DEPTH);
                p.layers[outer][i] = near;
                let Ok(hit) = hit else { continue };
                let Some(hit) = g.under(&s.surface, &x, &hit, HEM) else { continue };
                let inside = -hit.signed;
                if inside < LAYER_REACH && inside > -LAYER_DEPTH {
                    p.planes.push(plane(g, &s.velocities, i, &hit, -1.0, LAYER_GAP));
                    p.report.cloth_contacts += usize::from(inside < LAYER_GAP);
                }
            }
        }
    }
}

fn place(p: &PatchScratch, i: usize) -> P3 {
    let [x, y, z, _] = p.motion.position(i).0;
    P3::new(x, y, z)
}

/// The plane at a hit, `gap` away from it on its `side`, as fast as its corners.
fn plane(g: &SurfaceModel, speeds: &[V3], i: usize, hit: &Closest, side: f32, gap: f32) -> Plane {
    let corners = g.faces()[hit.face as usize];
    let speed = (0..3).fold(V3::zeros(), |a, k| a + speeds[corners[k] as usize] * hit.weights[k]);
    let n = hit.normal * side;
    Plane {
        vertex: i as u32,
        normal: V4::new(n.x, n.y, n.z),
        level: n.dot(&hit.point.coords) + gap,
        speed: V4::new(speed.x, speed.y, speed.z),
        friction: FRICTION,
    }
}

/// Nearest point of the triangles around a corner of another fold, if it is within reach.
fn fold(g: &SurfaceModel, s: &SheetFrame, v: u32, x: &P3, corner: u32, reach: f32) -> Option<Closest> {
    let hit = g.closest_around(&s.surface, x, corner, u8::MAX);
    let corners = g.faces()[hit.face as usize];
    let same = corners.iter().any(|&c| c == v || g.neighbours(v).contains(&c));
    (!same && hit.signed.abs() < reach && !g.on_rim(&hit)).then_some(hit)
}
