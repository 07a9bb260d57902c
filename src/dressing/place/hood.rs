//! Halves of a hood, laid back behind the head.

use super::outline::sample_edges;
use super::placed_body::{PlacedBody, sign};
use super::tube::{CLEARANCE, quarter_circle};
use tryon_garment::{Panel, Side};
use tryon_geometry::math::P3;

/// Angle by which a hood lies back, radians; with less its back turns inside out.
const RECLINE: f32 = 2.5;
/// Height of cloth over which it folds back, metres.
const FOLD: f32 = 0.25;
/// Height of the fold's axis above the nape, metres; below the nape the back would turn inside out.
const AXIS: f32 = 0.03;
/// Width of cloth over which a hood turns from the crown to the side of the head, metres.
const CROWN_TURN: f32 = 0.11;
/// Chords of one crown edge.
const CHORDS: usize = 24;
/// Skin this far above the shoulder line is head, metres.
const HEAD: f32 = 0.10;
/// Height of the nape above the shoulder line, metres.
const NAPE: f32 = 0.01;

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
}

impl HoodChart {
    pub(super) fn new(body: &PlacedBody<'_>, panel: &Panel, side: Side) -> Self {
        let (top, _) = body.shoulder_line();
        let width = body
            .sections
            .vertices
            .iter()
            .filter(|p| p.y > top + HEAD)
            .map(|p| p.x.abs())
            .fold(0.0, f32::max);
        let crown = sample_edges(panel, "crown", CHORDS);
        Self {
            side: sign(side),
            top,
            nape: body.sections.trunk.at(top + NAPE).z[0] - CLEARANCE,
            width: width + CLEARANCE,
            crown: crown.iter().map(|p| p.map(|c| c as f32)).collect(),
        }
    }
    pub(super) fn point(&self, p: [f32; 2]) -> P3 {
        let from_crown = self
            .crown
            .iter()
            .map(|c| (c[0] - p[0]).hypot(c[1] - p[1]))
            .fold(f32::MAX, f32::min);
        let out = self.width * quarter_circle((from_crown / CROWN_TURN).clamp(0.0, 1.0));
        // Laid back ever more from the neckline on (smoothstep), so that the hood does not intersect itself.
        let up = (p[1] / FOLD).clamp(0.0, 1.0);
        let (sin, cos) = (RECLINE * up * up * (3.0 - 2.0 * up)).sin_cos();
        let (y, z) = (p[1] - AXIS, -self.side * p[0]);
        P3::new(
            self.side * out,
            self.top + NAPE + AXIS + y * cos + z * sin,
            self.nape + z * cos - y * sin,
        )
    }
}
