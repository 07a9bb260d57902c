//! Elliptic tubes around cross-sections of the body.

use crate::body_sections::CrossSection;
use crate::settings::TubeSettings;
use std::f32::consts::PI;
use tryon_geometry::math::P3;

/// Half panels in a full girth: left and right of front and back.
pub(super) const HALF_PANELS: f32 = 4.0;

/// An ellipse in a horizontal plane, metres.
#[derive(Clone, Copy)]
pub(super) struct Ellipse {
    /// Centre (x, z).
    pub(super) center: [f32; 2],
    /// Half axes along x and z.
    pub(super) half: [f32; 2],
}

impl Ellipse {
    /// Around a cross-section with clearance, scaled up to `girth` where the garment is wider than the body.
    pub(super) fn around(section: &CrossSection, girth: f32, settings: &TubeSettings) -> Self {
        let (clearance, widest) = (settings.clearance, settings.widest);
        let center = [
            (section.x[0] + section.x[1]) / 2.0,
            (section.z[0] + section.z[1]) / 2.0,
        ];
        let (a, b) = (
            (section.x[1] - section.x[0]) / 2.0 + clearance,
            (section.z[1] - section.z[0]) / 2.0 + clearance,
        );
        // Ramanujan's second approximation of the perimeter.
        let h = ((a - b) / (a + b)).powi(2);
        let perimeter = PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
        let wider = (girth / perimeter).clamp(1.0, widest);
        Self {
            center,
            half: [a * wider, b * wider],
        }
    }
    /// As [`Self::around`], with spare girth spread evenly: the circle of that girth where it clears the body.
    pub(super) fn rounded(section: &CrossSection, girth: f32, settings: &TubeSettings) -> Self {
        let Self {
            center,
            half: [mut a, mut b],
        } = Self::around(section, 0.0, settings);
        let r = girth / (2.0 * PI);
        a = a.max(r.min(a.max(b) * 2.0));
        b = b.max(r.min(a.max(b) * 2.0));
        Self {
            center,
            half: [a, b],
        }
    }
    /// Point at height `y`, `turn` radians from the middle of front or back (`side` 1 or −1) to the side.
    pub(super) fn point(&self, y: f32, turn: f32, side: f32) -> P3 {
        P3::new(
            self.center[0] + side * self.half[0] * turn.sin(),
            y,
            self.center[1] + side * self.half[1] * turn.cos(),
        )
    }
}

/// Height of a quarter circle over its base, both in 0..=1.
pub(super) fn quarter_circle(t: f32) -> f32 {
    (1.0 - (1.0 - t).powi(2)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wide_girth_widens_the_ellipse_to_itself_and_no_more_than_the_limit() {
        let section = CrossSection {
            x: [-0.1, 0.1],
            z: [-0.1, 0.1],
            girth: 0.2 * PI,
        };
        let tube = TubeSettings::default();
        let snug = Ellipse::around(&section, 0.0, &tube).half;
        assert!(snug.iter().all(|r| (r - 0.115).abs() < 1e-6), "{snug:?}");
        for (girth, r) in [(2.0 * PI * 0.15, 0.15), (9.0, 0.115 * tube.widest)] {
            let half = Ellipse::around(&section, girth, &tube).half;
            assert!(half.iter().all(|h| (h - r).abs() < 1e-4), "{half:?}");
        }
        let round = Ellipse::rounded(&section, 2.0 * PI * 0.2, &tube);
        let p = round.point(1.0, 0.3, -1.0);
        assert!((p.x.hypot(p.z) - 0.2).abs() < 1e-5 && p.z < 0.0);
    }
}
