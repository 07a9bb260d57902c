//! Cut of a display figure's base layer: tank top and leggings.

use super::rest_pose::{ramp, rest_joint};
use tryon_body::{RestBody, Template};
use tryon_geometry::math::{P3, V3};

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
