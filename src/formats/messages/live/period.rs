//! Frame period of a stream by the times of its last frames.

use crate::rgbd_source::NOMINAL_PERIOD_NS;
use std::collections::VecDeque;

/// Distances that the period is the median of: a third of a second at 30 Hz.
const DISTANCES: usize = 9;
/// Distances that count, nanoseconds: shorter ones are repetitions, longer ones are pauses.
const COUNTED_NS: std::ops::RangeInclusive<u64> = 1_000_000..=1_000_000_000;

/// Median of the last distances between frames.
#[derive(Clone, Debug, Default)]
pub(super) struct FramePeriod {
    last_ns: Option<u64>,
    distances: VecDeque<u64>,
}

impl FramePeriod {
    /// Counts a frame. Returns the period, nanoseconds: [`NOMINAL_PERIOD_NS`] before two frames.
    pub(super) fn update(&mut self, at_ns: u64) -> u64 {
        let distance = self
            .last_ns
            .replace(at_ns)
            .and_then(|l| at_ns.checked_sub(l));
        if let Some(distance) = distance.filter(|d| COUNTED_NS.contains(d)) {
            self.distances.push_back(distance);
        }
        if self.distances.len() > DISTANCES {
            self.distances.pop_front();
        }
        let mut sorted: Vec<u64> = self.distances.iter().copied().collect();
        sorted.sort_unstable();
        let median = sorted.get(sorted.len() / 2);
        median.copied().unwrap_or(NOMINAL_PERIOD_NS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drops_jumps_and_repetitions_do_not_change_the_period() {
        const MS: u64 = 1_000_000;
        let mut period = FramePeriod::default();
        assert_eq!(period.update(5_000 * MS), NOMINAL_PERIOD_NS);
        let times = [
            5_020, 5_040, 5_040, 5_060, 5_140, 5_160, 9_000, 2_000, 2_020,
        ];
        let last = times.map(|t| period.update(t * MS));
        assert!(last.iter().all(|p| *p == 20 * MS), "{last:?}");
    }
}
