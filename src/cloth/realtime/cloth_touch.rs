//! Cloth against cloth: an outer layer outside the inner ones, and the folds of one garment off each other.
//!
//! A vertex is kept on its side of the nearest triangle. Inner layers push outer ones and are not pushed back: the body
//! bears them. Between two folds each is held off the other, so that nothing needs a common solution.

use super::model::{GarmentModel, Model};
use super::state::{PatchScratch, SheetFrame};
use crate::cloth::small_steps::{Fabric, Plane, V4};
use crate::contact::{Closest, SurfaceModel};
use crate::math::{P3, V3};
use crate::mesh::Csr;
use crate::par;

/// An outer layer is looked for within this distance outside an inner one, metres.
const LAYER_REACH: f32 = 0.02;
/// Deeper than this inside an inner layer it is somewhere else altogether (a sleeve, the other side), metres.
const LAYER_DEPTH: f32 = 0.15;
/// Folds nearer than this are looked at, metres: they close at up to 1 m/s within a round.
const FOLD_REACH: f32 = 0.01;
/// Cells of the search, metres: half of one reaches the nearest corner of a triangle within reach.
const CELL: f32 = 0.036;
/// Friction of cloth on cloth.
const FRICTION: f32 = 0.3;

/// Garments at the beginning of a round.
pub(super) struct ClothTouch<'a> {
    pub(super) model: &'a Model,
    pub(super) sheets: &'a [SheetFrame],
}

/// Gathers the garments from their patches, where contact of cloth with cloth is wanted.
pub(super) fn sheets(model: &Model, patches: &[PatchScratch], out: &mut Vec<SheetFrame>) {
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
                let (x, u) = (p.motion.position(i).0, p.motion.velocity[i].0);
                s.surface.vertices[f.vertices[i] as usize] = P3::new(x[0], x[1], x[2]);
                s.velocities[f.vertices[i] as usize] = V3::new(u[0], u[1], u[2]);
            }
        }
        g.surface.update_normals(par::Par::Seq, &mut s.surface);
        if c.self_collision {
            s.grid.fill(&s.surface.vertices, CELL);
        }
    });
}

impl ClothTouch<'_> {
    /// Adds the planes of a patch for this round.
    pub(super) fn find(&self, garment: usize, f: &Fabric, p: &mut PatchScratch) {
        let c = &self.model.config;
        let thickness = c.thickness as f32;
        for (i, &v) in f.vertices.iter().enumerate() {
            let x = P3::new(p.motion.position(i).0[0], p.motion.position(i).0[1], p.motion.position(i).0[2]);
            if c.layers {
                for inner in 0..p.under.len() {
                    let (g, s) = (&self.model.garments[inner], &self.sheets[inner]);
                    let (near, hit) = g.surface.closest_within(&s.surface, &x, p.under[inner][i], u8::MAX, LAYER_DEPTH);
                    p.under[inner][i] = near;
                    let Ok(hit) = hit else { continue };
                    if hit.signed < LAYER_REACH && hit.signed > -LAYER_DEPTH && !g.surface.on_rim(&hit) {
                        let plane = self.plane(&g.surface, s, i, &hit, 1.0, thickness);
                        p.planes.push(plane);
                        p.report.cloth_contacts += usize::from(hit.signed < thickness);
                    }
                }
            }
            if c.self_collision {
                let (g, s) = (&self.model.garments[garment], &self.sheets[garment]);
                if let Some(hit) = fold(g, s, v, &x) {
                    // Which side it is on now is the side it stays on.
                    let side = if hit.signed >= 0.0 { 1.0 } else { -1.0 };
                    // Fabric that starts nearer than its thickness is not thrown apart.
                    let plane = self.plane(&g.surface, s, i, &hit, side, thickness.min(hit.signed.abs()));
                    p.planes.push(plane);
                    p.report.cloth_contacts += usize::from(hit.signed.abs() <= thickness);
                }
            }
        }
    }

    fn plane(&self, g: &SurfaceModel, s: &SheetFrame, i: usize, hit: &Closest, side: f32, gap: f32) -> Plane {
        let corners = g.faces()[hit.face as usize];
        let speed = (0..3).fold(V3::zeros(), |a, k| a + s.velocities[corners[k] as usize] * hit.weights[k]);
        let n = hit.normal * side;
        Plane {
            vertex: i as u32,
            normal: V4::new(n.x, n.y, n.z),
            level: n.dot(&hit.point.coords) + gap,
            speed: V4::new(speed.x, speed.y, speed.z),
            friction: FRICTION,
        }
    }
}

/// Nearest point of another fold of the same garment, if there is one within reach.
fn fold(m: &GarmentModel, s: &SheetFrame, v: u32, x: &P3) -> Option<Closest> {
    let g = &m.surface;
    let mut best: Option<(f32, u32)> = None;
    let limit = (CELL / 2.0) * (CELL / 2.0);
    s.grid.around(x, |j| {
        let d = (s.surface.vertices[j as usize] - x).norm_squared();
        if d < limit && best.is_none_or(|b| (d, j) < b) && m.close.row(v as usize).binary_search(&j).is_err() {
            best = Some((d, j));
        }
    });
    let (_, j) = best?;
    let hit = g.closest_around(&s.surface, x, j, u8::MAX);
    let corners = g.faces()[hit.face as usize];
    let same = corners.iter().any(|&c| c == v || g.neighbours(v).contains(&c));
    (!same && hit.signed.abs() < FOLD_REACH && !g.on_rim(&hit)).then_some(hit)
}

/// Vertices within two edges of each other, themselves included.
pub(super) fn close(surface: &SurfaceModel) -> Csr {
    let mut pairs = Vec::new();
    for v in 0..surface.vertices() as u32 {
        let mut near = vec![v];
        for &w in surface.neighbours(v) {
            near.push(w);
            near.extend_from_slice(surface.neighbours(w));
        }
        near.sort_unstable();
        near.dedup();
        pairs.extend(near.into_iter().map(|w| (v, w)));
    }
    Csr::from_pairs(surface.vertices(), &pairs)
}
