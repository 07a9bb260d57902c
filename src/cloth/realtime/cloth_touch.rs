//! Cloth against cloth: an outer layer outside the inner ones, and the folds of one garment off each other.
//!
//! A vertex is kept on its side of the nearest triangle. Outer layers press inner ones inwards and are not pushed back,
//! as the body bears them both: the other way round a bell of a skirt carried the shirt up (docs/decisions/011-layers.md). Between
//! two folds of one garment each is held off the other. Nothing needs a common solution.

use super::model::Model;
use super::piece::Piece;
use super::state::PatchScratch;
use crate::cloth::folds::{FoldFrame, touching};
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
                let (v, u) = (f.vertices[i] as usize, p.motion.velocity[i]);
                s.surface.vertices[v] = p.place(i);
                s.velocities[v] = V3::new(u.0[0], u.0[1], u.0[2]);
            }
        }
        let search = c
            .self_collision
            .then(|| g.folds.search(c.thickness as f32, span));
        g.folds.begin(par::Par::Seq, s, search.as_ref(), n);
    });
}

impl ClothTouch<'_> {
    /// Planes of the garment's own other folds and of the garments outside of it for a piece of a patch in this round.
    pub(super) fn find(&self, p: &PatchScratch, q: &mut Piece) {
        q.cloth.clear();
        if self.model.config.self_collision {
            self.folds(p, q);
        }
        if self.model.config.layers {
            self.layers(p, q);
        }
    }
    fn folds(&self, p: &PatchScratch, q: &mut Piece) {
        let (m, f) = q.model(self.model);
        let (g, s) = (&m.folds, &self.sheets[q.garment]);
        let search = g.search(self.model.config.thickness as f32, self.span);
        for (j, i) in q.range.clone().enumerate() {
            if p.tied[i] || q.free[j] || q.passing[j] {
                continue;
            }
            // Where no corner was near, no fold comes within reach before the round after this one.
            if std::mem::take(&mut q.alone[j]) && self.model.config.skip_far {
                q.report.fold_searches_skipped += 1;
                continue;
            }
            let (v, x) = (f.vertices[i], p.place(i));
            let Some((corner, _)) = g.corner(s, v, &x, &search, &mut q.neighbour_of) else {
                q.alone[j] = true;
                continue;
            };
            if let Some((plane, far)) = g.plane(s, i, v, &x, corner, &search) {
                q.cloth.push(plane);
                q.report.cloth_contacts += usize::from(far <= search.thickness);
            }
        }
    }
    fn layers(&self, p: &PatchScratch, q: &mut Piece) {
        let (m, f) = q.model(self.model);
        for (j, i) in q.range.clone().enumerate() {
            if p.tied[i] || q.free[j] {
                continue;
            }
            let x = p.place(i);
            // A skirt lies under the body of a shirt, never under its sleeves.
            let own = m.own[f.vertices[i] as usize];
            for outer in q.garment + 1..self.model.garments.len() {
                let (g, s) = (
                    &self.model.garments[outer].folds.surface,
                    &self.sheets[outer],
                );
                let (near, hit) =
                    g.closest_within(&s.surface, &x, q.layers[outer][j], own, LAYER_DEPTH);
                q.layers[outer][j] = near;
                let Ok(hit) = hit else { continue };
                let Some(hit) = g.under(&s.surface, &x, &hit, HEM) else {
                    continue;
                };
                let inside = -hit.signed;
                if inside < LAYER_REACH && inside > -LAYER_DEPTH {
                    q.cloth.push(touching(g, s, i, &hit, -1.0, LAYER_GAP));
                    q.report.cloth_contacts += usize::from(inside < LAYER_GAP);
                }
            }
        }
    }
}
