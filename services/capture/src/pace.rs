//! Pace of a source: its frame times as a growing clock, and the moments to publish them.

use std::time::Duration;
use tokio::time::Instant;
use tryon_kit::config::CameraConfig;

/// Time between frames before the source has shown its own (ns): 30 a second.
const NOMINAL_STEP_NS: u64 = 33_333_333;
/// Shortest and longest time between two rounds of a source (ns).
const STEP_NS: [u64; 2] = [1_000_000, 1_000_000_000];

/// Clock of a source that may be played in rounds.
pub(crate) struct Pace {
    begun: Instant,
    /// Time of the source at the start of this round.
    first_ns: Option<u64>,
    /// Length of the rounds before it, and of pauses.
    added_ns: u64,
    /// Length of all pauses.
    paused: Duration,
    last_ns: u64,
    step_ns: u64,
    frames: u64,
}

impl Pace {
    /// A clock that starts now.
    pub(crate) fn new() -> Self {
        let begun = Instant::now();
        Self {
            begun,
            first_ns: None,
            added_ns: 0,
            paused: Duration::ZERO,
            last_ns: 0,
            step_ns: NOMINAL_STEP_NS,
            frames: 0,
        }
    }

    /// Nothing was read for that long: the clock goes on, the frames do not.
    pub(crate) fn pause(&mut self, length: Duration) {
        self.paused += length;
        self.added_ns += u64::try_from(length.as_nanos()).unwrap_or(u64::MAX);
    }

    /// Time of a frame on a clock that never runs back, and the moment to publish it; `None` for at once.
    pub(crate) fn next(&mut self, time_ns: u64, config: &CameraConfig) -> (u64, Option<Instant>) {
        let first = *self.first_ns.get_or_insert(time_ns);
        let mut at = time_ns.saturating_sub(first) + self.added_ns;
        if self.frames > 0 && at <= self.last_ns {
            // A new round, or a clock that jumped back, continues after the last frame.
            self.added_ns = self.last_ns + self.step_ns;
            self.first_ns = Some(time_ns);
            at = self.added_ns;
        } else if self.frames > 0 {
            self.step_ns = (at - self.last_ns).clamp(STEP_NS[0], STEP_NS[1]);
        }
        let due = if config.fast {
            None
        } else if config.rate > 0.0 {
            let step = Duration::from_secs_f64(self.frames as f64 / config.rate);
            Some(self.begun + self.paused + step)
        } else {
            Some(self.begun + Duration::from_nanos(at))
        };
        self.last_ns = at;
        self.frames += 1;
        (first + at, due)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_grows_across_rounds() {
        let config = CameraConfig {
            rate: 0.0,
            ..CameraConfig::default()
        };
        let mut p = Pace::new();
        let times: Vec<u64> = [1000, 34_000_000, 67_000_000, 1000, 34_000_000]
            .iter()
            .map(|&t| p.next(t, &config).0)
            .collect();
        assert!(times.windows(2).all(|w| w[0] < w[1]), "{times:?}");
        assert!(
            p.next(
                67_000_000,
                &CameraConfig {
                    fast: true,
                    ..config
                }
            )
            .1
            .is_none()
        );
    }
}
