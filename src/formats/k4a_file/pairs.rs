//! Depth and colour frames of one exposure, paired by their times.

use super::blocks::BlockLocation;
use std::collections::VecDeque;

/// Most frames noted ahead of the one that is returned; recorders write them in order, a second holds 60.
const MAX_AHEAD: usize = 1024;

/// Times of a recording's tracks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PairTiming {
    /// Frame period, nanoseconds.
    pub(super) period_ns: u64,
    /// Time from the exposure of colour to that of its depth, nanoseconds (`K4A_DEPTH_DELAY_NS`).
    pub(super) depth_delay_ns: i64,
}

/// Depth frame, and the colour frame of its exposure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FramePair {
    pub(super) depth: BlockLocation,
    pub(super) color: Option<BlockLocation>,
}

/// Frames found and not yet returned.
#[derive(Debug)]
pub(super) struct PendingFrames {
    timing: PairTiming,
    depth: VecDeque<BlockLocation>,
    /// Colour with the time of the depth that belongs to it.
    color: VecDeque<(u64, BlockLocation)>,
    latest_ns: u64,
}

impl PendingFrames {
    pub(super) fn new(timing: PairTiming) -> Self {
        Self {
            timing,
            depth: VecDeque::new(),
            color: VecDeque::new(),
            latest_ns: 0,
        }
    }

    pub(super) fn push_depth(&mut self, block: BlockLocation) {
        self.latest_ns = self.latest_ns.max(block.time_ns);
        self.depth.push_back(block);
    }

    pub(super) fn push_color(&mut self, block: BlockLocation) {
        let time = block
            .time_ns
            .saturating_add_signed(self.timing.depth_delay_ns);
        self.latest_ns = self.latest_ns.max(time);
        if self.color.len() >= MAX_AHEAD {
            self.color.pop_front();
        }
        self.color.push_back((time, block));
    }

    /// True if the colour of the first depth frame is known: later frames have been seen.
    pub(super) fn is_decided(&self) -> bool {
        self.depth.front().is_some_and(|d| {
            self.latest_ns > d.time_ns.saturating_add(self.timing.period_ns)
                || self.depth.len() >= MAX_AHEAD
        })
    }

    /// The first depth frame with the colour nearest to it, within half a period. Earlier colour is dropped.
    pub(super) fn pop(&mut self) -> Option<FramePair> {
        let depth = self.depth.pop_front()?;
        let gap = |time: u64| time.abs_diff(depth.time_ns);
        let nearest = (0..self.color.len()).min_by_key(|i| gap(self.color[*i].0));
        let nearest = nearest.filter(|i| gap(self.color[*i].0) <= self.timing.period_ns / 2);
        let color = nearest.map(|i| self.color[i].1);
        if let Some(i) = nearest {
            self.color.drain(..=i);
        }
        let outdated = depth.time_ns.saturating_sub(self.timing.period_ns);
        while self.color.front().is_some_and(|(time, _)| *time < outdated) {
            self.color.pop_front();
        }
        Some(FramePair { depth, color })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn block(time_ms: u64) -> BlockLocation {
        BlockLocation {
            track: 1,
            time_ns: time_ms * MS,
            at: time_ms,
            size: 1,
        }
    }

    fn pairs(depth: &[u64], color: &[u64], delay_ms: i64) -> Vec<(u64, Option<u64>)> {
        let mut pending = PendingFrames::new(PairTiming {
            period_ns: 33 * MS,
            depth_delay_ns: delay_ms * MS as i64,
        });
        depth.iter().for_each(|t| pending.push_depth(block(*t)));
        color.iter().for_each(|t| pending.push_color(block(*t)));
        let all = std::iter::from_fn(|| pending.pop());
        all.map(|p| (p.depth.at, p.color.map(|c| c.at))).collect()
    }

    #[test]
    fn colour_is_that_of_the_exposure() {
        let expected = [(0, Some(1)), (33, None), (66, Some(67)), (99, Some(101))];
        assert_eq!(pairs(&[0, 33, 66, 99], &[1, 67, 101], 0), expected);
        // Depth 10 ms after its colour.
        assert_eq!(
            pairs(&[20, 53], &[10, 43], 10),
            [(20, Some(10)), (53, Some(43))]
        );
        assert_eq!(pairs(&[20], &[60], -40), [(20, Some(60))]);
        assert_eq!(pairs(&[5], &[], 0), [(5, None)]);
    }

    #[test]
    fn a_later_frame_decides() {
        let mut pending = PendingFrames::new(PairTiming {
            period_ns: 33 * MS,
            depth_delay_ns: 0,
        });
        pending.push_depth(block(0));
        assert!(!pending.is_decided());
        pending.push_color(block(34));
        assert!(pending.is_decided());
        for i in 0..10 * MAX_AHEAD as u64 {
            pending.push_color(block(i));
        }
        assert_eq!(pending.color.len(), MAX_AHEAD);
    }
}
