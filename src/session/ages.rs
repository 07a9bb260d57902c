//! How old the newest word of each part is: what turns silence into a fault.

use super::Reason;
use serde::{Deserialize, Serialize};

/// How long each part may be silent, nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// No frame for this long is [`Reason::CameraSilent`].
    pub camera_silence_ns: u64,
    /// No body state for this long while frames come is [`Reason::TrackingUnavailable`].
    pub tracking_silence_ns: u64,
    /// No garment state for this long while bodies come is [`Reason::GarmentsLate`].
    pub garments_age_ns: u64,
}

impl Default for Limits {
    /// A client must know within a second (issue: kill −9), so every silence is shorter. Fifteen frames of a 30 Hz
    /// camera for the camera, which may skip on exposure changes; half of that for garments, for at 250 ms a shirt
    /// visibly trails its wearer.
    fn default() -> Self {
        Self {
            camera_silence_ns: 500_000_000,
            tracking_silence_ns: 700_000_000,
            garments_age_ns: 250_000_000,
        }
    }
}

/// When each part last spoke, nanoseconds of the service's monotonic clock; `None` before the first time.
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
    /// The fault that silence amounts to at `now_ns`, the most upstream one; `None` while all is fresh.
    /// What has never spoken is not late: opening has its own deadline.
    pub fn overdue(&self, now_ns: u64, limits: &Limits) -> Option<Reason> {
        let late =
            |at: Option<u64>, limit: u64| at.is_some_and(|t| now_ns.saturating_sub(t) > limit);
        if late(self.frame_ns, limits.camera_silence_ns) {
            return Some(Reason::CameraSilent);
        }
        if late(self.body_ns, limits.tracking_silence_ns) {
            return Some(Reason::TrackingUnavailable);
        }
        late(self.garments_ns, limits.garments_age_ns).then_some(Reason::GarmentsLate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_is_blamed_on_the_first_silent_part() {
        let limits = Limits {
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
        assert_eq!(ages.overdue(120, &limits), Some(Reason::GarmentsLate));
        assert_eq!(ages.overdue(151, &limits), Some(Reason::CameraSilent));
        let frames = Ages {
            frame_ns: Some(200),
            ..ages
        };
        assert_eq!(
            frames.overdue(200, &limits),
            Some(Reason::TrackingUnavailable)
        );
        assert_eq!(Ages::default().overdue(u64::MAX, &limits), None);
        // A clock that runs backwards is no reason to panic.
        assert_eq!(frames.overdue(0, &limits), None);
    }
}
