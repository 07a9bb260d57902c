//! Skirt panels and waistbands: rows around the lower body, arcs where the waist is curved.

use super::outline::{PanelOutline, sample_edges};
use super::placed_body::PlacedBody;
use super::tube::{Ellipse, HALF_PANELS};
use crate::body_sections::BodySections;
use crate::settings::PlaceSettings;
use std::f32::consts::FRAC_PI_2;
use tryon_garment::{Curve, Panel};
use tryon_geometry::math::P3;

/// Chords of one waist edge.
const CHORDS: usize = 8;

/// Chart of a front or back panel.
pub(super) struct SkirtChart<'a> {
    sections: &'a BodySections,
    settings: &'a PlaceSettings,
    outline: PanelOutline,
    /// 1 in front, −1 behind.
    side: f32,
    /// Height of the waist.
    waist: f32,
    rows: SkirtRows,
}

/// Shape of the rows.
enum SkirtRows {
    /// Arcs about (0, apex): a ring sector of this half angle, radians.
    Arcs { apex: f32, half_angle: f32 },
    /// Level lines.
    Level,
}

impl<'a> SkirtChart<'a> {
    pub(super) fn new(body: &PlacedBody<'a>, panel: &Panel, front: bool) -> Self {
        let settings = &body.settings.skirt;
        let points = sample_edges(panel, "waist", CHORDS);
        let end = points.iter().fold(
            settings.default_end,
            |e, p| if p[0] > e[0] { *p } else { e },
        );
        let curved = panel
            .edge("hem")
            .is_some_and(|i| panel.edges[i].curve != Curve::Line);
        let rows = if curved {
            let middle = points.iter().map(|p| p[1]).fold(end[1], f64::min);
            let sag = (end[1] - middle).max(settings.least_sag);
            let apex = ((end[0] * end[0] + sag * sag) / (2.0 * sag)) as f32;
            let half_angle = (end[0] as f32).atan2(apex - sag as f32);
            SkirtRows::Arcs { apex, half_angle }
        } else {
            SkirtRows::Level
        };
        let girth = if body.pattern.finished[1] > 0.0 {
            body.pattern.finished[1] as f32
        } else {
            HALF_PANELS * end[0] as f32
        };
        Self {
            sections: body.sections,
            settings: body.settings,
            outline: PanelOutline::of(panel),
            side: if front { 1.0 } else { -1.0 },
            waist: body
                .sewn_waist()
                .unwrap_or_else(|| waist_height(body, girth)),
            rows,
        }
    }
    pub(super) fn point(&self, p: [f32; 2]) -> P3 {
        let (y, turn, girth) = match self.rows {
            SkirtRows::Arcs { apex, half_angle } => {
                let (r, angle) = (p[0].hypot(apex - p[1]), p[0].atan2(apex - p[1]));
                (
                    self.waist - (r - apex) * self.settings.skirt.shortened,
                    (angle / half_angle).clamp(-1.0, 1.0) * FRAC_PI_2,
                    HALF_PANELS * half_angle * r,
                )
            }
            SkirtRows::Level => {
                let half = self
                    .outline
                    .half_width_at(p[1], self.settings.skirt.least_half);
                (
                    self.waist + p[1],
                    (p[0] / half).clamp(-1.0, 1.0) * FRAC_PI_2,
                    HALF_PANELS * half,
                )
            }
        };
        Ellipse::rounded(&self.sections.lower.at(y), girth, &self.settings.tube)
            .point(y, turn, self.side)
    }
}

/// Height of a waistband of this girth: the waist, or lower where the hip becomes as wide as the band, metres.
pub(super) fn waist_height(body: &PlacedBody<'_>, girth: f32) -> f32 {
    let sections = body.sections;
    let settings = &body.settings.skirt;
    let mut waist = sections.heights.waist;
    while waist > sections.heights.hip + settings.above_hip
        && sections.lower.at(waist).girth < girth - settings.waist_step
    {
        waist -= settings.waist_step;
    }
    waist
}
