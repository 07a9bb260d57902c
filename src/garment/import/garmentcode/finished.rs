//! Girths of a converted pattern at chest, waist and hip.

use super::ring::RingPart;
use crate::{Panel, Placement};

/// Girths at chest, waist and hip: sums of panel widths at these heights (metres from the shoulder and from the waist), the
/// waist of a skirt from its upper sides; a neckline counts as cloth; 0 without cloth, and for the hips of a skirt cut in arcs.
pub(super) fn girths(panels: &[Panel], parts: &[Option<RingPart>], levels: [f64; 3]) -> [f64; 3] {
    let around = |wanted: &dyn Fn(Placement) -> bool, y: f64| {
        let wanted = panels.iter().filter(|p| wanted(p.placement));
        wanted.map(|p| width(p, y)).fold(0.0, |a, w| a + w)
    };
    let is_trunk = |p: Placement| matches!(p, Placement::TrunkFront | Placement::TrunkBack);
    let is_skirt = |p: Placement| matches!(p, Placement::SkirtFront | Placement::SkirtBack);
    let is_leg = |p: Placement| matches!(p, Placement::LegFront(_) | Placement::LegBack(_));
    let rings = || parts.iter().flatten();
    let high = rings().map(|r| r.high).fold(f64::MIN, f64::max);
    let waist: f64 = rings()
        .filter(|r| r.high == high)
        .map(|r| r.upper)
        .fold(0.0, |a, u| a + u);
    let hip = if rings().any(|r| r.is_arc) {
        0.0
    } else {
        around(&is_skirt, levels[2])
    };
    let open = |place: Placement| {
        let wanted = panels.iter().filter(|p| p.placement == place);
        opening(wanted, levels[0])
    };
    let cloth = around(&is_trunk, levels[0]);
    let chest = if cloth > 0.0 {
        cloth + open(Placement::TrunkFront) + open(Placement::TrunkBack)
    } else {
        0.0
    };
    [
        chest,
        if waist > 0.0 {
            waist
        } else {
            around(&is_leg, levels[1])
        },
        hip.max(around(&is_leg, levels[2])),
    ]
}

/// Width of the cloth of a panel at height `y`, metres.
fn width(p: &Panel, y: f64) -> f64 {
    pieces(p, y).iter().map(|c| c[1] - c[0]).sum()
}

/// Parts of the row at height `y` that are cloth, from left to right.
fn pieces(p: &Panel, y: f64) -> Vec<[f64; 2]> {
    let points: Vec<[f64; 2]> = (0..p.edges.len())
        .flat_map(|i| p.edges[i].sample(p.end(i), 8).into_iter().take(8))
        .collect();
    let mut cuts: Vec<f64> = (0..points.len())
        .filter_map(|i| {
            let (a, b) = (points[i], points[(i + 1) % points.len()]);
            ((a[1] <= y) != (b[1] <= y)).then(|| a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]))
        })
        .collect();
    cuts.sort_by(f64::total_cmp);
    cuts.chunks_exact(2).map(|c| [c[0], c[1]]).collect()
}

/// Opening of a front or a back around x = 0 at height `y`, metres: a neckline deeper than that, or a jacket's.
fn opening<'a>(panels: impl Iterator<Item = &'a Panel>, y: f64) -> f64 {
    let cloth: Vec<[f64; 2]> = panels.flat_map(|p| pieces(p, y)).collect();
    let right = cloth
        .iter()
        .map(|c| c[1])
        .filter(|x| *x <= JOINED)
        .fold(f64::MIN, f64::max);
    let left = cloth
        .iter()
        .map(|c| c[0])
        .filter(|x| *x >= -JOINED)
        .fold(f64::MAX, f64::min);
    let over = cloth.iter().any(|c| c[0] < -JOINED && c[1] > JOINED);
    if over || right == f64::MIN || left == f64::MAX {
        0.0
    } else {
        (left - right).max(0.0)
    }
}

/// Distance from x = 0 within which two halves meet, metres.
const JOINED: f64 = 0.002;
