//! Flat coordinates of drawn panels as their places on the body ask for them (see [`Placement`]).

use super::super::settings::ImportSettings;
use super::figure::DrawnPanel;
use super::region::{CoveredPart, fault, is_sewn_to_other};
use super::ring::RingPart;
use super::shoulders::{shoulder_seams, side_seam_tops};
use crate::{GarmentError, Placement, Side};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Map of one panel's coordinates in the file to those of its place, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlatChart {
    pub(super) placement: Placement,
    /// Part of the turn around the body part that its rows cover, radians.
    pub(super) sector: Option<[f64; 2]>,
    /// Rows of the matrix from flat coordinates, and the offset.
    rows: [[f64; 2]; 2],
    offset: [f64; 2],
}

impl FlatChart {
    fn upright(placement: Placement, offset: [f64; 2]) -> Self {
        Self {
            placement,
            sector: None,
            rows: [[1.0, 0.0], [0.0, 1.0]],
            offset,
        }
    }
    pub(super) fn point(&self, panel: &DrawnPanel<'_>, q: [f64; 2]) -> [f64; 2] {
        let f = panel.flat(q);
        std::array::from_fn(|k| self.rows[k][0] * f[0] + self.rows[k][1] * f[1] + self.offset[k])
    }
    /// Mirror image at x = 0.
    pub(super) fn mirrored(mut self) -> Self {
        self.rows[0] = self.rows[0].map(|c| -c);
        self.offset[0] = -self.offset[0];
        self
    }
}

/// Charts of all panels.
///
/// # Errors
/// A sleeve whose direction cannot be told.
pub(super) fn charts(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
    parts: &[Option<RingPart>],
    settings: &ImportSettings,
) -> Result<Vec<FlatChart>, GarmentError> {
    let shoulder = shoulder_height(panels, regions, settings);
    let top = |wanted: &dyn Fn(CoveredPart) -> bool| {
        let wanted = panels.iter().zip(regions).filter(|(_, r)| wanted(**r));
        wanted.map(|(p, _)| p.high).fold(f64::MIN, f64::max)
    };
    let (hips, legs) = (
        top(&|r| r == CoveredPart::Hips),
        top(&|r| matches!(r, CoveredPart::Leg(_))),
    );
    let mut out = Vec::with_capacity(panels.len());
    for (k, p) in panels.iter().enumerate() {
        let front = p.is_in_front();
        let chart = match regions[k] {
            CoveredPart::Trunk if front => {
                FlatChart::upright(Placement::TrunkFront, [0.0, -shoulder])
            }
            CoveredPart::Trunk => FlatChart::upright(Placement::TrunkBack, [0.0, -shoulder]),
            CoveredPart::Leg(s) if front => {
                FlatChart::upright(Placement::LegFront(s), [0.0, -legs])
            }
            CoveredPart::Leg(s) => FlatChart::upright(Placement::LegBack(s), [0.0, -legs]),
            CoveredPart::Neck => FlatChart::upright(Placement::Collar, [0.0, -shoulder]),
            CoveredPart::Head(s) => {
                FlatChart::upright(Placement::Hood(s), [-p.flat([0.0; 2])[0], -shoulder])
            }
            CoveredPart::Hips => {
                let ahead = p.azimuth().abs() <= FRAC_PI_2;
                let place = if ahead {
                    Placement::SkirtFront
                } else {
                    Placement::SkirtBack
                };
                FlatChart {
                    sector: parts[k].map(|r| r.sector),
                    ..FlatChart::upright(place, [0.0, -hips])
                }
            }
            CoveredPart::Arm(side) => sleeve(panels, regions, k, side)?,
        };
        out.push(chart);
    }
    close_gaps(panels, regions, &mut out);
    Ok(out)
}

/// Height of the high point of the shoulder: the top of a trunk with shoulder seams; for one without, the figure's, or as far
/// over its side seams as the armpit is below it.
pub(super) fn shoulder_height(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
    settings: &ImportSettings,
) -> f64 {
    let trunk = || (0..panels.len()).filter(|k| regions[*k] == CoveredPart::Trunk);
    let top = trunk().map(|k| panels[k].high).fold(f64::MIN, f64::max);
    if top == f64::MIN {
        return settings.figure_shoulder;
    }
    if !shoulder_seams(panels, regions).is_empty() {
        return top;
    }
    let sides = side_seam_tops(panels, regions).into_iter();
    let side = sides.reduce(f64::max).unwrap_or(top);
    settings.figure_shoulder.max(side + settings.armpit_below)
}

/// Chart of a panel around an arm: y falls along the arm, x runs around it from the overarm seam.
fn sleeve(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
    k: usize,
    side: Side,
) -> Result<FlatChart, GarmentError> {
    let p = &panels[k];
    let (_, along) = overarm(panels, regions, side).ok_or_else(|| {
        let why = "a sleeve has a front and a back that are sewn together over and under the arm";
        fault(p, why)
    })?;
    let a = p.flat_direction(along);
    let length = a[0].hypot(a[1]).max(f64::MIN_POSITIVE);
    let a = a.map(|c| c / length);
    // Across the sleeve, away from the overarm seam: downwards and to the body.
    let inwards = if side == Side::Left { -1.0 } else { 1.0 };
    let down = p.flat_direction(Vector3::new(0.5 * inwards, -1.0, 0.0));
    let b = [-a[1], a[0]];
    let b = if b[0] * down[0] + b[1] * down[1] < 0.0 {
        b.map(|c| -c)
    } else {
        b
    };
    let is_back = !p.is_in_front();
    let sign = if is_back == (side == Side::Left) {
        1.0
    } else {
        -1.0
    };
    let points: Vec<[f64; 2]> = p.raw.vertices.iter().map(|v| p.flat(*v)).collect();
    let least = |d: [f64; 2]| {
        points
            .iter()
            .map(|q| q[0] * d[0] + q[1] * d[1])
            .fold(f64::MAX, f64::min)
    };
    let (start, top) = (least(a), least(b));
    let is_cuff = !is_sewn_to_other(panels, regions, k);
    Ok(FlatChart {
        placement: Placement::Sleeve(side),
        sector: is_cuff.then_some(if sign > 0.0 { [0.0, PI] } else { [-PI, 0.0] }),
        rows: [b.map(|c| sign * c), a.map(|c| -c)],
        offset: [-sign * top, start],
    })
}

/// The overarm seam of the sleeve of one side: its longest edge's inner end and direction to the hand.
fn overarm(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
    side: Side,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let arm = CoveredPart::Arm(side);
    let main = |k: &usize| regions[*k] == arm && is_sewn_to_other(panels, regions, *k);
    let mut seams: Vec<[Vector3<f64>; 2]> = Vec::new();
    for k in (0..panels.len()).filter(main) {
        let p = &panels[k];
        let partner = p.neighbours.iter().filter(|n| {
            regions[n.panel] == arm && panels[n.panel].is_in_front() != p.is_in_front()
        });
        let edges: Vec<usize> = partner.map(|n| n.edge).collect();
        let mean = edges.iter().map(|e| p.middle(*e).y).sum::<f64>() / edges.len() as f64;
        let over = edges.iter().filter(|e| p.middle(**e).y >= mean);
        seams.extend(over.map(|e| p.raw.edges[*e].ends.map(|v| p.in_space(p.raw.vertices[v]))));
    }
    let longest = seams.into_iter().max_by(|a, b| {
        let length = |s: &[Vector3<f64>; 2]| (s[1] - s[0]).norm();
        length(a).total_cmp(&length(b))
    })?;
    let [inner, outer] = if longest[0].x.abs() <= longest[1].x.abs() {
        longest
    } else {
        [longest[1], longest[0]]
    };
    let along = outer - inner;
    (along.norm() > 0.0).then(|| (inner, along.normalize()))
}

/// Moves cuffs along their limb until they meet the panel that they hang on.
fn close_gaps(panels: &[DrawnPanel<'_>], regions: &[CoveredPart], charts: &mut [FlatChart]) {
    let is_limb = |k: usize| matches!(regions[k], CoveredPart::Arm(_) | CoveredPart::Leg(_));
    let mut done: Vec<bool> = (0..panels.len())
        .map(|k| !is_limb(k) || is_sewn_to_other(panels, regions, k))
        .collect();
    let height = |charts: &[FlatChart], k: usize, e: usize| {
        let ends = panels[k].raw.edges[e]
            .ends
            .map(|v| panels[k].raw.vertices[v]);
        let [a, b] = ends.map(|q| charts[k].point(&panels[k], q)[1]);
        0.5 * (a + b)
    };
    let mut changed = true;
    while changed {
        changed = false;
        for k in 0..panels.len() {
            let held = panels[k].neighbours.iter().find(|n| {
                done[n.panel]
                    && regions[n.panel] == regions[k]
                    && panels[n.panel].is_in_front() == panels[k].is_in_front()
            });
            if let (false, Some(n)) = (done[k], held) {
                let gap = height(charts, n.panel, n.other) - height(charts, k, n.edge);
                charts[k].offset[1] += gap;
                done[k] = true;
                changed = true;
            }
        }
    }
}
