//! Time step of the cloth from the capture times of frames.

/// Time step when frames give none (s): a 30 Hz camera.
pub(super) const NOMINAL: f64 = 1.0 / 30.0;
/// Longest gap of a recording that counts as a time step (s); a longer one is a pause of the camera.
const LONGEST_RECORDED: f64 = 0.2;
/// Time steps of a live stream (s): a gap in the stream does not become one huge step.
const LIVE: [f64; 2] = [1.0 / 120.0, 1.0 / 10.0];

/// Time step for a gap that no camera interval explains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LongGap {
    /// A recording: the nominal interval of a camera.
    Nominal,
    /// A live stream: the gap, clamped.
    Clamped,
}

impl LongGap {
    /// Time step of the cloth for a gap between frames (s).
    pub fn time_step(self, gap: f64) -> f64 {
        match self {
            Self::Nominal if gap > 0.0 && gap <= LONGEST_RECORDED => gap,
            Self::Nominal => NOMINAL,
            Self::Clamped => gap.clamp(LIVE[0], LIVE[1]),
        }
    }
}

/// Gaps between the capture times of a stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameClock {
    last_ns: Option<u64>,
}

impl FrameClock {
    /// A clock whose last frame was captured at `time_ns`.
    pub fn at(time_ns: u64) -> Self {
        Self {
            last_ns: Some(time_ns),
        }
    }

    /// Time since the previous frame (s); 0 for the first frame and for one that is not later.
    pub fn gap(&mut self, time_ns: u64) -> f64 {
        let last = self.last_ns.replace(time_ns).unwrap_or(time_ns);
        time_ns.saturating_sub(last) as f64 * 1e-9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unusable_gaps_become_usable_steps() {
        let mut clock = FrameClock::default();
        let gaps = [5_000_000_000u64, 5_040_000_000, 8_040_000_000, 1].map(|t| clock.gap(t));
        assert_eq!(gaps, [0.0, 0.04, 3.0, 0.0]);
        assert_eq!(
            gaps.map(|g| LongGap::Nominal.time_step(g)),
            [NOMINAL, 0.04, NOMINAL, NOMINAL]
        );
        assert_eq!(
            gaps.map(|g| LongGap::Clamped.time_step(g)),
            [LIVE[0], 0.04, LIVE[1], LIVE[0]]
        );
    }
}
