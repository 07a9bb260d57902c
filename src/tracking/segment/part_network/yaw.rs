//! Yaw of the person about gravity, as a belief in eight bins.

use super::network::YAW_SECTORS;

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
}
