//! The anchors of a piece of cloth: its highest opening, or the cloth on the shoulders.

use super::classifier::{PieceShape, Support};
use tryon_body::Template;
use tryon_garment::{AnchorKind, AnchorSet};
use tryon_geometry::math::P3;

/// Height of the anchored ring at the top of cloth without an opening there, metres.
const RING: f32 = 0.025;
/// Rise of an opening from which it is no band, metres: waistbands rise by 3 cm to the back.
const LEVEL: f32 = 0.08;
/// Half width of the anchored strip on a shoulder, metres.
const STRIP: f32 = 0.012;
/// Inner end of the strip, share of the way from the neck to the shoulder joint.
const INNER: f32 = 0.3;

/// One firm set: an open jacket slides off a body without friction.
pub(super) fn anchors(template: &Template, shape: &PieceShape, x: &[P3]) -> Vec<AnchorSet> {
    let vertices = match shape.support {
        Support::Opening => highest_opening(&shape.openings, x),
        Support::Shoulders => on_shoulders(template, x),
    };
    let Some(vertices) = vertices else {
        return Vec::new();
    };
    // Spread evenly, an opening that is not level would be stretched: it is tied where it lies.
    let kind = if shape.support == Support::Opening && rise(&vertices, x) < LEVEL {
        AnchorKind::Band
    } else {
        AnchorKind::Shoulders
    };
    vec![AnchorSet {
        kind,
        vertices,
        strength: 1.0,
    }]
}

/// Difference of the heights of some vertices, metres.
fn rise(vertices: &[u32], x: &[P3]) -> f32 {
    let heights = || vertices.iter().map(|v| x[*v as usize].y);
    heights().fold(f32::MIN, f32::max) - heights().fold(f32::MAX, f32::min)
}

/// Vertices within [`RING`] of the highest.
fn top_ring(x: &[P3]) -> Vec<u32> {
    let top = x.iter().map(|p| p.y).fold(f32::MIN, f32::max);
    let on = |v: &u32| x[*v as usize].y > top - RING;
    (0..x.len() as u32).filter(on).collect()
}

fn highest_opening(openings: &[Vec<u32>], x: &[P3]) -> Option<Vec<u32>> {
    let height =
        |l: &[u32]| l.iter().map(|v| x[*v as usize].y).sum::<f32>() / l.len().max(1) as f32;
    let highest = openings
        .iter()
        .max_by(|a, b| height(a).total_cmp(&height(b)));
    Some(highest.cloned().unwrap_or_else(|| top_ring(x)))
}

/// Vertices in a strip on the shoulders, or the top of a shirt front or a collar; `None` for a skeleton without shoulders.
fn on_shoulders(template: &Template, x: &[P3]) -> Option<Vec<u32>> {
    let sk = template.skeleton();
    let at = |n: &str| sk.index(n).map(|j| sk.joints()[j].rest.cast::<f32>());
    let (neck, tip) = (at("neck")?, at("left_shoulder")?);
    let reach = (tip.x - neck.x).abs();
    let on = |p: &P3| {
        p.y > tip.y
            && (p.z - tip.z).abs() < STRIP
            && (INNER * reach..reach + STRIP).contains(&p.x.abs())
    };
    let vertices: Vec<u32> = (0..x.len() as u32)
        .filter(|v| on(&x[*v as usize]))
        .collect();
    Some(if vertices.is_empty() {
        top_ring(x)
    } else {
        vertices
    })
}
