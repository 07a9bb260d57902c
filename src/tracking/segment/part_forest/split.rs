//! Search for the split of a node: random features and thresholds, greatest information gain (section 3.2 of Shotton et
//! al. 2011).

use super::feature::DepthFeature;
use super::training_set::{LabelledCell, TrainingSet};
use super::yaw::{NO_YAW, YAW_BINS, bin};
use crate::settings::ForestSpec;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Features of one task of the search.
pub(super) const CHUNK: usize = 16;
/// Most cells by which the splits of a node compare; more change no choice that matters.
const MOST_CELLS: usize = 20_000;

/// A split and its gain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SplitChoice {
    /// Information gain, bits per cell; 0 for no split.
    pub(super) gain: f64,
    pub(super) feature: DepthFeature,
    pub(super) threshold: i16,
}

/// Search for the splits of one tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct SplitSearch {
    pub(super) classes: usize,
    pub(super) spec: ForestSpec,
    pub(super) seed: u64,
}

/// n · log2 n, for entropies of counts: n · H = n log n − Σ c log c.
fn n_log_n(n: u32) -> f64 {
    let x = f64::from(n);
    if n > 1 { x * x.log2() } else { 0.0 }
}

/// Gain of a split of counts over classes into those below and the rest, bits × cells.
pub(super) fn gain(all: &[u32], below: &[u32]) -> f64 {
    let (mut n, mut nb) = (0, 0);
    let mut sum = 0.0;
    for (a, b) in all.iter().zip(below) {
        n += a;
        nb += b;
        sum += n_log_n(*b) + n_log_n(a - b) - n_log_n(*a);
    }
    n_log_n(n) - n_log_n(nb) - n_log_n(n - nb) + sum
}

/// A random feature.
fn draw(rng: &mut Pcg64Mcg, spec: &ForestSpec) -> DepthFeature {
    let [shortest, longest] = spec.offsets;
    let offset = |rng: &mut Pcg64Mcg| {
        let radius = shortest * (longest / shortest).powf(rng.random::<f32>());
        let angle = std::f32::consts::TAU * rng.random::<f32>();
        [radius * angle.cos(), radius * angle.sin()].map(|x| x.round() as i8)
    };
    let first = offset(rng);
    let second = if rng.random_bool(spec.unary) {
        [0, 0]
    } else {
        offset(rng)
    };
    DepthFeature([first[0], first[1], second[0], second[1]])
}

impl SplitSearch {
    /// Best split of the cells `members` among the features of one task. Equal gains: the first.
    pub(super) fn best(&self, set: &TrainingSet, members: &[u32], task: u64) -> SplitChoice {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed ^ task.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let n = members.len().min(MOST_CELLS);
        let member = |k: usize| &set.cells[members[k * members.len() / n] as usize];
        let features: Vec<DepthFeature> = (0..CHUNK).map(|_| draw(&mut rng, &self.spec)).collect();
        let thresholds: Vec<Vec<i16>> = features
            .iter()
            .map(|f| {
                let at = (0..self.spec.thresholds).map(|_| rng.random_range(0..n));
                let mut t: Vec<i16> = at.map(|k| set.response(*f, member(k))).collect();
                t.sort_unstable();
                t
            })
            .collect();
        let (bins, width) = (self.spec.thresholds + 1, self.width());
        let mut counts = vec![0u32; CHUNK * bins * width];
        for k in 0..n {
            let cell = member(k);
            let window = set.window(cell.image);
            for (f, feature) in features.iter().enumerate() {
                let response = window.response(*feature, &cell.frame);
                let at_least = |t: &i16| usize::from(response >= *t);
                let bin: usize = thresholds[f].iter().map(at_least).sum();
                self.count(cell, &mut counts[(f * bins + bin) * width..][..width]);
            }
        }
        let mut best = SplitChoice::default();
        for (f, feature) in features.iter().enumerate() {
            let counts = &counts[f * bins * width..(f + 1) * bins * width];
            self.compare(counts, *feature, &thresholds[f], &mut best);
        }
        best.gain /= n as f64;
        best
    }

    /// Counts of a bin of responses: cells of each class, then of each bin of yaw.
    fn width(&self) -> usize {
        self.classes + YAW_BINS
    }

    /// Counts a cell.
    fn count(&self, cell: &LabelledCell, counts: &mut [u32]) {
        counts[usize::from(cell.class)] += 1;
        if cell.sector != NO_YAW {
            counts[self.classes + bin(cell.sector)] += 1;
        }
    }

    /// Compares all thresholds of a feature with the best split so far; `counts` has the shape `[bins × width]`.
    fn compare(
        &self,
        counts: &[u32],
        feature: DepthFeature,
        thresholds: &[i16],
        best: &mut SplitChoice,
    ) {
        let width = self.width();
        let mut all = vec![0u32; width];
        for bin in counts.chunks_exact(width) {
            all.iter_mut().zip(bin).for_each(|(a, b)| *a += b);
        }
        let mut below = vec![0u32; width];
        for (i, (bin, t)) in counts.chunks_exact(width).zip(thresholds).enumerate() {
            below.iter_mut().zip(bin).for_each(|(a, b)| *a += b);
            if i > 0 && thresholds[i - 1] == *t {
                continue;
            }
            let k = self.classes;
            let gain =
                gain(&all[..k], &below[..k]) + self.spec.yaw_weight * gain(&all[k..], &below[k..]);
            if gain > best.gain.max(self.spec.least_gain) {
                *best = SplitChoice {
                    gain,
                    feature,
                    threshold: *t,
                };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_of_known_splits() {
        // Two classes of four: a perfect split gains one bit a cell, an even one nothing.
        assert!((gain(&[4, 4], &[4, 0]) - 8.0).abs() < 1e-12);
        assert!(gain(&[4, 4], &[2, 2]).abs() < 1e-12);
        // Three of four below: 8 − 4·(0.8113 + 0.8113).
        assert!((gain(&[4, 4], &[3, 1]) - 1.509_775).abs() < 1e-5);
        assert_eq!(gain(&[0, 0], &[0, 0]), 0.0);
    }
}
