//! Panels as they are drawn around a figure: points in space, outward frames, neighbours across the seams.

use super::super::settings::ImportSettings;
use crate::{Curve, PanelEdge, Side};
use nalgebra::{Rotation3, Vector3};
use tryon_formats::garmentcode::{RawCurve, RawEdge, RawPanel, RawPattern};

/// Points of an edge in space by which its panel is measured.
const EDGE_POINTS: usize = 8;
/// Length of the vertical's projection on a panel below which the panel lies flat.
const FLAT: f64 = 0.2;

/// A seam from one panel to another (or to itself).
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbour {
    /// Own edge.
    pub(super) edge: usize,
    /// The other panel and its edge.
    pub(super) panel: usize,
    pub(super) other: usize,
    /// The right side of one meets the wrong side of the other.
    pub(super) wrong_side: bool,
}

/// A drawn panel: metres, y up, z to the front, y = 0 at the floor of the figure.
#[derive(Clone, Debug)]
pub(super) struct DrawnPanel<'a> {
    pub(super) raw: &'a RawPanel,
    /// Lowest and highest point.
    pub(super) low: f64,
    pub(super) high: f64,
    /// Smallest and largest x.
    pub(super) x: [f64; 2],
    pub(super) centre: Vector3<f64>,
    /// Outward normal.
    pub(super) normal: Vector3<f64>,
    /// In-plane directions seen from outside: to the right, and up.
    right: Vector3<f64>,
    up: Vector3<f64>,
    /// Highest point.
    top: Vector3<f64>,
    /// Height of the figure's floor in the file.
    floor: f64,
    pub(super) neighbours: Vec<Neighbour>,
}

/// All panels of a pattern around a figure that stands on y = 0.
///
/// GarmentCode draws around a figure that stands on the floor, its first data set around one whose waist is the origin: the
/// middle of a garment's height tells them apart.
pub(super) fn draw<'a>(raw: &'a RawPattern, settings: &ImportSettings) -> Vec<DrawnPanel<'a>> {
    let heights = raw.panels.iter().flat_map(outline_in_space);
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p.y), h.max(p.y)));
    let floor = if 0.5 * (low + high) < settings.figure_middle {
        -settings.figure_waist
    } else {
        0.0
    };
    let panels = raw.panels.iter().enumerate();
    panels
        .map(|(k, p)| DrawnPanel::new(p, floor, neighbours(raw, k)))
        .collect()
}

fn neighbours(raw: &RawPattern, panel: usize) -> Vec<Neighbour> {
    let mut out = Vec::new();
    for s in &raw.stitches {
        let [a, b] = s.sides;
        for ((p, edge), (q, other)) in [(a, b), (b, a)] {
            if p == panel {
                out.push(Neighbour {
                    edge,
                    panel: q,
                    other,
                    wrong_side: s.wrong_side,
                });
            }
        }
    }
    out
}

fn rotation(p: &RawPanel) -> Rotation3<f64> {
    let [x, y, z] = p.rotation.map(f64::to_radians);
    Rotation3::from_euler_angles(x, y, z)
}

fn in_space(p: &RawPanel, q: [f64; 2]) -> Vector3<f64> {
    rotation(p) * Vector3::new(q[0], q[1], 0.0) + Vector3::from(p.translation)
}

/// Points along the outline, in the file's frame.
fn outline_in_space(p: &RawPanel) -> Vec<Vector3<f64>> {
    let edges = 0..p.edges.len();
    edges
        .flat_map(|e| edge_points(p, e).into_iter().take(EDGE_POINTS))
        .map(|q| in_space(p, q))
        .collect()
}

/// Points along an edge at equal arc length, coordinates of the file's panel, metres.
pub(super) fn edge_points(p: &RawPanel, edge: usize) -> Vec<[f64; 2]> {
    let e = &p.edges[edge];
    let [a, b] = e.ends.map(|v| p.vertices[v]);
    let edge = PanelEdge {
        name: String::new(),
        from: a,
        curve: curve(e, a, b),
    };
    edge.sample(b, EDGE_POINTS)
}

impl<'a> DrawnPanel<'a> {
    fn new(raw: &'a RawPanel, floor: f64, neighbours: Vec<Neighbour>) -> Self {
        let lift = |p: Vector3<f64>| p - Vector3::new(0.0, floor, 0.0);
        let points: Vec<_> = outline_in_space(raw).into_iter().map(lift).collect();
        let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let over = |f: &dyn Fn(&Vector3<f64>) -> f64| {
            points
                .iter()
                .map(f)
                .fold([f64::MAX, f64::MIN], |[l, h], v| [l.min(v), h.max(v)])
        };
        let ([low, high], x) = (over(&|p| p.y), over(&|p| p.x));
        let highest = points
            .iter()
            .copied()
            .reduce(|a, b| if b.y > a.y { b } else { a });
        let turn = rotation(raw);
        let mut normal = turn * Vector3::z();
        if normal.x * centre.x + normal.z * centre.z < 0.0 {
            normal = -normal;
        }
        let upward = Vector3::y() - normal * normal.y;
        let up = if upward.norm() > FLAT {
            upward.normalize()
        } else {
            turn * Vector3::y()
        };
        Self {
            raw,
            low,
            high,
            x,
            centre,
            normal,
            right: up.cross(&normal),
            up,
            top: highest.unwrap_or(centre),
            floor,
            neighbours,
        }
    }
    /// Side of the body that the panel's middle is on.
    pub(super) fn side(&self) -> Side {
        if self.centre.x >= 0.0 {
            Side::Left
        } else {
            Side::Right
        }
    }
    /// Distance of the nearest point from the sagittal plane, metres; 0 if the panel crosses it.
    pub(super) fn off_middle(&self) -> f64 {
        self.x[0].max(-self.x[1]).max(0.0)
    }
    /// Direction of the middle around the body: 0 in front, positive to the left, radians.
    pub(super) fn azimuth(&self) -> f64 {
        self.centre.x.atan2(self.centre.z)
    }
    pub(super) fn is_in_front(&self) -> bool {
        self.centre.z >= 0.0
    }
    /// Point in the figure's frame.
    pub(super) fn in_space(&self, q: [f64; 2]) -> Vector3<f64> {
        in_space(self.raw, q) - Vector3::new(0.0, self.floor, 0.0)
    }
    /// Middle of an edge in the figure's frame.
    pub(super) fn middle(&self, edge: usize) -> Vector3<f64> {
        let points = edge_points(self.raw, edge);
        let sum = points
            .iter()
            .map(|q| self.in_space(*q))
            .sum::<Vector3<f64>>();
        sum / points.len() as f64
    }
    /// Flat coordinates seen from outside: x to the right, y up the panel, equal to the height at its highest point.
    pub(super) fn flat(&self, q: [f64; 2]) -> [f64; 2] {
        let p = self.in_space(q);
        [
            p.dot(&self.right),
            (p - self.top).dot(&self.up) + self.top.y,
        ]
    }
    /// Flat direction of a direction in space.
    pub(super) fn flat_direction(&self, d: Vector3<f64>) -> [f64; 2] {
        [d.dot(&self.right), d.dot(&self.up)]
    }
}

/// Shape of an edge from `a` to `b`, coordinates of the file's panel.
pub(super) fn curve(e: &RawEdge, a: [f64; 2], b: [f64; 2]) -> Curve {
    let d = [b[0] - a[0], b[1] - a[1]];
    let absolute = |r: [f64; 2]| {
        [
            a[0] + r[0] * d[0] - r[1] * d[1],
            a[1] + r[0] * d[1] + r[1] * d[0],
        ]
    };
    match e.curve {
        RawCurve::Line => Curve::Line,
        RawCurve::Quadratic(c) => {
            let c = absolute(c);
            let third = |p: [f64; 2]| {
                [
                    p[0] + (c[0] - p[0]) * 2.0 / 3.0,
                    p[1] + (c[1] - p[1]) * 2.0 / 3.0,
                ]
            };
            Curve::Cubic(third(a), third(b))
        }
        RawCurve::Cubic(c, f) => Curve::Cubic(absolute(c), absolute(f)),
        RawCurve::Circle(radius, large, right) => {
            // Half the angle of the arc; a chord longer than the diameter is a half circle.
            let chord = d[0].hypot(d[1]);
            let half = (chord / (2.0 * radius)).min(1.0).asin();
            let half = if large {
                std::f64::consts::PI - half
            } else {
                half
            };
            let sagitta = radius * (1.0 - half.cos()) / chord;
            Curve::Arc(absolute([0.5, if right { -sagitta } else { sagitta }]))
        }
    }
}
