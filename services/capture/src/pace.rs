//! Pace of a source: its frame times as a growing clock, and the moments to publish them.

use std::cmp::Ordering;
use std::time::Duration;
use tokio::time::Instant;
use tryon_kit::config::CameraConfig;

/// Time between frames before the source has shown its own (ns): 30 a second.
const NOMINAL_STEP_NS: u64 = 33_333_333;
/// Shortest and longest time between two rounds of a source (ns).
const STEP_NS: [u64; 2] = [1_000_000, 1_000_000_000];
/// Time by which the clock of a live source may run ahead of this machine's from frame to frame.
const MAX_AHEAD: Duration = Duration::from_secs(1);

/// Fault of a live source's clock. The frame's time continues those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ClockFault {
    /// The time of the frame before it.
    Repeated,
    /// An earlier time.
    Backwards,
    /// A time far ahead of what has passed.
    Jumped,
}

impl ClockFault {
    /// Label of metrics.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Repeated => "repeated",
            Self::Backwards => "backwards",
            Self::Jumped => "jumped",
        }
    }
}

/// A frame's place in time.
pub(crate) struct Moment {
    /// On a clock that never runs back (ns).
    pub(crate) time_ns: u64,
    /// Moment to publish it; `None` for at once.
    pub(crate) due: Option<Instant>,
    /// Only of a live source.
    pub(crate) fault: Option<ClockFault>,
}

/// Last frame of a source.
#[derive(Clone, Copy)]
struct Last {
    /// On the source's clock.
    source_ns: u64,
    /// Since the first frame, on the clock that never runs back.
    at_ns: u64,
    /// On this machine's clock.
    seen: Instant,
}

/// Clock of a source that may be played in rounds.
pub(crate) struct Pace {
    /// Its clock goes on while nobody reads it.
    is_live: bool,
    begun: Instant,
    /// Length of all pauses.
    paused: Duration,
    /// Length of the pause before the next frame.
    pause: Duration,
    /// Time of the first frame on the source's clock.
    first_ns: u64,
    last: Option<Last>,
    step_ns: u64,
    frames: u64,
}

impl Pace {
    /// A clock that starts now.
    pub(crate) fn new(is_live: bool) -> Self {
        Self {
            is_live,
            begun: Instant::now(),
            paused: Duration::ZERO,
            pause: Duration::ZERO,
            first_ns: 0,
            last: None,
            step_ns: NOMINAL_STEP_NS,
            frames: 0,
        }
    }

    /// Nothing was read for that long: the clock goes on, the frames of a recording do not.
    pub(crate) fn pause(&mut self, length: Duration) {
        self.paused += length;
        self.pause += length;
    }

    fn fault(&self, time_ns: u64, last: &Last) -> Option<ClockFault> {
        match time_ns.cmp(&last.source_ns) {
            Ordering::Less => Some(ClockFault::Backwards),
            Ordering::Equal => Some(ClockFault::Repeated),
            Ordering::Greater => {
                let step = Duration::from_nanos(time_ns - last.source_ns);
                let is_ahead = self.is_live && step > last.seen.elapsed() + MAX_AHEAD;
                is_ahead.then_some(ClockFault::Jumped)
            }
        }
    }

    /// Time of a frame since the first, by its time on the source's clock. A new round, or a clock at fault, continues
    /// after the last frame.
    fn advance(&mut self, time_ns: u64) -> (u64, Option<ClockFault>) {
        let pause = if self.is_live {
            Duration::ZERO
        } else {
            self.pause
        };
        self.pause = Duration::ZERO;
        let Some(last) = self.last else {
            self.first_ns = time_ns;
            return (0, None);
        };
        let fault = self.fault(time_ns, &last);
        let step = match fault {
            Some(_) => self.step_ns,
            None => time_ns - last.source_ns,
        };
        self.step_ns = step.clamp(STEP_NS[0], STEP_NS[1]);
        let pause = u64::try_from(pause.as_nanos()).unwrap_or(u64::MAX);
        let at = last.at_ns.saturating_add(step).saturating_add(pause);
        (at, fault.filter(|_| self.is_live))
    }

    /// Place in time of the next frame.
    pub(crate) fn next(&mut self, time_ns: u64, config: &CameraConfig) -> Moment {
        let (at_ns, fault) = self.advance(time_ns);
        let due = if config.fast {
            None
        } else if config.rate > 0.0 {
            let step = Duration::from_secs_f64(self.frames as f64 / config.rate);
            Some(self.begun + self.paused + step)
        } else {
            Some(self.begun + Duration::from_nanos(at_ns))
        };
        self.last = Some(Last {
            source_ns: time_ns,
            at_ns,
            seen: Instant::now(),
        });
        self.frames += 1;
        Moment {
            time_ns: self.first_ns.saturating_add(at_ns),
            due,
            fault,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: u64 = 33_000_000;

    fn times(pace: &mut Pace, source_ns: &[u64]) -> Vec<u64> {
        let config = CameraConfig::default();
        let next = |&t| pace.next(t, &config).time_ns;
        source_ns.iter().map(next).collect()
    }

    #[test]
    fn rounds_of_a_recording_follow_each_other() {
        let start = 1_000;
        let round = [start, start + FRAME, start + 2 * FRAME];
        let mut pace = Pace::new(false);
        let first = times(&mut pace, &round);
        assert_eq!(first, round);
        let second = times(&mut pace, &round);
        assert_eq!(second, round.map(|t| t + 3 * FRAME));
    }

    #[test]
    fn a_pause_moves_the_frames_of_a_recording_only() {
        for (is_live, pause) in [(false, 1_000_000_000), (true, 0)] {
            let mut pace = Pace::new(is_live);
            times(&mut pace, &[0, FRAME]);
            pace.pause(Duration::from_secs(1));
            assert_eq!(times(&mut pace, &[2 * FRAME]), [2 * FRAME + pause]);
        }
    }

    #[test]
    fn faults_of_a_live_clock_are_told_and_its_frames_stay_in_order() {
        let hour = 3_600_000_000_000;
        let source = [
            (hour, None),
            (hour + FRAME, None),
            (hour + FRAME, Some(ClockFault::Repeated)),
            (FRAME, Some(ClockFault::Backwards)),
            (2 * FRAME, None),
            (hour, Some(ClockFault::Jumped)),
            (hour + FRAME, None),
        ];
        let (mut pace, config) = (Pace::new(true), CameraConfig::default());
        for (i, (time, fault)) in source.into_iter().enumerate() {
            let moment = pace.next(time, &config);
            assert_eq!(moment.fault, fault, "frame {i}");
            assert_eq!(moment.time_ns, hour + i as u64 * FRAME, "frame {i}");
        }
    }
}
