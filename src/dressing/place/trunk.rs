//! Panels of the trunk: half tubes that turn over the shoulders and flatten towards the seam.

use super::outline::PanelOutline;
use super::placed_body::{PlacedBody, ends};
use super::tube::{Ellipse, HALF_PANELS, quarter_circle};
use crate::body_sections::BodySections;
use crate::settings::PlaceSettings;
use std::f32::consts::FRAC_PI_2;
use tryon_garment::Panel;
use tryon_geometry::math::P3;

/// Chart of a front or back panel.
pub(super) struct TrunkChart<'a> {
    sections: &'a BodySections,
    settings: &'a PlaceSettings,
    outline: PanelOutline,
    front: bool,
    /// Height of the panel's y = 0 and z of the shoulder seam.
    top: f32,
    shoulder_z: f32,
    /// Underarm point: half width of the trunk and y.
    half: f32,
    armpit: f32,
    /// |x| of the tip and the neck end of the shoulder seam, and how far the tip is below the neck end.
    tip: f32,
    neck: f32,
    fall: f32,
}

impl<'a> TrunkChart<'a> {
    pub(super) fn new(body: &PlacedBody<'a>, panel: &Panel, front: bool) -> Self {
        let [neck, tip] = body.shoulder_seam();
        let [outside, below] = body.settings.trunk.underarm;
        // Without an armhole: the highest corner outside the shoulder tip.
        let underarm = ends(panel, "armhole_right").map_or_else(
            || {
                let corners = panel.edges.iter().map(|e| [e.from[0].abs(), e.from[1]]);
                corners
                    .filter(|p| p[0] > tip[0] + outside && p[1] < tip[1] - below)
                    .max_by(|a, b| a[1].total_cmp(&b[1]))
                    .unwrap_or(body.settings.trunk.default_underarm)
            },
            |[from, _]| from,
        );
        let (top, shoulder_z) = body.shoulder_line();
        Self {
            sections: body.sections,
            settings: body.settings,
            outline: PanelOutline::of(panel),
            front,
            top,
            shoulder_z,
            half: underarm[0] as f32,
            armpit: underarm[1] as f32,
            tip: tip[0] as f32,
            neck: neck[0] as f32,
            fall: -tip[1] as f32,
        }
    }
    pub(super) fn point(&self, p: [f32; 2]) -> P3 {
        let &Self {
            armpit,
            fall,
            neck,
            settings,
            ..
        } = self;
        let x = if self.front { p[0] } else { -p[0] };
        let y = self.top + p[1];
        let width = if p[1] < armpit {
            self.outline.half_width_at(p[1], settings.trunk.least_half)
        } else {
            self.half
        };
        let section = if p[1] < armpit - settings.trunk.lower_body {
            self.sections.lower.at(y)
        } else {
            self.sections.trunk.at(y)
        };
        let Ellipse {
            center: c,
            half: [a, b],
        } = Ellipse::around(&section, HALF_PANELS * width, &settings.tube);
        let angle = FRAC_PI_2 * (x / width).clamp(-1.0, 1.0);
        // From the armpit up rows straighten towards the shoulder seam.
        let up = ((p[1] - armpit) / (-fall - armpit)).clamp(0.0, 1.0);
        let wx = (1.0 - up) * (c[0] + a * angle.sin()) + up * x;
        let ellipse_z = c[1] + if self.front { b } else { -b } * angle.cos();
        let seam_y = -fall * ((x.abs() - neck) / (self.tip - neck)).clamp(0.0, 1.0);
        let below = ((seam_y - p[1]) / settings.trunk.shoulder_depth).clamp(0.0, 1.0);
        let z = self.shoulder_z + (ellipse_z - self.shoulder_z) * quarter_circle(below);
        P3::new(wx, y, z)
    }
}
