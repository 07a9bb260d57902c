//! Yaw of the person about gravity, as a belief in eight bins.

use super::network::YAW_SECTORS;
use std::f32::consts::TAU;

/// Bins of yaw; the first is centred on a person who faces the camera, the others follow towards the subject's left.
pub const YAW_BINS: usize = 8;

/// Belief in each bin of yaw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct YawBelief {
    /// Probabilities, their sum is 1; all 0 without a person. Bin `k` is centred at `k`·45° from facing the camera towards
    /// the subject's left.
    pub bins: [f32; YAW_BINS],
    /// Cells of the person.
    pub cells: usize,
}

impl YawBelief {
    /// Belief of the network's logits of sectors, halves of bins whose first is centred on one who faces the camera.
    pub(super) fn of_logits(logits: &[f32], cells: usize) -> Self {
        let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let weights: Vec<f32> = logits.iter().map(|l| (l - most).exp()).collect();
        let sum: f32 = weights.iter().sum();
        let at = |k: usize| weights[k % YAW_SECTORS] / sum;
        let bins = std::array::from_fn(|k: usize| {
            let middle = k * YAW_SECTORS / YAW_BINS;
            at(middle) + 0.5 * (at(middle + 1) + at(middle + YAW_SECTORS - 1))
        });
        Self { bins, cells }
    }

    /// Belief about a measured yaw, radians, with this standard deviation, of a person of so many cells; `least` is left
    /// for each bin, for a measurement of something else.
    pub(crate) fn about(yaw: f32, deviation: f32, least: f32, cells: usize) -> Self {
        let sharpness = deviation.powi(-2);
        let weight = |k: usize| {
            let off = TAU / YAW_BINS as f32 * k as f32 - yaw;
            (sharpness * (off.cos() - 1.0)).exp()
        };
        let weights: [f32; YAW_BINS] = std::array::from_fn(weight);
        let sum: f32 = weights.iter().sum();
        let bins = weights.map(|w| least + (1.0 - YAW_BINS as f32 * least) * w / sum);
        Self { bins, cells }
    }

    /// Belief from this and from another source that knows nothing of it.
    pub(crate) fn and(&self, other: &Self) -> Self {
        let products: [f32; YAW_BINS] = std::array::from_fn(|k| self.bins[k] * other.bins[k]);
        let sum: f32 = products.iter().sum();
        if sum > 0.0 {
            let bins = products.map(|p| p / sum);
            Self { bins, ..*self }
        } else {
            *other
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_between_two_bins_belong_to_both_by_halves() {
        let mut logits = [-100.0; YAW_SECTORS];
        (logits[8], logits[15]) = (0.0, 0.0);
        let belief = YawBelief::of_logits(&logits, 7);
        assert!((belief.bins[4] - 0.5).abs() < 1e-6);
        assert!((belief.bins[7] - 0.25).abs() < 1e-6 && (belief.bins[0] - 0.25).abs() < 1e-6);
        assert!((belief.bins.iter().sum::<f32>() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn beliefs_from_two_sources_multiply_and_a_measurement_leaves_room_for_others() {
        let about = |yaw: f32| YawBelief::about(yaw, 0.2, 0.01, 50);
        let belief = about(TAU / 4.0);
        assert!(belief.bins[2] > 0.85 && belief.bins[6] >= 0.01);
        assert!((belief.bins.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        let both = belief.and(&about(-TAU / 4.0));
        assert!((both.bins[2] - both.bins[6]).abs() < 1e-5 && both.cells == 50);
        let mut even = YawBelief { cells: 9, ..belief };
        even.bins = [1.0 / YAW_BINS as f32; YAW_BINS];
        let joined = even.and(&belief);
        let off = (0..YAW_BINS).map(|k| (joined.bins[k] - belief.bins[k]).abs());
        assert!(off.fold(0.0, f32::max) < 1e-6 && joined.cells == 9);
        assert_eq!(YawBelief::default().and(&belief), belief);
    }
}
