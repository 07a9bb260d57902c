//! Yaw of the person about gravity: votes of the leaves over eight bins, multiplied over the cells.

/// Bins of yaw; the first is centred on a person who faces the camera, the others follow towards the subject's left.
pub const YAW_BINS: usize = 8;
/// Labels of the training: halves of bins, from a person who faces the camera towards the subject's left.
pub(super) const YAW_SECTORS: u8 = 16;
/// Label of a person without a yaw, one who lies.
pub(super) const NO_YAW: u8 = u8::MAX;

/// Sector of a yaw in radians; [`NO_YAW`] without one.
pub(super) fn sector(yaw: Option<f64>) -> u8 {
    let width = std::f64::consts::TAU / f64::from(YAW_SECTORS);
    let of = |y: f64| (y / width).floor().rem_euclid(f64::from(YAW_SECTORS)) as u8 % YAW_SECTORS;
    yaw.filter(|y| y.is_finite()).map_or(NO_YAW, of)
}

/// Bin of a sector.
pub(super) fn bin(sector: u8) -> usize {
    usize::from(sector).div_ceil(2) % YAW_BINS
}

/// Sector of a person seen from the front.
pub(super) fn is_front(sector: u8) -> bool {
    (sector + YAW_SECTORS / 4) % YAW_SECTORS < YAW_SECTORS / 2
}

/// Belief in each bin of yaw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct YawBelief {
    /// Probabilities, their sum is 1; all 0 without a vote. Bin `k` is centred at `k`·45° from facing the camera towards
    /// the subject's left.
    pub bins: [f32; YAW_BINS],
    /// Cells that voted.
    pub cells: usize,
}

impl YawBelief {
    /// Belief of votes: sums of the logarithms of the bins' probabilities over so many cells, worth `independent` votes.
    pub(super) fn of_votes(logs: &[f32; YAW_BINS], cells: usize, independent: f32) -> Self {
        if cells == 0 {
            return Self::default();
        }
        let scale = independent / cells as f32;
        let most = logs.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let mut bins = logs.map(|l| ((l - most) * scale).exp());
        let sum: f32 = bins.iter().sum();
        bins.iter_mut().for_each(|b| *b /= sum);
        Self { bins, cells }
    }
    /// Probability of a person seen from the front, and from behind; even without a vote.
    pub fn front_and_back(&self) -> [f32; 2] {
        let [a, b, c, _, _, _, d, e] = self.bins;
        let front = a + b + e + 0.5 * (c + d);
        if self.cells == 0 {
            [0.5; 2]
        } else {
            [front, 1.0 - front]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_8, PI};

    #[test]
    fn yaws_fall_into_their_bins() {
        for k in 0..8 {
            for off in [-0.9, 0.9] {
                let yaw = f64::from(k) * 2.0 * FRAC_PI_8 + off * FRAC_PI_8;
                let s = sector(Some(yaw));
                assert_eq!(bin(s), k as usize, "{yaw}");
                assert_eq!(is_front(s), yaw.cos() > 0.0, "{yaw}");
                assert_eq!(s, sector(Some(yaw - 2.0 * PI)), "{yaw}");
            }
        }
        assert_eq!((sector(None), sector(Some(f64::NAN))), (NO_YAW, NO_YAW));
        assert_eq!(sector(Some(-1e-300)), 15);
        assert!(!is_front(sector(Some(FRAC_PI_2 + 0.1))));
    }

    #[test]
    fn belief_is_normalised_and_even_without_votes() {
        let mut logs = [-4.0f32 * 50.0; 8];
        logs[4] = -50.0;
        let belief = YawBelief::of_votes(&logs, 50, 10.0);
        assert!((belief.bins.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(belief.bins[4] > 0.99 && belief.front_and_back()[1] > 0.99);
        assert_eq!(
            YawBelief::of_votes(&logs, 0, 10.0).front_and_back(),
            [0.5; 2]
        );
    }
}
