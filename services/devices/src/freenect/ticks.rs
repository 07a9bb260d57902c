//! Clock of the Kinect v1: 60 MHz in 32 bits, which turns over every 71.6 s.

/// Nanoseconds of three ticks.
const THREE_TICKS_NS: i64 = 50;

/// The clock, counted on across its turns. Both streams have it, so that steps back are expected.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TickClock {
    /// Last reading, and ticks since the clock's zero.
    last: Option<(u32, i64)>,
}

impl TickClock {
    /// Time of a reading, nanoseconds. Readings within 35 s of each other are ordered rightly.
    pub(super) fn nanoseconds(&mut self, ticks: u32) -> u64 {
        let total = match self.last {
            None => i64::from(ticks),
            Some((last, total)) => total + i64::from(ticks.wrapping_sub(last).cast_signed()),
        };
        self.last = Some((ticks, total));
        u64::try_from(total * THREE_TICKS_NS / 3).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_of_the_clock_and_steps_back_keep_their_distance() {
        let mut clock = TickClock::default();
        let first = clock.nanoseconds(u32::MAX - 599_999);
        // 600,000 ticks are 10 ms.
        for (ticks, after_ns) in [
            (0, 10_000_000),
            (2_000_000, 43_333_333),
            (1_400_000, 33_333_333),
        ] {
            let after = clock.nanoseconds(ticks) - first;
            assert!(after.abs_diff(after_ns) <= 1, "{ticks}: {after} ns");
        }
        assert_eq!(TickClock::default().nanoseconds(60_000_000), 1_000_000_000);
    }
}
