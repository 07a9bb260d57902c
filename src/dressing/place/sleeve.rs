//! Sleeves: tubes along the polyline shoulder, elbow, wrist.

use super::outline::PanelOutline;
use super::placed_body::{PlacedBody, sign};
use crate::settings::SleevePlaceSettings;
use std::f32::consts::PI;
use tryon_garment::{Panel, Region, Side};
use tryon_geometry::math::{P3, V3};

/// Stations on either side over which the largest arm radius counts.
const NEIGHBOURS: usize = 2;

/// Chart of one sleeve.
pub(super) struct SleeveChart {
    outline: PanelOutline,
    side: Side,
    arm: ArmShape,
    /// Clearance over the skin, metres.
    clearance: f32,
    /// Distance along the arm of the panel's y = 0.
    start: f32,
    /// Half width of the panel and the height where it has it: above is the cap.
    bicep: f32,
    cap: f32,
    /// Part of the turn that a cuff covers, from 0 on top of the arm.
    sector: Option<[f32; 2]>,
}

impl SleeveChart {
    pub(super) fn new(body: &PlacedBody<'_>, panel: &Panel, side: Side) -> Self {
        let settings = &body.settings.sleeve;
        let outline = PanelOutline::of(panel);
        let bicep = outline.half_width();
        let cap = outline
            .points()
            .iter()
            .filter(|p| p[0].abs() > settings.bicep * bicep)
            .map(|p| p[1])
            .fold(f32::MIN, f32::max);
        let arm = ArmShape::measure(body, side);
        // The garment's shoulder tip, projected onto the arm.
        let [_, tip] = body.shoulder_seam();
        let start = (sign(side) * tip[0] as f32 - arm.joints[0].x) * arm.direction(0).x;
        Self {
            outline,
            side,
            arm,
            clearance: body.settings.tube.clearance,
            start,
            bicep,
            cap,
            sector: panel.sector.map(|s| s.map(|a| a as f32)),
        }
    }
    pub(super) fn point(&self, p: [f32; 2]) -> P3 {
        let half = if p[1] > self.cap {
            self.bicep
        } else {
            self.outline
                .half_width_at(p[1], self.arm.settings.least_half)
        };
        let s = self.start - p[1];
        let upper = self.arm.upper_length();
        let (bone, along) = if s > upper { (1, s - upper) } else { (0, s) };
        let u = self.arm.direction(bone);
        let centre = self.arm.joints[bone] + u * along;
        let front = V3::z();
        let front = (front - u * u.dot(&front)).normalize();
        let up = if self.side == Side::Left {
            front.cross(&u)
        } else {
            u.cross(&front)
        };
        let row = self.outline.span(p[1]);
        let (angle, half) = match self.sector {
            None => (PI * p[0] / half, half),
            Some([from, to]) => {
                let width = (row[1] - row[0]).max(self.arm.settings.least_half);
                let share = ((p[0] - row[0]) / width).clamp(0.0, 1.0);
                (from + (to - from) * share, PI * width / (to - from))
            }
        };
        // At least the round tube of the sleeve's girth.
        let r = self
            .arm
            .radius_at(s)
            .map(|r| (r + self.clearance).max(half / PI));
        centre + up * (r[0] * angle.cos()) + front * (-sign(self.side) * r[1] * angle.sin())
    }
}

/// An arm of the canonical body and its thickness.
struct ArmShape {
    settings: SleevePlaceSettings,
    /// Shoulder, elbow, wrist.
    joints: [P3; 3],
    /// Half sizes upwards and to the front at stations along the arm, metres.
    radius: Vec<[f32; 2]>,
}

impl ArmShape {
    fn measure(body: &PlacedBody<'_>, side: Side) -> Self {
        let (name, sign) = (
            if side == Side::Left { "left" } else { "right" },
            sign(side),
        );
        let joint = |n: &str| {
            let index = body.template.skeleton().index(&format!("{name}_{n}"));
            index.map(|j| body.sections.joints[j].cast::<f32>())
        };
        let settings = body.settings.sleeve;
        let mirrored = |v: [f32; 3]| V3::new(sign * v[0], v[1], v[2]);
        let shoulder = joint("shoulder").unwrap_or(P3::from(mirrored(settings.default_shoulder)));
        let elbow = joint("elbow").unwrap_or(shoulder + mirrored(settings.default_upper_arm));
        let wrist = joint("wrist").unwrap_or(elbow + (elbow - shoulder));
        let mut out = Self {
            settings,
            joints: [shoulder, elbow, wrist],
            radius: Vec::new(),
        };
        out.radius = out.measure_radius(body, side);
        out
    }
    fn upper_length(&self) -> f32 {
        (self.joints[1] - self.joints[0]).norm()
    }
    /// Unit direction of the upper arm (0) or the forearm (1).
    fn direction(&self, bone: usize) -> V3 {
        (self.joints[bone + 1] - self.joints[bone]).normalize()
    }
    fn radius_at(&self, s: f32) -> [f32; 2] {
        let i = ((s / self.settings.station).max(0.0) as usize)
            .min(self.radius.len().saturating_sub(1));
        self.radius
            .get(i)
            .copied()
            .unwrap_or([self.settings.default_radius; 2])
    }
    fn measure_radius(&self, body: &PlacedBody<'_>, side: Side) -> Vec<[f32; 2]> {
        let mask = if side == Side::Left {
            Region::LEFT_ARM
        } else {
            Region::RIGHT_ARM
        };
        let (upper, [_, elbow, wrist]) = (self.upper_length(), self.joints);
        let directions = [self.direction(0), self.direction(1)];
        let n = ((upper + (wrist - elbow).norm()) / self.settings.station) as usize + 1;
        let mut radius = vec![[0.0f32; 2]; n];
        let own = body.sections.vertices.iter().zip(&body.sections.parts);
        for (p, _) in own.filter(|(_, part)| **part & mask.0 != 0) {
            let s = (p - self.joints[0]).dot(&directions[0]);
            let (s, bone) = if s <= upper {
                (s, 0)
            } else {
                (upper + (p - elbow).dot(&directions[1]), 1)
            };
            let i = (s / self.settings.station).floor();
            if i < 0.0 || i as usize >= n {
                continue;
            }
            let d = p - self.joints[bone];
            let d = d - directions[bone] * d.dot(&directions[bone]);
            let up = (d.norm_squared() - d.z * d.z).max(0.0).sqrt();
            let r = &mut radius[i as usize];
            *r = [r[0].max(up), r[1].max(d.z.abs())];
        }
        widen(
            &radius,
            (body.settings.armhole / self.settings.station) as usize,
        )
    }
}

/// Largest radius around each station; the first `armhole` stations take those farther out.
fn widen(radius: &[[f32; 2]], armhole: usize) -> Vec<[f32; 2]> {
    let n = radius.len();
    let around = |i: usize, k: usize| {
        let i = i.max(armhole);
        (i.saturating_sub(NEIGHBOURS)..(i + NEIGHBOURS + 1).min(n))
            .map(|j| radius[j][k])
            .fold(0.0, f32::max)
    };
    (0..n).map(|i| [around(i, 0), around(i, 1)]).collect()
}
