//! Display figure: borders of skin, hair and base layer as signed distances at the vertices, and its materials.

use super::base_layer::BaseLayer;
use super::figure_head::{FigureHead, head_share};
use super::material::SurfaceMaterial;
use super::rest_pose::ramp;
use super::settings::FigureSettings;
use super::shadow_map::openness;
use tryon_body::{RestBody, Template};
use tryon_geometry::math::P3;

/// Width of the soft edge of a border (m): about a pixel at 2.4 m.
const EDGE: f32 = 0.002;
/// Width of a hem (m), and its brightness.
const HEM: f32 = 0.010;
const HEM_SHADE: f32 = 0.90;

/// Signed distances from borders (m), positive within.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Borders {
    hair: f32,
    top: f32,
    leggings: f32,
}

/// Painted figure: borders and openness of each vertex, shapes `[vertices]`.
#[derive(Clone, Debug)]
pub(super) struct FigurePaint {
    borders: Vec<Borders>,
    /// Share of its half space that a vertex sees past the body in the rest pose.
    pub(super) openness: Vec<f32>,
    skin: SurfaceMaterial,
    hair: SurfaceMaterial,
    top: SurfaceMaterial,
    leggings: SurfaceMaterial,
}

impl FigurePaint {
    /// Paint of a body whose head is a [`FigureHead`].
    pub(super) fn new(template: &Template, rest: &RestBody, settings: &FigureSettings) -> Self {
        let cut = BaseLayer::new(template, rest);
        let head = FigureHead::of(template, rest);
        let borders = |(i, p): (usize, &P3)| Borders {
            hair: if head_share(template, i) > 0.3 {
                head.hair(p)
            } else {
                -1.0
            },
            top: cut.top(p),
            leggings: cut.leggings(p),
        };
        let [skin, cloth, hair] = settings.gloss;
        let material = |color: [u8; 3], scatter: [f32; 3], gloss: f32| SurfaceMaterial {
            scatter,
            gloss,
            ..SurfaceMaterial::from(color)
        };
        Self {
            borders: rest.base.iter().enumerate().map(borders).collect(),
            openness: openness(&rest.base, &rest.normals, template.mesh().faces()),
            skin: material(settings.skin, settings.scatter, skin),
            hair: material(settings.hair, [0.0; 3], hair),
            top: material(settings.top, [0.0; 3], cloth),
            leggings: material(settings.leggings, [0.0; 3], cloth),
        }
    }

    /// Material at a point of a face with the vertices `corners`.
    pub(super) fn material(&self, corners: [u32; 3], weights: [f32; 3]) -> SurfaceMaterial {
        let at = corners.map(|k| self.borders[k as usize]);
        let mean = |of: fn(&Borders) -> f32| (0..3).map(|k| of(&at[k]) * weights[k]).sum::<f32>();
        let mut out = self.skin;
        for (distance, layer) in [
            (mean(|b| b.leggings), &self.leggings),
            (mean(|b| b.top), &self.top),
        ] {
            if within(distance) <= 0.0 {
                continue;
            }
            let hem = within(HEM - distance) * (1.0 - HEM_SHADE);
            let mut cloth = *layer;
            cloth.albedo = cloth.albedo.map(|c| c * (1.0 - hem));
            out = out.mixed(&cloth, within(distance));
        }
        out.mixed(&self.hair, within(mean(|b| b.hair)))
    }
}

/// Share of a pixel within a border at a signed distance.
fn within(distance: f32) -> f32 {
    ramp(distance, -0.5 * EDGE, 0.5 * EDGE)
}

#[cfg(test)]
#[path = "figure_tests.rs"]
mod tests;
