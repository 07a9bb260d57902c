//! Least height of cloth above the skin: a rest shape taken below it would be too tight for good.

use crate::settings::LiftSettings;
use tryon_body::SkinSearch;
use tryon_geometry::math::{P3, V3};

/// A point at least the least height over the skin near it.
pub(super) fn lifted(skin: &SkinSearch<'_>, p: P3, settings: &LiftSettings) -> P3 {
    let Some((i, _)) = skin.nearest(&p, &V3::zeros(), settings.near) else {
        return p;
    };
    p + skin.normals[i] * (settings.above - skin.height(&p, i)).max(0.0)
}
