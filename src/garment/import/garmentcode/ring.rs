//! Rings of panels around hips and waist: the part of the turn that each panel covers.

use super::super::settings::ImportSettings;
use super::figure::{DrawnPanel, edge_points};
use super::region::{CoveredPart, fault};
use crate::GarmentError;
use std::f64::consts::{PI, TAU};

/// Distance between two sewn edges of a panel over its width from which they are its two sides; those of a dart are nearer.
const ACROSS: f64 = 0.8;

/// A panel's part of a ring.
#[derive(Clone, Copy, Debug)]
pub(super) struct RingPart {
    /// Azimuth of its right and left end seen from above: from, to; radians, 0 in front, positive to the left.
    pub(super) sector: [f64; 2],
    /// Length of its upper side without darts, metres.
    pub(super) upper: f64,
    /// The upper side is curved: rows of the panel are arcs.
    pub(super) is_arc: bool,
    /// Height of the ring's highest point.
    pub(super) high: f64,
}

/// Part of each panel in its ring; `None` for panels that are in none: inserts, and panels of other regions.
///
/// # Errors
/// A ring of one panel.
pub(super) fn rings(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
    settings: &ImportSettings,
) -> Result<Vec<Option<RingPart>>, GarmentError> {
    let beside = |a: usize, b: usize| {
        let turn = (panels[a].azimuth() - panels[b].azimuth()).rem_euclid(TAU);
        let level = (panels[a].high - panels[b].high).abs() < settings.ring_level;
        level && turn.min(TAU - turn) > settings.ring_turn && regions[b] == CoveredPart::Hips
    };
    let mut out = vec![None; panels.len()];
    let mut seen = vec![false; panels.len()];
    for k in 0..panels.len() {
        if regions[k] != CoveredPart::Hips || seen[k] {
            continue;
        }
        let mut ring = vec![k];
        seen[k] = true;
        let mut i = 0;
        while i < ring.len() {
            let p = ring[i];
            for n in &panels[p].neighbours {
                if !seen[n.panel] && beside(p, n.panel) {
                    seen[n.panel] = true;
                    ring.push(n.panel);
                }
            }
            i += 1;
        }
        if ring.len() > 1 {
            share(panels, &mut ring, &beside, &mut out);
        } else if is_tube(panels, k) {
            let why = "it is a tube of one panel: cut it into a front and a back";
            return Err(fault(&panels[k], why));
        }
    }
    Ok(out)
}

/// True for a panel whose left side is sewn to its right side.
fn is_tube(panels: &[DrawnPanel<'_>], k: usize) -> bool {
    let p = &panels[k];
    let width = p.x[1] - p.x[0];
    let own = p.neighbours.iter().filter(|n| n.panel == k);
    own.map(|n| (p.middle(n.edge) - p.middle(n.other)).norm())
        .any(|apart| apart > ACROSS * width)
}

/// Shares the turn among the panels of a ring by the lengths of their upper sides.
fn share(
    panels: &[DrawnPanel<'_>],
    ring: &mut [usize],
    beside: &dyn Fn(usize, usize) -> bool,
    out: &mut [Option<RingPart>],
) {
    ring.sort_by(|a, b| panels[*a].azimuth().total_cmp(&panels[*b].azimuth()));
    let sides: Vec<UpperSide> = ring
        .iter()
        .map(|k| upper_side(panels, *k, beside))
        .collect();
    let total: f64 = sides.iter().map(|s| s.length).sum();
    let high = ring
        .iter()
        .map(|k| panels[*k].high)
        .fold(f64::MIN, f64::max);
    let mut at = 0.0;
    let mut ends = Vec::new();
    for s in &sides {
        let next = at + TAU * s.length / total;
        ends.push([at, next]);
        at = next;
    }
    // The turn that brings the middles of the parts nearest to those of the drawn panels.
    let (sin, cos) = ring.iter().zip(&ends).fold((0.0, 0.0), |(s, c), (k, e)| {
        let off = panels[*k].azimuth() - 0.5 * (e[0] + e[1]);
        (s + off.sin(), c + off.cos())
    });
    let off: f64 = f64::atan2(sin, cos);
    for ((k, side), e) in ring.iter().zip(sides).zip(ends) {
        let middle = 0.5 * (e[0] + e[1]) + off;
        let middle = (middle + PI).rem_euclid(TAU) - PI;
        let half = 0.5 * (e[1] - e[0]);
        out[*k] = Some(RingPart {
            sector: [middle - half, middle + half],
            upper: side.length,
            is_arc: side.is_arc,
            high,
        });
    }
}

struct UpperSide {
    length: f64,
    is_arc: bool,
}

/// Largest sag of a straight upper side over its length.
const STRAIGHT: f64 = 0.12;

/// The higher of the two sides between a panel's seams with its neighbours in the ring, without darts.
fn upper_side(
    panels: &[DrawnPanel<'_>],
    k: usize,
    beside: &dyn Fn(usize, usize) -> bool,
) -> UpperSide {
    let p = &panels[k];
    let n = p.raw.edges.len();
    let sewn = |e: usize| p.neighbours.iter().find(|s| s.edge == e);
    let lateral: Vec<bool> = (0..n)
        .map(|e| sewn(e).is_some_and(|s| s.panel != k && beside(k, s.panel)))
        .collect();
    let dart = |e: usize| sewn(e).is_some_and(|s| s.panel == k);
    let start = lateral.iter().position(|l| *l).unwrap_or(0);
    let mut best = (f64::MIN, Vec::new());
    let mut run: Vec<usize> = Vec::new();
    for i in 1..=n {
        let e = (start + i) % n;
        if !lateral[e] {
            run.push(e);
            continue;
        }
        let kept: Vec<usize> = run.drain(..).filter(|e| !dart(*e)).collect();
        let height = kept.iter().map(|e| p.middle(*e).y).sum::<f64>() / kept.len() as f64;
        if !kept.is_empty() && height > best.0 {
            best = (height, kept);
        }
    }
    let points: Vec<Vec<[f64; 2]>> = best.1.iter().map(|e| edge_points(p.raw, *e)).collect();
    let length = points
        .iter()
        .flat_map(|e| e.windows(2))
        .map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]))
        .sum();
    let heights = points.iter().flatten().map(|q| p.flat(*q)[1]);
    let [low, high] = heights.fold([f64::MAX, f64::MIN], |[l, h], y| [l.min(y), h.max(y)]);
    UpperSide {
        length,
        is_arc: high - low > STRAIGHT * length,
    }
}
