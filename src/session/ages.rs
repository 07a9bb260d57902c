//! Ages of the newest message of each stage, and the silence that becomes a fault.

use super::Fault;
use serde::{Deserialize, Serialize};

/// Longest silence of each stage, nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SilenceLimits {
    /// No frame for this long is [`Fault::CameraSilent`].
    pub camera_silence_ns: u64,
    /// No body state for this long while frames come is [`Fault::TrackingUnavailable`].
    pub tracking_silence_ns: u64,
    /// No garment state for this long while bodies come is [`Fault::GarmentsLate`].
    pub garments_age_ns: u64,
}

impl Default for SilenceLimits {
    /// A client learns of a fault within a second, so every limit is shorter. Fifteen frames at 30 Hz for the camera,
    /// which skips on exposure changes. Half of that for garments: at 250 ms a shirt visibly trails the body.
    fn default() -> Self {
        Self {
            camera_silence_ns: 500_000_000,
            tracking_silence_ns: 700_000_000,
            garments_age_ns: 250_000_000,
        }
    }
}

/// Time of the newest message of each stage, nanoseconds of the service's monotonic clock; `None` before the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ages {
    /// Newest frame.
    pub frame_ns: Option<u64>,
    /// Newest body state, good or not.
    pub body_ns: Option<u64>,
    /// Capture time of the frame that the newest garments belong to, on the same clock.
    pub garments_ns: Option<u64>,
}

impl Ages {
    /// Most upstream fault of silence at `now_ns`; `None` while all is fresh.
    /// A stage without any message is not late: opening has its own deadline.
    pub fn overdue(&self, now_ns: u64, limits: &SilenceLimits) -> Option<Fault> {
        let late =
            |at: Option<u64>, limit: u64| at.is_some_and(|t| now_ns.saturating_sub(t) > limit);
        if late(self.frame_ns, limits.camera_silence_ns) {
            return Some(Fault::CameraSilent);
        }
        if late(self.body_ns, limits.tracking_silence_ns) {
            return Some(Fault::TrackingUnavailable);
        }
        late(self.garments_ns, limits.garments_age_ns).then_some(Fault::GarmentsLate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_is_the_fault_of_the_first_silent_stage() {
        let limits = SilenceLimits {
            camera_silence_ns: 50,
            tracking_silence_ns: 70,
            garments_age_ns: 25,
        };
        let ages = Ages {
            frame_ns: Some(100),
            body_ns: Some(95),
            garments_ns: Some(90),
        };
        assert_eq!(ages.overdue(110, &limits), None);
        assert_eq!(ages.overdue(120, &limits), Some(Fault::GarmentsLate));
        assert_eq!(ages.overdue(151, &limits), Some(Fault::CameraSilent));
        let frames = Ages {
            frame_ns: Some(200),
            ..ages
        };
        assert_eq!(
            frames.overdue(200, &limits),
            Some(Fault::TrackingUnavailable)
        );
        assert_eq!(Ages::default().overdue(u64::MAX, &limits), None);
        // A clock that runs backwards is no reason to panic.
        assert_eq!(frames.overdue(0, &limits), None);
    }
}
