//! Least height of cloth above the skin: a rest shape taken below it would be too tight for good.

use crate::skin_binding::skin_normals;
use tryon_body::Template;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::PointTree;

/// Least height of cloth above the skin at the start, metres.
const ABOVE: f32 = 0.006;
/// Distance from the skin within which cloth is lifted, metres.
const NEAR: f32 = 0.04;

/// Skin that cloth is lifted off.
pub(super) struct SkinLift<'a> {
    skin: &'a [P3],
    normals: Vec<V3>,
    tree: PointTree,
}

impl<'a> SkinLift<'a> {
    /// Skin of a template with vertices elsewhere, metres.
    pub(super) fn new(template: &Template, skin: &'a [P3]) -> Self {
        Self {
            normals: skin_normals(template, skin),
            tree: PointTree::new(skin),
            skin,
        }
    }

    /// A point at least [`ABOVE`] over the skin near it.
    pub(super) fn lifted(&self, p: P3) -> P3 {
        let Some((i, _)) = self.tree.nearest(&p, NEAR) else {
            return p;
        };
        let height = self.normals[i].dot(&(p - self.skin[i]));
        p + self.normals[i] * (ABOVE - height).max(0.0)
    }
}
