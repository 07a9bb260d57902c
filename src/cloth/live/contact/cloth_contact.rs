//! Contact of cloth with cloth: outer layers outside inner ones, and the folds of one garment off each other.
//!
//! A vertex stays on its side of the nearest triangle. Outer layers press inner ones inwards and are not pushed back, as the
//! body supports both; two folds of one garment push each other. No constraint needs a common solution.

use super::chunk::ContactChunk;
use super::self_contact::SelfContactFrame;
use crate::contact::SearchExtent;
use crate::live::outfit_model::Model;
use crate::live::patch::PatchWork;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par::{self, Par};

/// Garments at the beginning of an interval.
pub(in crate::live) struct ClothContacts<'a> {
    pub(in crate::live) model: &'a Model,
    pub(in crate::live) sheets: &'a [SelfContactFrame],
    /// Length of the interval, s.
    pub(in crate::live) span: f32,
}

/// Gathers positions and velocities of the garments from their patches, where contact of cloth with cloth is wanted.
pub(in crate::live) fn gather_sheets(
    model: &Model,
    patches: &[PatchWork],
    span: f32,
    out: &mut Vec<SelfContactFrame>,
) {
    let c = &model.config;
    out.resize_with(model.garments.len(), SelfContactFrame::default);
    if !(c.self_collision || c.layers && model.garments.len() > 1) {
        return;
    }
    let mut first = 0;
    let mut starts = Vec::with_capacity(model.garments.len());
    for g in &model.garments {
        starts.push(first);
        first += g.patches.len();
    }
    par::for_chunks(c.par, out, 1, |k, s| {
        let (g, s) = (&model.garments[k], &mut s[0]);
        let n = g.sheet.mass.len();
        s.surface.vertices.resize(n, P3::origin());
        s.velocities.resize(n, V3::zeros());
        for (f, p) in g.patches.iter().zip(&patches[starts[k]..]) {
            for i in 0..f.owned {
                let v = f.vertices[i] as usize;
                s.surface.vertices[v] = p.position(i);
                s.velocities[v] = p.velocity(i);
            }
        }
        let search = c
            .self_collision
            .then(|| g.self_contact.search(c.thickness as f32, span));
        g.self_contact.begin(Par::Seq, s, search.as_ref(), n);
    });
}

impl ClothContacts<'_> {
    /// Contact planes of a chunk with its garment's other folds and with the garments outside of it.
    pub(in crate::live) fn generate(&self, p: &PatchWork, c: &mut ContactChunk) {
        c.cloth_planes.clear();
        if self.model.config.self_collision {
            self.with_folds(p, c);
        }
        if self.model.config.layers {
            self.with_layers(p, c);
        }
    }

    fn with_folds(&self, p: &PatchWork, c: &mut ContactChunk) {
        let (m, f) = c.model(self.model);
        let (g, s) = (&m.self_contact, &self.sheets[c.garment]);
        let search = g.search(self.model.config.thickness as f32, self.span);
        for (j, i) in c.range.clone().enumerate() {
            if p.pinned[i] || c.released[j] || c.intersecting[j] {
                continue;
            }
            // Without a corner near in the last interval, no fold comes within reach in this one.
            if std::mem::take(&mut c.is_alone[j]) && self.model.config.cull_distant {
                c.report.fold_searches_skipped += 1;
                continue;
            }
            let (v, x) = (f.vertices[i], p.position(i));
            let Some(corner) = g.candidate(s, v, &x, &search, &mut c.neighbour_of) else {
                c.is_alone[j] = true;
                continue;
            };
            let hit = g.other_fold(s, v, &x, corner);
            let plane = hit.and_then(|hit| g.plane(s, i, v, &hit, &search));
            if let Some((plane, distance)) = plane {
                c.cloth_planes.push(plane);
                c.report.cloth_contacts += usize::from(distance <= search.thickness);
            }
        }
    }

    fn with_layers(&self, p: &PatchWork, c: &mut ContactChunk) {
        let (m, f) = c.model(self.model);
        let settings = &self.model.config.contact;
        let (reach, depth, gap) = (
            settings.layer_reach,
            settings.layer_depth,
            settings.layer_gap,
        );
        for (j, i) in c.range.clone().enumerate() {
            if p.pinned[i] || c.released[j] {
                continue;
            }
            let x = p.position(i);
            // A skirt lies under the trunk of a shirt, never under its sleeves.
            let own = m.own[f.vertices[i] as usize];
            for outer in c.garment + 1..self.model.garments.len() {
                let (sheet, s) = (
                    &self.model.garments[outer].self_contact,
                    &self.sheets[outer],
                );
                let g = &sheet.surface;
                let start = c.layers[outer][j];
                let extent = SearchExtent {
                    mask: own,
                    reach: depth,
                };
                let (near, hit) = g.closest_within(&s.surface, &x, start, extent);
                c.layers[outer][j] = near;
                let cover = hit
                    .ok()
                    .and_then(|hit| g.cover(&s.surface, &x, &hit, settings.hem));
                let Some(cover) = cover else { continue };
                let inside = -cover.signed_distance;
                if inside < reach && inside > -depth {
                    c.cloth_planes
                        .push(s.contact_plane(sheet, i, &cover, -1.0, gap));
                    c.report.cloth_contacts += usize::from(inside < gap);
                }
            }
        }
    }
}
