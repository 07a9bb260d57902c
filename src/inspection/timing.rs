//! Times of frames: rate, jitter, lost frames, and faults of the camera's clock.

use crate::settings::InspectionSettings;
use serde::Serialize;
use tryon_geometry::math::order_statistics::{median, quantile};

/// Interval over the median one from which frames are missing in it.
const GAP: f64 = 1.5;

/// Times of one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FrameTime {
    capture_ns: u64,
    arrival_ns: Option<u64>,
}

/// Capture times of frames in their order, and arrival times of live ones.
#[derive(Clone, Debug, Default)]
pub struct FrameTimes(Vec<FrameTime>);

/// Timing of a camera. Intervals are those of the capture times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TimingReport {
    /// Frames.
    pub frames: usize,
    /// Frames a second, by the median interval; 0 for a single frame.
    pub rate: f64,
    /// Standard deviation of the intervals without missing frames (s).
    pub jitter: f64,
    /// Longest interval (s).
    pub longest: f64,
    /// Share of the frames that are missing in intervals longer than 1.5 of the median one.
    pub lost: f64,
    /// Frames with the time of the one before.
    pub repeated: usize,
    /// Frames older than the one before.
    pub backwards: usize,
    /// Steps of the camera's clock against the time of arrival.
    pub jumps: usize,
    /// Spread of the delay from capture to arrival, 5 % to 95 % (s); `None` for recordings.
    pub delay_spread: Option<f64>,
}

impl FrameTimes {
    /// Adds a frame: its capture time by the camera's clock and, of a live one, the time at which it arrived by any steady
    /// clock, nanoseconds.
    pub fn add(&mut self, capture_ns: u64, arrival_ns: Option<u64>) {
        self.0.push(FrameTime {
            capture_ns,
            arrival_ns,
        });
    }

    /// Time from the first frame to the last (s), by arrival where there is one.
    pub fn span(&self) -> f64 {
        let (Some(first), Some(last)) = (self.0.first(), self.0.last()) else {
            return 0.0;
        };
        let (from, to) = match (first.arrival_ns, last.arrival_ns) {
            (Some(from), Some(to)) => (from, to),
            _ => (first.capture_ns, last.capture_ns),
        };
        seconds(from, to).max(0.0)
    }

    /// Rate, jitter and faults.
    pub fn report(&self, settings: &InspectionSettings) -> TimingReport {
        let intervals = (self.0.windows(2)).map(|w| seconds(w[0].capture_ns, w[1].capture_ns));
        let intervals: Vec<f64> = intervals.collect();
        let forward: Vec<f64> = intervals.iter().copied().filter(|s| *s > 0.0).collect();
        let nominal = median(&mut forward.clone()).unwrap_or(0.0);
        let (steady, gaps): (Vec<f64>, Vec<f64>) =
            forward.iter().partition(|s| **s < GAP * nominal);
        let missing: f64 = gaps.iter().map(|s| (s / nominal).round() - 1.0).sum();
        let frames = self.0.len();
        TimingReport {
            frames,
            rate: if nominal > 0.0 { nominal.recip() } else { 0.0 },
            jitter: standard_deviation(&steady),
            longest: forward.iter().copied().fold(0.0, f64::max),
            lost: missing / (missing + frames as f64).max(1.0),
            repeated: intervals.iter().filter(|s| **s == 0.0).count(),
            backwards: intervals.iter().filter(|s| **s < 0.0).count(),
            jumps: self.jumps(settings.clock_step),
            delay_spread: self.delay_spread(),
        }
    }

    /// Differences of arrival and capture (s), up to a constant.
    fn delays(&self) -> Option<Vec<f64>> {
        let first = self.0.first()?;
        let arrival = first.arrival_ns?;
        let delay = |t: &FrameTime| {
            Some(seconds(arrival, t.arrival_ns?) - seconds(first.capture_ns, t.capture_ns))
        };
        self.0.iter().map(delay).collect()
    }

    fn jumps(&self, step: f64) -> usize {
        let delays = self.delays().unwrap_or_default();
        let is_jump = |w: &&[f64]| (w[1] - w[0]).abs() > step;
        delays.windows(2).filter(is_jump).count()
    }

    fn delay_spread(&self) -> Option<f64> {
        let mut delays = self.delays()?;
        let [early, late] = [0.05, 0.95].map(|share| quantile(&mut delays, share));
        Some(late? - early?)
    }
}

/// Time from one count of nanoseconds to another (s).
fn seconds(from: u64, to: u64) -> f64 {
    (i128::from(to) - i128::from(from)) as f64 * 1e-9
}

fn standard_deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (squares / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn report(times: &[(u64, Option<u64>)]) -> TimingReport {
        let mut frames = FrameTimes::default();
        for (capture, arrival) in times {
            frames.add(capture * MS, arrival.map(|a| a * MS));
        }
        frames.report(&Default::default())
    }

    #[test]
    fn rate_and_jitter_have_their_closed_form() {
        // Intervals of 30 and 36 ms in turns: standard deviation 3 ms.
        let mut at = 500;
        let times: Vec<_> = (0..101)
            .map(|i| {
                at += if i % 2 == 0 { 30 } else { 36 };
                (at, None)
            })
            .collect();
        let r = report(&times);
        assert!((r.jitter - 0.003).abs() < 1e-9, "{r:?}");
        assert!(r.rate > 1000.0 / 36.1 && r.rate < 1000.0 / 29.9, "{r:?}");
        assert_eq!((r.lost, r.delay_spread, r.jumps), (0.0, None, 0));
    }

    #[test]
    fn missing_frames_are_counted_and_are_no_jitter() {
        // Of 100 frames every tenth is missing.
        let times: Vec<_> = (0..100)
            .filter(|i| i % 10 != 5)
            .map(|i| (i * 33, None))
            .collect();
        let r = report(&times);
        assert!(r.frames == 90 && r.jitter < 1e-12, "{r:?}");
        assert!((r.lost - 0.1).abs() < 1e-9, "{r:?}");
        assert!((r.longest - 0.066).abs() < 1e-9, "{r:?}");
    }

    #[test]
    fn clocks_that_stand_run_back_or_jump_are_told() {
        let r = report(&[(0, None), (33, None), (33, None), (20, None), (66, None)]);
        assert_eq!((r.repeated, r.backwards, r.jumps), (1, 1, 0));
        // The camera's clock is set back by an hour and forward again; arrival goes on.
        let jumping: Vec<_> = (0..30)
            .map(|i| {
                let back = if (10..20).contains(&i) { 3_600_000 } else { 0 };
                (4_000_000 + i * 33 - back, Some(7 + i * 33 + i % 3))
            })
            .collect();
        let r = report(&jumping);
        assert_eq!((r.jumps, r.backwards), (2, 1));
    }

    #[test]
    fn delays_are_compared_where_frames_are_live() {
        let r = report(&[
            (0, Some(10)),
            (33, Some(43)),
            (66, Some(96)),
            (99, Some(109)),
        ]);
        assert!((r.delay_spread.expect("live") - 0.02).abs() < 1e-9, "{r:?}");
        let one = report(&[(5, None)]);
        assert_eq!((one.frames, one.rate, one.jitter), (1, 0.0, 0.0));
        assert_eq!(report(&[]), TimingReport::default());
    }
}
