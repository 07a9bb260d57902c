//! The anchors of a piece of cloth: its highest opening, or the cloth on the shoulders.

use super::classifier::{PieceShape, Support};
use crate::settings::AnchorSettings;
use tryon_body::Template;
use tryon_garment::{AnchorKind, AnchorSet};
use tryon_geometry::math::P3;

/// One firm set: an open jacket slides off a body without friction.
pub(super) fn anchors(
    template: &Template,
    shape: &PieceShape,
    x: &[P3],
    settings: &AnchorSettings,
) -> Vec<AnchorSet> {
    let vertices = match shape.support {
        Support::Opening => highest_opening(&shape.openings, x, settings),
        Support::Shoulders => on_shoulders(template, x, settings),
    };
    let Some(vertices) = vertices else {
        return Vec::new();
    };
    // Spread evenly, an opening that is not level would be stretched: it is tied where it lies.
    let kind = if shape.support == Support::Opening && rise(&vertices, x) < settings.level {
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

/// Vertices within `ring` metres of the highest.
fn top_ring(x: &[P3], ring: f32) -> Vec<u32> {
    let top = x.iter().map(|p| p.y).fold(f32::MIN, f32::max);
    let on = |v: &u32| x[*v as usize].y > top - ring;
    (0..x.len() as u32).filter(on).collect()
}

fn highest_opening(openings: &[Vec<u32>], x: &[P3], settings: &AnchorSettings) -> Option<Vec<u32>> {
    let height =
        |l: &[u32]| l.iter().map(|v| x[*v as usize].y).sum::<f32>() / l.len().max(1) as f32;
    let highest = openings
        .iter()
        .max_by(|a, b| height(a).total_cmp(&height(b)));
    Some(
        highest
            .cloned()
            .unwrap_or_else(|| top_ring(x, settings.ring)),
    )
}

/// Vertices in a strip on the shoulders, or the top of a shirt front or a collar; `None` for a skeleton without shoulders.
fn on_shoulders(template: &Template, x: &[P3], settings: &AnchorSettings) -> Option<Vec<u32>> {
    let (ring, strip, inner) = (settings.ring, settings.strip, settings.inner);
    let sk = template.skeleton();
    let at = |n: &str| sk.index(n).map(|j| sk.joints()[j].rest.cast::<f32>());
    let (neck, tip) = (at("neck")?, at("left_shoulder")?);
    let reach = (tip.x - neck.x).abs();
    let on = |p: &P3| {
        p.y > tip.y
            && (p.z - tip.z).abs() < strip
            && (inner * reach..reach + strip).contains(&p.x.abs())
    };
    let vertices: Vec<u32> = (0..x.len() as u32)
        .filter(|v| on(&x[*v as usize]))
        .collect();
    Some(if vertices.is_empty() {
        top_ring(x, ring)
    } else {
        vertices
    })
}
