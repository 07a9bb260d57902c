//! Cloth against cloth: an outer layer outside the inner ones, and the folds of one garment off each other.
//!
//! A vertex is kept on its side of the nearest triangle. Outer layers press inner ones inwards and are not pushed back,
//! as the body bears them both: the other way round a bell of a skirt carried the shirt up (docs/hindsight.md). Between
//! two folds of one garment each is held off the other. Nothing needs a common solution.

use super::model::Model;
use super::state::PatchScratch;
use crate::cloth::folds::{FoldFrame, touching};
use crate::cloth::small_steps::Fabric;
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
/// Garments at the beginning of a round.
pub(super) struct ClothTouch<'a> {
    pub(super) model: &'a Model,
    pub(super) sheets: &'a [FoldFrame],
    /// Length of the round, s.
    pub(super) span: f32,
}

/// Gathers the garments from their patches, where contact of cloth with cloth is wanted.
pub(super) fn sheets(model: &Model, patches: &[PatchScratch], span: f32, out: &mut Vec<FoldFrame>) {
    let c = &model.config;
    out.resize_with(model.garments.len(), FoldFrame::default);
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
        let search = c.self_collision.then(|| g.folds.search(c.thickness as f32, span));
        g.folds.begin(par::Par::Seq, s, search.as_ref(), n);
    });
}

impl ClothTouch<'_> {
    /// Adds the planes of a patch's own other folds for this round.
    pub(super) fn folds(&self, garment: usize, f: &Fabric, p: &mut PatchScratch) {
        if !self.model.config.self_collision {
            return;
        }
        let (g, s) = (&self.model.garments[garment].folds, &self.sheets[garment]);
        let search = g.search(self.model.config.thickness as f32, self.span);
        for (i, &v) in f.vertices.iter().enumerate() {
            // Where no corner was near, no fold comes within reach before the round after this one.
            if p.tied[i] || p.free[i] || p.passing[i] {
                continue;
            }
            if std::mem::take(&mut p.alone[i]) && self.model.config.skip_far {
                p.report.fold_searches_skipped += 1;
                continue;
            }
            let x = place(p, i);
            let Some((corner, _)) = g.corner(s, v, &x, &search, &mut p.neighbour_of) else {
                p.alone[i] = true;
                continue;
            };
            if let Some((plane, far)) = g.plane(s, i, v, &x, corner, &search) {
                p.planes.push(plane);
                p.report.cloth_contacts += usize::from(far <= search.thickness);
            }
        }
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
                let (g, s) = (&self.model.garments[outer].folds.surface, &self.sheets[outer]);
                let (near, hit) = g.closest_within(&s.surface, &x, p.layers[outer][i], own, LAYER_DEPTH);
                p.layers[outer][i] = near;
                let Ok(hit) = hit else { continue };
                let Some(hit) = g.under(&s.surface, &x, &hit, HEM) else { continue };
                let inside = -hit.signed;
                if inside < LAYER_REACH && inside > -LAYER_DEPTH {
                    p.planes.push(touching(g, s, i, &hit, -1.0, LAYER_GAP));
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
