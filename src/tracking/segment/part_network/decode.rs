//! From the network's maps to classes of cells and proposed joints.

use super::class_map::ClassMap;
use super::crop::{CROP_SIDE, PersonCells, PersonCrop};
use super::network::{CLASSES, MAP_CELLS, MAP_SIDE, NetworkOutput};
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;

/// A proposed joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointProposal {
    /// Class whose joint it is.
    pub class: u8,
    /// Place, camera frame, metres.
    pub position: P3,
    /// Probability, 0 to 1.
    pub weight: f32,
}

/// Peaks of a class's map.
const PEAKS: usize = 2;
/// Least probability of a second peak, share of the first.
const LEAST_PEAK: f32 = 0.1;
/// Cells from which the place of a peak is averaged, to each side.
const PEAK_REACH: i32 = 1;

impl NetworkOutput {
    /// Class shares at each of the person's cells; what isn't the person has none.
    pub(super) fn class_map(
        &self,
        crop: &PersonCrop,
        person: &PersonCells<'_>,
        map: &mut ClassMap,
    ) {
        let shares = self.shares();
        map.clear(CLASSES, person.cells.len());
        for (i, &cell) in person.cells.iter().enumerate() {
            if person.cloud.depth[cell as usize] <= 0.0 {
                continue;
            }
            let at = crop.of_cell(person.cloud, cell);
            let row = map.shares_mut(i);
            for (k, w) in corners(at) {
                for (s, p) in row.iter_mut().zip(&shares[k * CLASSES..]) {
                    *s += w * p;
                }
            }
        }
    }

    /// Shares of the classes in each cell of the map, shape `[cells × classes]`.
    fn shares(&self) -> Vec<f32> {
        let mut out = vec![0.0; MAP_CELLS * CLASSES];
        for (k, row) in out.chunks_exact_mut(CLASSES).enumerate() {
            let logit = |c: usize| self.classes[c * MAP_CELLS + k];
            let most = (0..=CLASSES).map(logit).fold(f32::NEG_INFINITY, f32::max);
            let weight = |c: usize| (logit(c) - most).exp();
            let sum: f32 = (0..=CLASSES).map(weight).sum();
            for (c, s) in row.iter_mut().enumerate() {
                *s = weight(c) / sum;
            }
        }
        out
    }

    /// Proposed joints: at most two peaks a class, the likelier first, classes ascending. Nothing is proposed where nothing is
    /// read, or before what is read.
    pub(super) fn proposals(
        &self,
        crop: &PersonCrop,
        person: &PersonCells<'_>,
        picture: &[f32],
    ) -> Vec<JointProposal> {
        let nearest = nearest_readings(picture);
        let mut out = Vec::new();
        for class in 0..CLASSES {
            let own = class * MAP_CELLS..(class + 1) * MAP_CELLS;
            let (heat, depth) = (&self.heat[own.clone()], &self.depth[own]);
            let mut peaks = peaks(heat);
            peaks.retain(|p| nearest[p.0].is_finite());
            peaks.truncate(PEAKS);
            let most = peaks.first().map_or(0.0, |p| p.1);
            for (k, weight) in peaks.into_iter().filter(|p| p.1 >= LEAST_PEAK * most) {
                let at = place(heat, depth, &nearest, k);
                let position = crop.point(person.cloud, at);
                out.extend(position.map(|position| JointProposal {
                    class: class as u8,
                    position,
                    weight,
                }));
            }
        }
        out
    }
}

fn probability(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}

/// Nearest reading of the person in each cell of a map, units of the window's side; infinite without one.
fn nearest_readings(picture: &[f32]) -> Vec<f32> {
    let pixels = CROP_SIDE * CROP_SIDE;
    let mut out = vec![f32::INFINITY; MAP_CELLS];
    let (depth, is_read) = picture.split_at(pixels);
    for (i, (d, read)) in depth.iter().zip(is_read).enumerate() {
        let (u, v) = (i % CROP_SIDE, i / CROP_SIDE);
        let step = CROP_SIDE / MAP_SIDE;
        let nearest = &mut out[v / step * MAP_SIDE + u / step];
        if *read > 0.0 {
            *nearest = nearest.min(*d);
        }
    }
    out
}

/// The four cells of a map about a place across the window, with their weights.
fn corners([x, y]: [f32; 2]) -> [(usize, f32); 4] {
    let split = |a: f32| {
        let a = (a * MAP_SIDE as f32 - 0.5).clamp(0.0, (MAP_SIDE - 1) as f32);
        let low = (a as usize).min(MAP_SIDE - 2);
        (low, a - low as f32)
    };
    let ((u, s), (v, t)) = (split(x), split(y));
    let k = v * MAP_SIDE + u;
    [
        (k, (1.0 - s) * (1.0 - t)),
        (k + 1, s * (1.0 - t)),
        (k + MAP_SIDE, (1.0 - s) * t),
        (k + MAP_SIDE + 1, s * t),
    ]
}

/// Neighbours of a cell and the cell itself.
fn about(k: usize, reach: i32) -> impl Iterator<Item = usize> {
    let (u, v) = ((k % MAP_SIDE) as i32, (k / MAP_SIDE) as i32);
    let side = 0..MAP_SIDE as i32;
    let offsets =
        (-reach..=reach).flat_map(move |dv| (-reach..=reach).map(move |du| (u + du, v + dv)));
    offsets
        .filter(move |(u, v)| side.contains(u) && side.contains(v))
        .map(|(u, v)| v as usize * MAP_SIDE + u as usize)
}

/// Cells that no neighbour exceeds with their probabilities, the likeliest first.
fn peaks(heat: &[f32]) -> Vec<(usize, f32)> {
    let is_peak = |k: &usize| about(*k, 1).all(|n| heat[n] <= heat[*k]);
    let mut out: Vec<(usize, f32)> = (0..MAP_CELLS)
        .filter(is_peak)
        .map(|k| (k, probability(heat[k])))
        .collect();
    out.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    out
}

/// Window coordinates of a peak: the mean about it, weighted by probability; the depth's over what is read, behind it.
fn place(heat: &[f32], depth: &[f32], nearest: &[f32], peak: usize) -> [f32; 3] {
    let middle = |i: usize| (i as f32 + 0.5) / MAP_SIDE as f32;
    let mut sum = [0.0; 3];
    let mut totals = [0.0; 3];
    for k in about(peak, PEAK_REACH) {
        let w = probability(heat[k]);
        let is_read = nearest[k].is_finite();
        let (away, of_depth) = if is_read {
            (depth[k].max(nearest[k]), w)
        } else {
            (0.0, 0.0)
        };
        let values = [middle(k % MAP_SIDE), middle(k / MAP_SIDE), away];
        for (i, (x, w)) in values.into_iter().zip([w, w, of_depth]).enumerate() {
            sum[i] += w * x;
            totals[i] += w;
        }
    }
    std::array::from_fn(|i| sum[i] / f32::max(totals[i], f32::MIN_POSITIVE))
}
