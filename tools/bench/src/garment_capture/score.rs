//! Scores of a capture: F1 and boundaries of labels, distances between surfaces.

use super::settings::CaptureBenchSettings;
use crate::scans::{SKIN_LABEL, STRAY_LABEL};
use std::collections::BTreeMap;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;
use tryon_geometry::spatial::{Bvh, HashGrid, PointTree};

/// Score of the labels of one scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LabelScore {
    /// Mean F1 over garments, 0 to 1.
    pub(super) f1: f64,
    /// Mean distance of found from true boundary points, metres.
    pub(super) boundary: f64,
    /// True label of each found part.
    matches: BTreeMap<u8, u8>,
}

impl LabelScore {
    /// True label of a found part, if one was matched.
    pub(super) fn true_label(&self, part: u8) -> Option<u8> {
        self.matches.get(&part).copied()
    }
}

/// Compares found parts (0 is skin) with true labels; parts are matched by their overlap.
pub(super) fn score_labels(
    settings: &CaptureBenchSettings,
    points: &[P3],
    truth: &[u8],
    found: &[u8],
) -> LabelScore {
    let mut overlap: BTreeMap<(u8, u8), usize> = BTreeMap::new();
    for (t, f) in truth.iter().zip(found).filter(|(t, _)| **t != STRAY_LABEL) {
        *overlap.entry((*t, *f)).or_default() += 1;
    }
    let sum = |wanted: &dyn Fn(&(u8, u8)) -> bool| -> usize {
        let some = overlap.iter().filter(|(pair, _)| wanted(pair));
        some.map(|(_, n)| n).sum()
    };
    let least = settings.least_share * sum(&|_| true) as f64;
    let mut garments: Vec<u8> = overlap.keys().map(|(t, _)| *t).collect();
    garments.dedup();
    garments.retain(|t| *t != SKIN_LABEL && sum(&|(u, _)| u == t) as f64 > least);

    let pairs = overlap.iter();
    let pairs = pairs.filter(|((t, f), _)| garments.contains(t) && *f != 0);
    let mut pairs: Vec<_> = pairs.collect();
    pairs.sort_by_key(|p| std::cmp::Reverse(p.1));
    let mut matches = BTreeMap::new();
    for ((t, f), _) in pairs {
        if !matches.contains_key(f) && !matches.values().any(|x| x == t) {
            matches.insert(*f, *t);
        }
    }
    let f1 = |t: &u8| {
        let part = matches.iter().find(|(_, x)| *x == t).map(|(f, _)| *f);
        let hits = part.map_or(0, |f| overlap.get(&(*t, f)).copied().unwrap_or(0));
        let all = part.map_or(0, |f| sum(&|(_, g)| *g == f));
        2.0 * hits as f64 / (sum(&|(u, _)| u == t) + all).max(1) as f64
    };
    let relabelled = found.iter().map(|f| *matches.get(f).unwrap_or(f));
    let relabelled: Vec<u8> = relabelled.collect();
    LabelScore {
        f1: garments.iter().map(f1).sum::<f64>() / garments.len().max(1) as f64,
        boundary: boundary_distance(settings, points, truth, &relabelled),
        matches,
    }
}

/// Mean distance of the found boundary from the true one, metres.
fn boundary_distance(
    settings: &CaptureBenchSettings,
    points: &[P3],
    truth: &[u8],
    found: &[u8],
) -> f64 {
    let (radius, farthest) = (settings.neighbours, settings.farthest);
    let mut grid = HashGrid::default();
    // Searches reach half a cell.
    grid.fill(points, 2.0 * radius);
    let boundary = |labels: &[u8]| -> Vec<P3> {
        let differs = |i: &usize| {
            let mut any = false;
            grid.within(&points[*i], radius, |j, _| {
                let j = j as usize;
                any |= labels[j] != labels[*i] && truth[j] != STRAY_LABEL;
            });
            any && truth[*i] != STRAY_LABEL
        };
        (0..points.len())
            .filter(differs)
            .map(|i| points[i])
            .collect()
    };
    let (real, ours) = (boundary(truth), boundary(found));
    let tree = PointTree::new(&real);
    let distance = |p: &P3| tree.nearest(p, farthest).map_or(farthest, |n| n.1.sqrt());
    ours.iter().map(|p| f64::from(distance(p))).sum::<f64>() / ours.len().max(1) as f64
}

/// Mean distance of points from a surface, metres.
pub(super) fn mean_distance(points: &[P3], surface: &[P3], faces: &[Face]) -> f64 {
    let bvh = Bvh::new(faces, surface);
    let distance = |p: &P3| {
        bvh.closest(surface, p)
            .map_or(0.0, |f| f64::from(f.distance))
    };
    points.iter().map(distance).sum::<f64>() / points.len().max(1) as f64
}

/// Largest distance between corresponding points, metres.
pub(super) fn largest_distance(a: &[P3], b: &[P3]) -> f64 {
    let all = a.iter().zip(b).map(|(p, q)| f64::from((p - q).norm()));
    all.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a line, 2 mm apart.
    fn line(n: usize) -> Vec<P3> {
        (0..n)
            .map(|i| P3::new(0.002 * i as f32, 0.0, 0.0))
            .collect()
    }

    fn score(points: &[P3], truth: &[u8], found: &[u8]) -> LabelScore {
        score_labels(&CaptureBenchSettings::default(), points, truth, found)
    }

    #[test]
    fn a_shifted_boundary_is_as_far_as_it_is() {
        let points = line(400);
        let truth: Vec<u8> = (0..400).map(|i| if i < 200 { 1 } else { 2 }).collect();
        let swapped: Vec<u8> = truth.iter().map(|t| 3 - t).collect();
        let exact = score(&points, &truth, &swapped);
        assert_eq!((exact.f1, exact.boundary), (1.0, 0.0));
        assert_eq!((exact.true_label(2), exact.true_label(3)), (Some(1), None));
        let found: Vec<u8> = (0..400).map(|i| if i < 220 { 1 } else { 2 }).collect();
        let score = score(&points, &truth, &found);
        assert!((score.boundary - 0.036).abs() < 0.006, "{score:?}");
        assert!((score.f1 - 0.95).abs() < 0.01, "{score:?}");
    }

    #[test]
    fn strays_and_missing_garments_are_counted_as_such() {
        let points = line(300);
        let truth: Vec<u8> = (0..300).map(|i| [1, 2, STRAY_LABEL][i / 100]).collect();
        let found: Vec<u8> = (0..300).map(|i| [1, 0, 1][i / 100]).collect();
        let score = score(&points, &truth, &found);
        assert!((score.f1 - 0.5).abs() < 1e-9, "{score:?}");
    }
}
