//! Display figure: borders of skin, hair and base layer as signed distances at the vertices, and its materials.

use super::figure_head::{FigureHead, head_share};
use super::material::Material;
use super::paint::{ramp, rest_joint};
use super::settings::FigureSettings;
use super::shadow_map::openness;
use tryon_body::{RestBody, Template};
use tryon_geometry::math::{P3, V3};

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
    skin: Material,
    hair: Material,
    top: Material,
    leggings: Material,
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
        let material = |color: [u8; 3], scatter: [f32; 3], gloss: f32| Material {
            scatter,
            gloss,
            ..Material::from(color)
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
    pub(super) fn material(&self, corners: [u32; 3], weights: [f32; 3]) -> Material {
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

/// Cut of tank top and leggings on the rest body, metres.
pub(super) struct BaseLayer {
    neck: V3,
    shoulder: V3,
    /// Height of the waistband and of the leggings' lower hem.
    waist: f32,
    ankle: f32,
}

/// Half width of the neckline (m), and its depth below the neck behind and in front.
const NECKLINE: [f32; 3] = [0.088, 0.045, 0.135];
/// Height of the waistband above the hip joints, of the lower hem above the ankles, and of the part of the leggings that
/// the top covers (m).
const WAISTBAND: f32 = 0.13;
const ANKLE_HEM: f32 = 0.075;
const TUCKED: f32 = 0.06;
/// Depth of the armpit below the shoulder joint, and the armhole's distance inwards from the joint there (m).
const ARMPIT: f32 = 0.13;
const ARMHOLE: f32 = 0.012;
/// Way of the armhole inwards with its height above the armpit, and of the side seam outwards below.
const SLANTS: [f32; 2] = [0.22, 1.0];
/// Height of the neckline's widest place above the joint of the neck (m).
const NECKLINE_TOP: f32 = 0.02;
/// Half width within which legs are, hands of the rest pose are not (m).
const LEGS: f32 = 0.36;

impl BaseLayer {
    pub(super) fn new(template: &Template, rest: &RestBody) -> Self {
        let joint = |name: &str| rest_joint(template, rest, name);
        let hip = joint("left_hip");
        Self {
            neck: joint("neck"),
            shoulder: joint("left_shoulder"),
            waist: hip.y + WAISTBAND,
            ankle: joint("left_ankle").y + ANKLE_HEM,
        }
    }

    /// Signed distance from the border of the leggings, positive within, metres.
    pub(super) fn leggings(&self, p: &P3) -> f32 {
        (self.waist - p.y)
            .min(p.y - self.ankle)
            .min(LEGS - p.x.abs())
    }

    /// Signed distance from the border of the tank top, positive within, metres.
    pub(super) fn top(&self, p: &P3) -> f32 {
        let [width, behind, front] = NECKLINE;
        let depth = behind + (front - behind) * ramp(p.z - self.neck.z, -0.03, 0.03);
        let below = p.y - self.neck.y - NECKLINE_TOP;
        let (x, y) = (p.x / width, below / (depth + NECKLINE_TOP));
        let neckline = if y > 0.0 {
            p.x.abs() - width
        } else {
            (x.hypot(y) - 1.0) * width
        };
        let above_armpit = p.y - self.shoulder.y + ARMPIT;
        let slant = SLANTS[usize::from(above_armpit < 0.0)];
        let armhole = self.shoulder.x - ARMHOLE - slant * above_armpit - p.x.abs();
        neckline.min(armhole).min(p.y - self.waist + TUCKED)
    }
}

#[cfg(test)]
#[path = "figure_tests.rs"]
mod tests;
