//! Collide stage: constraints of all patches for one interval.

use super::contact::anchor::pin_anchors;
use super::contact::body_contact::BodyContacts;
use super::outfit_model::Model;
use super::patch::for_patches;
use super::state::State;
use super::workspace::Workspace;
use crate::contact::SurfaceFrame;
use tryon_geometry::par::{self, Par};

/// One of the equal intervals of a step.
#[derive(Clone, Copy)]
pub(super) struct CollideInterval {
    pub(super) index: usize,
    pub(super) count: usize,
    /// Length of an interval and of the step, s.
    pub(super) span: f32,
    pub(super) dt: f32,
    /// Fastest body vertex, m/s.
    pub(super) fastest: f32,
}

/// Generates anchors, contact planes and near pairs of cloth at the beginning of an interval.
pub(super) fn collide(
    model: &Model,
    state: &State,
    work: &mut Workspace,
    interval: CollideInterval,
) {
    let CollideInterval {
        index, count, span, ..
    } = interval;
    let Workspace {
        patches,
        chunks,
        body,
        pairs,
        ..
    } = work;
    let (par, after) = (model.config.par, state.body.frame());
    let t = index as f32 / count as f32;
    interpolate(par, &body.before, after, t, &mut body.now);
    let contacts = BodyContacts {
        model,
        interior: state.body.interior(),
        now: &body.now,
        before: &body.before.vertices,
        after: &after.vertices,
        dt: interval.dt,
        fastest: interval.fastest,
        span,
        frames: state.frames,
        garments: &state.garments,
        follows_planes: index % 2 == 1,
        maps: (index == 0).then_some(&work.maps),
    };
    for_patches(model, patches, |g, k, p| {
        pin_anchors(model, g, k, &contacts, p);
        let patch = &model.garments[g].patches[k];
        let settings = &model.config.solver;
        p.motion
            .find_overstretched(patch, settings.overstretched, &mut p.overstretched);
        p.motion
            .find_overstretched(patch, settings.taut, &mut p.taut);
    });
    let patches = &*patches;
    if index == 0 {
        pairs.begin(model, state, patches, interval.dt);
    }
    pairs.query(model, patches, span);
    par::for_chunks(par, chunks, 1, |_, c| {
        let c = &mut c[0];
        contacts.generate(&patches[c.at], c);
    });
}

/// Linear interpolation of vertices and normals.
fn interpolate(par: Par, from: &SurfaceFrame, to: &SurfaceFrame, t: f32, out: &mut SurfaceFrame) {
    par::map_into(par, from.vertices.len(), 4096, &mut out.vertices, |i| {
        from.vertices[i] + (to.vertices[i] - from.vertices[i]) * t
    });
    par::map_into(par, from.normals.len(), 4096, &mut out.normals, |i| {
        from.normals[i] + (to.normals[i] - from.normals[i]) * t
    });
}
