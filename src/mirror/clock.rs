//! Time step of the cloth from the capture times of frames.

/// Time step where frames give none (s): a camera of 30 frames a second.
pub const NOMINAL_INTERVAL: f64 = 1.0 / 30.0;
/// Time steps of the cloth (s). A longer gap is a pause of the camera and no huge step; 0.2 s is a camera of 5 frames a second.
const STEPS: [f64; 2] = [1.0 / 120.0, 0.2];

/// Time step of the cloth for a gap between frames (s).
pub fn time_step(gap: f64) -> f64 {
    if gap > 0.0 {
        gap.clamp(STEPS[0], STEPS[1])
    } else {
        NOMINAL_INTERVAL
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
        let times = [
            5_000_000_000u64,
            5_040_000_000,
            5_041_000_000,
            8_041_000_000,
            1,
        ];
        let gaps = times.map(|t| clock.gap(t));
        assert_eq!(gaps, [0.0, 0.04, 0.001, 3.0, 0.0]);
        let steps = [NOMINAL_INTERVAL, 0.04, STEPS[0], STEPS[1], NOMINAL_INTERVAL];
        assert_eq!(gaps.map(time_step), steps);
        assert_eq!(time_step(f64::NAN), NOMINAL_INTERVAL);
    }
}
