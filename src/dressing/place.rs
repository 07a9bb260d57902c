//! Where the panels start: wrapped around the canonical body, seams closed.

use super::figure::{Figure, Slice};
use crate::body::Template;
use crate::body::parts::BodySegment;
use crate::garment::{GarmentMesh, Pattern, Placement, Region, Side};
use crate::math::P3;

/// Distance of the legs of trousers from the middle, at least, metres: placed in each other they would pass through each
/// other from the start.
const APART: f32 = 0.001;
/// Room between body and cloth at the start, metres.
const ROOM: f32 = 0.015;
/// Depth over which a shirt turns over the shoulder, metres.
const SHOULDER_ROUND: f32 = 0.10;

/// Start positions of the simulation vertices, frame of the canonical body (root identity), metres.
pub(super) fn place(
    template: &Template,
    figure: &Figure,
    pattern: &Pattern,
    mesh: &GarmentMesh,
) -> Vec<P3> {
    let charts: Vec<Chart> = pattern
        .panels
        .iter()
        .map(|p| Chart::new(template, figure, pattern, p))
        .collect();
    mesh.corners
        .iter()
        .map(|c| {
            let sum = c.iter().fold(nalgebra::Vector3::zeros(), |s, (panel, q)| {
                s + charts[usize::from(*panel)]
                    .at([q[0] as f32, q[1] as f32])
                    .coords
            });
            P3::from(sum / c.len() as f32)
        })
        .collect()
}

/// How one panel lies in space.
struct Chart<'a> {
    figure: &'a Figure,
    placement: Placement,
    outline: Vec<[f32; 2]>,
    kind: Kind,
}

enum Kind {
    Trunk {
        top: f32,
        shoulder_z: f32,
        half: f32,
        armpit: f32,
        tip: f32,
        neck: f32,
        fall: f32,
    },
    /// A ring sector: rows are arcs about (0, apex).
    Skirt {
        waist: f32,
        apex: f32,
        half_angle: f32,
    },
    /// Rows are level.
    Band { waist: f32 },
    Hood {
        top: f32,
        nape: f32,
        width: f32,
        crown: Vec<[f32; 2]>,
    },
    Leg {
        waist: f32,
        rise: f32,
        hip_line: f32,
        garment_half: f32,
    },
    Sleeve {
        axis: Vec<P3>,
        start: f32,
        bicep: f32,
        cap: f32,
        radius: Vec<[f32; 2]>,
    },
}

fn ellipse(slice: &Slice, girth: f32) -> ([f32; 2], [f32; 2]) {
    let c = [
        (slice.x[0] + slice.x[1]) / 2.0,
        (slice.z[0] + slice.z[1]) / 2.0,
    ];
    let (mut a, mut b) = (
        (slice.x[1] - slice.x[0]) / 2.0 + ROOM,
        (slice.z[1] - slice.z[0]) / 2.0 + ROOM,
    );
    // Ramanujan's perimeter; a wider garment starts wider, so that nothing is crumpled to begin with.
    let h = ((a - b) / (a + b)).powi(2);
    let around = std::f32::consts::PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
    let wider = (girth / around).clamp(1.0, 1.6);
    a *= wider;
    b *= wider;
    (c, [a, b])
}

/// As [`ellipse`], but room to spare goes all around: a skirt hangs round.
fn round(slice: &Slice, girth: f32) -> ([f32; 2], [f32; 2]) {
    let (c, [mut a, mut b]) = ellipse(slice, 0.0);
    let r = girth / (2.0 * std::f32::consts::PI);
    // The circle of that girth where it goes around the body; else the body's own shape.
    a = a.max(r.min(a.max(b) * 2.0));
    b = b.max(r.min(a.max(b) * 2.0));
    (c, [a, b])
}

impl<'a> Chart<'a> {
    fn new(
        template: &Template,
        figure: &'a Figure,
        pattern: &Pattern,
        panel: &crate::garment::Panel,
    ) -> Self {
        let outline: Vec<[f32; 2]> = (0..panel.edges.len())
            .flat_map(|i| panel.edges[i].sample(panel.end(i), 12).into_iter().take(12))
            .map(|p| [p[0] as f32, p[1] as f32])
            .collect();
        let corner = |name: &str| {
            panel
                .edge(name)
                .map(|i| (panel.edges[i].from, panel.end(i)))
        };
        let kind = match panel.placement {
            Placement::TrunkFront | Placement::TrunkBack => {
                let [neck, tip] = shoulder_ends(pattern).unwrap_or([[0.08, 0.0], [0.2, -0.04]]);
                // The underarm point: the highest corner outside the shoulder tip.
                let armpit = corner("armhole_right").map(|c| c.0).unwrap_or_else(|| {
                    let outside = panel.edges.iter().map(|e| [e.from[0].abs(), e.from[1]]);
                    let outside = outside.filter(|p| p[0] > tip[0] + 0.01 && p[1] < tip[1] - 0.05);
                    outside
                        .max_by(|a, b| a[1].total_cmp(&b[1]))
                        .unwrap_or([0.26, -0.22])
                });
                let (top, shoulder_z) = seam_line(template, figure, pattern);
                Kind::Trunk {
                    top,
                    shoulder_z,
                    half: armpit[0] as f32,
                    armpit: armpit[1] as f32,
                    tip: tip[0] as f32,
                    neck: neck[0] as f32,
                    fall: -tip[1] as f32,
                }
            }
            Placement::SkirtFront | Placement::SkirtBack => {
                let points: Vec<[f64; 2]> = (0..panel.edges.len())
                    .filter(|i| panel.edges[*i].name.starts_with("waist"))
                    .flat_map(|i| panel.edges[i].sample(panel.end(i), 8))
                    .collect();
                let end = points
                    .iter()
                    .copied()
                    .fold([0.0, 0.02], |e, p| if p[0] > e[0] { p } else { e });
                let middle = points.iter().map(|p| p[1]).fold(end[1], f64::min);
                let curved = panel
                    .edge("hem")
                    .is_some_and(|i| panel.edges[i].curve != crate::garment::Curve::Line);
                let sag = (end[1] - middle).max(1e-4);
                let apex = ((end[0] * end[0] + sag * sag) / (2.0 * sag)) as f32;
                let half_angle = (end[0] as f32).atan2(apex - sag as f32);
                let girth = if pattern.finished[1] > 0.0 {
                    pattern.finished[1] as f32
                } else {
                    4.0 * end[0] as f32
                };
                let waist = match sewn_waist(template, figure, pattern) {
                    Some(waist) => waist,
                    None => {
                        // As high as it goes: at the waist, or where the hip becomes as wide as the waistband.
                        let mut waist = figure.levels.waist;
                        while waist > figure.levels.hip + 0.05
                            && figure.lower.at(waist).girth < girth - 0.01
                        {
                            waist -= 0.01;
                        }
                        waist
                    }
                };
                if curved {
                    Kind::Skirt {
                        waist,
                        apex,
                        half_angle,
                    }
                } else {
                    Kind::Band { waist }
                }
            }
            Placement::Hood(_) => {
                let (top, _) = seam_line(template, figure, pattern);
                let crown: Vec<[f64; 2]> = (0..panel.edges.len())
                    .filter(|i| panel.edges[*i].name.starts_with("crown"))
                    .flat_map(|i| panel.edges[i].sample(panel.end(i), 24))
                    .collect();
                // The head: everything well above the shoulders.
                let width = figure
                    .vertices
                    .iter()
                    .filter(|p| p.y > top + 0.10)
                    .map(|p| p.x.abs())
                    .fold(0.0, f32::max);
                Kind::Hood {
                    top,
                    nape: figure.trunk.at(top + 0.01).z[0] - ROOM,
                    width: width + ROOM,
                    crown: crown.iter().map(|p| p.map(|c| c as f32)).collect(),
                }
            }
            Placement::LegFront(_) | Placement::LegBack(_) => {
                let rise = corner("inseam").map_or(-0.29, |c| c.0[1].max(c.1[1])) as f32;
                let hip_line = corner("crotch").map_or(-0.2, |c| c.0[1].max(c.1[1])) as f32;
                /// The cloth's crotch starts this far below the body's, metres.
                const BELOW: f32 = 0.012;
                let garment_half = outline.iter().map(|p| p[0].abs()).fold(0.0, f32::max);
                Kind::Leg {
                    waist: (figure.levels.fork - BELOW - rise).min(figure.levels.waist),
                    rise,
                    hip_line,
                    garment_half,
                }
            }
            Placement::Sleeve(side) => {
                let bicep = outline.iter().map(|p| p[0].abs()).fold(0.0, f32::max);
                let cap = outline
                    .iter()
                    .filter(|p| p[0].abs() > 0.97 * bicep)
                    .map(|p| p[1])
                    .fold(f32::MIN, f32::max);
                sleeve(template, figure, pattern, side, bicep, cap)
            }
        };
        Self {
            figure,
            placement: panel.placement,
            outline,
            kind,
        }
    }
    /// Leftmost and rightmost x of the outline at a height of the panel.
    fn span(&self, y: f32) -> [f32; 2] {
        let n = self.outline.len();
        let mut span = [f32::MAX, f32::MIN];
        for i in 0..n {
            let (a, b) = (self.outline[i], self.outline[(i + 1) % n]);
            if (a[1] <= y) != (b[1] <= y) {
                let x = a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]);
                span = [span[0].min(x), span[1].max(x)];
            }
        }
        if span[0] > span[1] {
            // At the very top or bottom: the corner itself.
            let nearest = self
                .outline
                .iter()
                .map(|p| (p[1] - y).abs())
                .fold(f32::MAX, f32::min);
            for p in self
                .outline
                .iter()
                .filter(|p| (p[1] - y).abs() <= nearest + 1e-4)
            {
                span = [span[0].min(p[0]), span[1].max(p[0])];
            }
        }
        span
    }
    /// A point of a tube of this girth around the lower body, `turn` from the middle of front or back to the side.
    fn around(&self, y: f32, turn: f32, girth: f32) -> P3 {
        let front = matches!(self.placement, Placement::SkirtFront);
        let (c, [a, b]) = round(&self.figure.lower.at(y), girth);
        let side = if front { 1.0 } else { -1.0 };
        P3::new(
            c[0] + side * a * turn.sin(),
            y,
            c[1] + side * b * turn.cos(),
        )
    }
    fn at(&self, p: [f32; 2]) -> P3 {
        use std::f32::consts::{FRAC_PI_2, PI};
        match &self.kind {
            Kind::Trunk {
                top,
                shoulder_z,
                half,
                armpit,
                tip,
                neck,
                fall,
            } => {
                let front = self.placement == Placement::TrunkFront;
                let x = if front { p[0] } else { -p[0] };
                let y = top + p[1];
                let width = if p[1] < *armpit {
                    self.span(p[1])
                        .map(f32::abs)
                        .into_iter()
                        .fold(0.05, f32::max)
                } else {
                    *half
                };
                let slice = if p[1] < *armpit - 0.05 {
                    self.figure.lower.at(y)
                } else {
                    self.figure.trunk.at(y)
                };
                let (c, [a, b]) = ellipse(&slice, 4.0 * width);
                let angle = FRAC_PI_2 * (x / width).clamp(-1.0, 1.0);
                let up = ((p[1] - armpit) / (-fall - armpit)).clamp(0.0, 1.0);
                let wx = (1.0 - up) * (c[0] + a * angle.sin()) + up * x;
                let ellipse_z = c[1] + if front { b } else { -b } * angle.cos();
                let line = -fall * ((x.abs() - neck) / (tip - neck)).clamp(0.0, 1.0);
                let below = ((line - p[1]) / SHOULDER_ROUND).clamp(0.0, 1.0);
                let round = (1.0 - (1.0 - below).powi(2)).sqrt();
                P3::new(wx, y, shoulder_z + (ellipse_z - shoulder_z) * round)
            }
            Kind::Skirt {
                waist,
                apex,
                half_angle,
            } => {
                let (r, angle) = (p[0].hypot(apex - p[1]), p[0].atan2(apex - p[1]));
                let turn = (angle / half_angle).clamp(-1.0, 1.0) * FRAC_PI_2;
                self.around(waist - (r - apex) * 0.97, turn, 4.0 * half_angle * r)
            }
            Kind::Band { waist } => {
                let half = self
                    .span(p[1])
                    .map(f32::abs)
                    .into_iter()
                    .fold(0.02, f32::max);
                self.around(
                    waist + p[1],
                    (p[0] / half).clamp(-1.0, 1.0) * FRAC_PI_2,
                    4.0 * half,
                )
            }
            Kind::Hood {
                top,
                nape,
                width,
                crown,
            } => {
                let side = if self.placement == Placement::Hood(Side::Left) {
                    1.0
                } else {
                    -1.0
                };
                let far = crown
                    .iter()
                    .map(|c| (c[0] - p[0]).hypot(c[1] - p[1]))
                    .fold(f32::MAX, f32::min);
                /// How far a hood lies back, radians.
                const BACK: f32 = 2.5;
                /// Height of cloth over which it folds back, metres.
                const FOLD: f32 = 0.25;
                /// What it folds about: this far above the nape, metres.
                const RISE: f32 = 0.03;
                /// Width of cloth over which a hood turns from the crown to the side of the head, metres.
                const TURN: f32 = 0.11;
                let t = (far / TURN).clamp(0.0, 1.0);
                let out = width * (1.0 - (1.0 - t).powi(2)).sqrt();
                // Worn down: laid back behind the head from the neckline on, ever more, so that it passes nowhere through itself
                // (less high or about a point before the nape the back would turn inside out).
                let up = (p[1] / FOLD).clamp(0.0, 1.0);
                let (sin, cos) = (BACK * up * up * (3.0 - 2.0 * up)).sin_cos();
                let (y, z) = (p[1] - RISE, -side * p[0]);
                P3::new(
                    side * out,
                    top + 0.01 + RISE + y * cos + z * sin,
                    nape + z * cos - y * sin,
                )
            }
            Kind::Leg {
                waist,
                rise,
                hip_line,
                garment_half,
            } => {
                let (side, front) = match self.placement {
                    Placement::LegFront(s) => (s, true),
                    Placement::LegBack(s) => (s, false),
                    _ => (Side::Left, true),
                };
                let (left, z_sign) = (
                    if side == Side::Left { 1.0 } else { -1.0 },
                    if front { 1.0 } else { -1.0 },
                );
                // Share of the way from the inner to the outer side.
                let [lo, hi] = self.span(p[1]);
                let outer_is_high = (side == Side::Left) == front;
                let t = ((p[0] - lo) / (hi - lo).max(1e-4)).clamp(0.0, 1.0);
                let t = if outer_is_high { t } else { 1.0 - t };
                let y = waist + p[1];
                let (c, [a, b]) = ellipse(
                    &self.figure.legs[usize::from(side == Side::Right)]
                        .at(y.min(self.figure.levels.crotch - 0.04)),
                    2.0 * (hi - lo).min(2.0 * garment_half),
                );
                let leg = [
                    c[0] - left * a * (PI * t).cos(),
                    c[1] + z_sign * b * (PI * t).sin(),
                ];
                let share = ((p[1] - rise) / (hip_line - rise)).clamp(0.0, 1.0);
                let share = share * share * (3.0 - 2.0 * share);
                let (c, [a, b]) = ellipse(&self.figure.lower.at(y), 4.0 * (hi - lo));
                let hip = [
                    c[0] + left * a * (FRAC_PI_2 * t).sin(),
                    c[1] + z_sign * b * (FRAC_PI_2 * t).cos(),
                ];
                let mix = |k: usize| leg[k] + (hip[k] - leg[k]) * share;
                // Where the thighs touch each leg of the trousers stays on its own side.
                P3::new(left * (left * mix(0)).max(APART), y, mix(1))
            }
            Kind::Sleeve {
                axis,
                start,
                bicep,
                cap,
                radius,
            } => {
                let Placement::Sleeve(side) = self.placement else {
                    return P3::origin();
                };
                let half = if p[1] > *cap {
                    *bicep
                } else {
                    self.span(p[1])
                        .map(f32::abs)
                        .into_iter()
                        .fold(0.02, f32::max)
                };
                let s = start - p[1];
                // Along the polyline shoulder, elbow, wrist.
                let (mut k, mut from) = (0, 0.0);
                while k + 2 < axis.len() && s - from > (axis[k + 1] - axis[k]).norm() {
                    from += (axis[k + 1] - axis[k]).norm();
                    k += 1;
                }
                let u = (axis[k + 1] - axis[k]).normalize();
                let centre = axis[k] + u * (s - from);
                let front = nalgebra::Vector3::z();
                let front = (front - u * u.dot(&front)).normalize();
                let up = if side == Side::Left {
                    front.cross(&u)
                } else {
                    u.cross(&front)
                };
                let i = ((s / STATION).max(0.0) as usize).min(radius.len().saturating_sub(1));
                let wide = half / PI; // radius of a round tube of the sleeve's girth
                let r = radius
                    .get(i)
                    .copied()
                    .unwrap_or([0.05; 2])
                    .map(|r| (r + ROOM).max(wide));
                let angle = PI * p[0] / half;
                let sign = if side == Side::Left { -1.0 } else { 1.0 };
                centre + up * (r[0] * angle.cos()) + front * (sign * r[1] * angle.sin())
            }
        }
    }
}

/// Distance between the places where an arm is measured, metres.
const STATION: f32 = 0.01;

fn sleeve(
    template: &Template,
    figure: &Figure,
    pattern: &Pattern,
    side: Side,
    bicep: f32,
    cap: f32,
) -> Kind {
    let name = if side == Side::Left { "left" } else { "right" };
    let joint = |n: &str| {
        template
            .skeleton()
            .index(&format!("{name}_{n}"))
            .map(|j| figure.joints[j].cast::<f32>())
    };
    let sign = if side == Side::Left { 1.0 } else { -1.0 };
    let shoulder = joint("shoulder").unwrap_or(P3::new(sign * 0.17, 1.35, 0.0));
    let elbow = joint("elbow").unwrap_or(shoulder + nalgebra::Vector3::new(sign * 0.25, -0.1, 0.0));
    let wrist = joint("wrist").unwrap_or(elbow + (elbow - shoulder));
    let axis = vec![shoulder, elbow, wrist];
    // The shirt's shoulder tip, seen along the arm.
    let tip = shoulder_ends(pattern).map_or(0.2, |[_, tip]| tip[0] as f32);
    let u = (elbow - shoulder).normalize();
    let start = (sign * tip - shoulder.x) * u.x;
    // Half sizes of the arm, up-down and front-back, at stations along it.
    let mask = if side == Side::Left {
        Region::LEFT_ARM
    } else {
        Region::RIGHT_ARM
    };
    let lengths = [(elbow - shoulder).norm(), (wrist - elbow).norm()];
    let n = ((lengths[0] + lengths[1]) / STATION) as usize + 1;
    let mut radius = vec![[0.0f32; 2]; n];
    for (p, part) in figure.vertices.iter().zip(&figure.parts) {
        if part & mask.0 == 0 {
            continue;
        }
        let (s, k) = {
            let s = (p - shoulder).dot(&u);
            if s <= lengths[0] {
                (s, 0)
            } else {
                (
                    lengths[0] + (p - elbow).dot(&(wrist - elbow).normalize()),
                    1,
                )
            }
        };
        let i = (s / STATION).floor();
        if i < 0.0 || i as usize >= n {
            continue;
        }
        let dir = (axis[k + 1] - axis[k]).normalize();
        let d = p - axis[k];
        let d = d - dir * d.dot(&dir);
        let front = d.z.abs();
        let up = (d.norm_squared() - d.z * d.z).max(0.0).sqrt();
        let r = &mut radius[i as usize];
        *r = [r[0].max(up), r[1].max(front)];
    }
    // Close to the trunk the cut is open: the arm is as thick there as 7 cm further out.
    let (first, inner) = (radius.clone(), (0.07 / STATION) as usize);
    for (i, r) in radius.iter_mut().enumerate() {
        let around = |k: usize| {
            (i.max(inner).saturating_sub(2)..(i.max(inner) + 3).min(n))
                .map(|j| first[j][k])
                .fold(0.0, f32::max)
        };
        *r = [around(0), around(1)];
    }
    Kind::Sleeve {
        axis,
        start,
        bicep,
        cap,
        radius,
    }
}

/// Neck and tip end of the shoulder seam on the wearer's left, panel coordinates, from the first panel that has one.
fn shoulder_ends(pattern: &Pattern) -> Option<[[f64; 2]; 2]> {
    pattern.panels.iter().find_map(|p| {
        let i = p
            .edges
            .iter()
            .position(|e| e.name.starts_with("shoulder"))?;
        let [a, b] = [p.end(i), p.edges[i].from].map(|q| [q[0].abs(), q[1]]);
        Some(if a[0] < b[0] { [a, b] } else { [b, a] })
    })
}

/// Height of y = 0 of the trunk's panels and the z of the shoulder seams.
fn seam_line(template: &Template, figure: &Figure, pattern: &Pattern) -> (f32, f32) {
    shoulder_line(
        template,
        figure,
        shoulder_ends(pattern).unwrap_or([[0.08, 0.0], [0.2, -0.04]]),
    )
}

/// Height of the waist of a bodice that a skirt is sewn to.
fn sewn_waist(template: &Template, figure: &Figure, pattern: &Pattern) -> Option<f32> {
    let bodice = pattern
        .panels
        .iter()
        .find(|p| p.placement == Placement::TrunkFront)?;
    let waist = bodice.edges.iter().map(|e| e.from[1]).reduce(f64::min)?;
    Some(seam_line(template, figure, pattern).0 + waist as f32)
}

/// Height of the panel's y = 0 such that the shoulder seam clears the body, and the z of the seam.
fn shoulder_line(template: &Template, figure: &Figure, seam: [[f64; 2]; 2]) -> (f32, f32) {
    /// Clearance of the shoulder seam, metres.
    const CLEAR: f32 = 0.008;
    let is_head = |v| template.parts().segment(template.weights().dominant(v)) == BodySegment::Head;
    let (x0, x1) = (seam[0][0] as f32, seam[1][0] as f32);
    let mut top = f32::MIN;
    let bins = 12;
    let mut highest = vec![(f32::MIN, 0.0f32); bins];
    for (i, p) in figure.vertices.iter().enumerate() {
        let t = (p.x.abs() - x0) / (x1 - x0);
        if !(0.0..1.0).contains(&t) || is_head(i) {
            continue;
        }
        let b = &mut highest[(t * bins as f32) as usize];
        if p.y > b.0 {
            *b = (p.y, p.z);
        }
    }
    let mut z = (0.0, 0.0);
    for (k, (y, pz)) in highest.iter().enumerate() {
        if *y == f32::MIN {
            continue;
        }
        let t = (k as f32 + 0.5) / bins as f32;
        let panel_y = (seam[0][1] as f32) * (1.0 - t) + seam[1][1] as f32 * t;
        top = top.max(y + CLEAR - panel_y);
        z = (z.0 + pz, z.1 + 1.0);
    }
    (
        if top == f32::MIN { 1.4 } else { top },
        if z.1 > 0.0 { z.0 / z.1 } else { 0.0 },
    )
}
