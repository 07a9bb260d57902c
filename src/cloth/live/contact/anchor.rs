//! Anchors of a patch as pins of an interval.

use super::body_contact::BodyContacts;
use crate::live::outfit_model::Model;
use crate::live::patch::{PatchWork, v4};
use crate::live::solver::explicit::Pin;

/// Pins of a patch's anchors, which move with the body through an interval. What sleeps is pinned too.
pub(in crate::live) fn pin_anchors(
    model: &Model,
    garment: usize,
    patch: usize,
    body: &BodyContacts<'_>,
    p: &mut PatchWork,
) {
    p.pins.clear();
    p.pinned.clear();
    p.pinned.extend_from_slice(&p.asleep);
    let (h, rate) = (model.garments[garment].h, model.config.contact.anchor_rate);
    for (local, a) in model.anchors_of(garment, patch) {
        if a.strength <= 0.0 || p.asleep[local as usize] {
            continue;
        }
        let start = a.position(a.body.map(|v| body.now.vertices[v as usize]));
        let end = a.position(a.body.map(|v| body.at_interval_end(v as usize)));
        let stiffness = if a.strength >= 1.0 {
            1.0
        } else {
            1.0 - (-h * rate * a.strength / (1.0 - a.strength)).exp()
        };
        p.pinned[local as usize] = a.strength >= 1.0;
        p.pins.push(Pin {
            vertex: local,
            target: v4(&start.coords),
            velocity: v4(&((end - start) / body.span)),
            stiffness: stiffness as f32,
        });
    }
}
