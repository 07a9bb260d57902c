//! Halves of a hood, laid back behind the head.

use super::outline::sample_edges;
use super::placed_body::{PlacedBody, sign};
use super::tube::quarter_circle;
use crate::settings::HoodPlaceSettings;
use tryon_garment::{Panel, Side};
use tryon_geometry::math::P3;

/// Chords of one crown edge.
const CHORDS: usize = 24;

/// Chart of one half.
pub(super) struct HoodChart {
    /// 1 for the left half, −1 for the right.
    side: f32,
    /// Height of the shoulder line.
    top: f32,
    /// z of the nape.
    nape: f32,
    /// Half width of the head.
    width: f32,
    /// Points of the crown seam, panel coordinates.
    crown: Vec<[f32; 2]>,
    settings: HoodPlaceSettings,
}

impl HoodChart {
    pub(super) fn new(body: &PlacedBody<'_>, panel: &Panel, side: Side) -> Self {
        let (settings, clearance) = (body.settings.hood, body.settings.tube.clearance);
        let (top, _) = body.shoulder_line();
        let width = body
            .sections
            .vertices
            .iter()
            .filter(|p| p.y > top + settings.head)
            .map(|p| p.x.abs())
            .fold(0.0, f32::max);
        let crown = sample_edges(panel, "crown", CHORDS);
        Self {
            side: sign(side),
            top,
            nape: body.sections.trunk.at(top + settings.nape).z[0] - clearance,
            width: width + clearance,
            crown: crown.iter().map(|p| p.map(|c| c as f32)).collect(),
            settings,
        }
    }
    pub(super) fn point(&self, p: [f32; 2]) -> P3 {
        let s = self.settings;
        let from_crown = self
            .crown
            .iter()
            .map(|c| (c[0] - p[0]).hypot(c[1] - p[1]))
            .fold(f32::MAX, f32::min);
        let out = self.width * quarter_circle((from_crown / s.crown_turn).clamp(0.0, 1.0));
        // Laid back ever more from the neckline on (smoothstep), so that the hood does not intersect itself.
        let up = (p[1] / s.fold).clamp(0.0, 1.0);
        let (sin, cos) = (s.recline * up * up * (3.0 - 2.0 * up)).sin_cos();
        let (y, z) = (p[1] - s.axis, -self.side * p[0]);
        P3::new(
            self.side * out,
            self.top + s.nape + s.axis + y * cos + z * sin,
            self.nape + z * cos - y * sin,
        )
    }
}
