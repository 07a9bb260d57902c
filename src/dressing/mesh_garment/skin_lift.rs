//! Least height of cloth above the skin: a rest shape taken below it would be too tight for good.

use tryon_body::SkinSearch;
use tryon_geometry::math::{P3, V3};

/// Least height of cloth above the skin at the start, metres.
const ABOVE: f32 = 0.006;
/// Distance from the skin within which cloth is lifted, metres.
const NEAR: f32 = 0.04;

/// A point at least [`ABOVE`] over the skin near it.
pub(super) fn lifted(skin: &SkinSearch<'_>, p: P3) -> P3 {
    let Some((i, _)) = skin.nearest(&p, &V3::zeros(), NEAR) else {
        return p;
    };
    p + skin.normals[i] * (ABOVE - skin.height(&p, i)).max(0.0)
}
