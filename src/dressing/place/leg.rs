//! Trouser panels: half tubes around a leg that blend into quarter tubes around the hips.

use super::outline::PanelOutline;
use super::placed_body::{PlacedBody, ends, sign};
use super::tube::{Ellipse, HALF_PANELS};
use crate::body_sections::BodySections;
use crate::finished::{CROTCH_CLEARANCE, DEFAULT_RISE};
use crate::settings::PlaceSettings;
use std::f32::consts::{FRAC_PI_2, PI};
use tryon_garment::{Panel, Side};
use tryon_geometry::math::P3;

/// Least width of a row, metres.
const LEAST_WIDTH: f32 = 1e-4;

/// Chart of the front or back panel of one leg.
pub(super) struct LegChart<'a> {
    sections: &'a BodySections,
    settings: &'a PlaceSettings,
    outline: PanelOutline,
    side: Side,
    front: bool,
    /// Height of the panel's y = 0.
    waist: f32,
    /// Heights on the panel of the crotch point and of the hip line.
    rise: f32,
    hip_line: f32,
    /// Half width of the panel.
    half: f32,
}

impl<'a> LegChart<'a> {
    pub(super) fn new(body: &PlacedBody<'a>, panel: &Panel, side: Side, front: bool) -> Self {
        let outline = PanelOutline::of(panel);
        Self {
            sections: body.sections,
            settings: body.settings,
            side,
            front,
            waist: leg_waist(body),
            rise: landmark(body, panel, "inseam", DEFAULT_RISE),
            hip_line: landmark(body, panel, "crotch", body.settings.leg.default_hip_line),
            half: outline.half_width(),
            outline,
        }
    }
    pub(super) fn point(&self, p: [f32; 2]) -> P3 {
        let (tube, settings) = (&self.settings.tube, self.settings.leg);
        let (left, front) = (sign(self.side), if self.front { 1.0 } else { -1.0 });
        // Share of the row from the inner to the outer side.
        let [lo, hi] = self.outline.span(p[1]);
        let outer_is_high = (self.side == Side::Left) == self.front;
        let t = ((p[0] - lo) / (hi - lo).max(LEAST_WIDTH)).clamp(0.0, 1.0);
        let t = if outer_is_high { t } else { 1.0 - t };
        let y = self.waist + p[1];

        let leg = &self.sections.legs[usize::from(self.side == Side::Right)];
        let section = leg.at(y.min(self.sections.heights.crotch - settings.top));
        let Ellipse { center: c, half } =
            Ellipse::around(&section, 2.0 * (hi - lo).min(2.0 * self.half), tube);
        let on_leg = [
            c[0] - left * half[0] * (PI * t).cos(),
            c[1] + front * half[1] * (PI * t).sin(),
        ];
        let Ellipse { center: c, half } =
            Ellipse::around(&self.sections.lower.at(y), HALF_PANELS * (hi - lo), tube);
        let on_hip = [
            c[0] + left * half[0] * (FRAC_PI_2 * t).sin(),
            c[1] + front * half[1] * (FRAC_PI_2 * t).cos(),
        ];

        let share = ((p[1] - self.rise) / (self.hip_line - self.rise)).clamp(0.0, 1.0);
        let share = share * share * (3.0 - 2.0 * share);
        let mix = |k: usize| on_leg[k] + (on_hip[k] - on_leg[k]) * share;
        // Each trouser leg stays on its own side where the thighs touch.
        P3::new(left * (left * mix(0)).max(settings.inseam_gap), y, mix(1))
    }
}

/// Height of y = 0 of trouser panels: their crotch is at the body's, or their waist is.
pub(super) fn leg_waist(body: &PlacedBody<'_>) -> f32 {
    let heights = &body.sections.heights;
    let mut panels = body.pattern.panels.iter();
    let rise = panels.find_map(|p| ends(p, "inseam"));
    let rise = rise.map_or(DEFAULT_RISE, |[a, b]| a[1].max(b[1])) as f32;
    (heights.fork - CROTCH_CLEARANCE as f32 - rise).min(heights.waist)
}

/// Height of the upper end of a landmark edge of a panel; of a cuff, of the panel on the same place that has it.
fn landmark(body: &PlacedBody<'_>, panel: &Panel, name: &str, default: f64) -> f32 {
    let panels = body.pattern.panels.iter();
    let others = panels.filter(|p| p.placement == panel.placement);
    let mut found = std::iter::once(panel).chain(others);
    let edge = found.find_map(|p| ends(p, name));
    edge.map_or(default, |[a, b]| a[1].max(b[1])) as f32
}
