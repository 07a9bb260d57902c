//! Recording of a session's body from one exposure on, for a simulation that follows it at a pace of its own.

use tokio::sync::mpsc;
use tryon::geometry::math::P3;
use tryon_proto::v1::FrameId;

/// Longest recording (s); as the contract says.
pub(crate) const MAX_SECONDS: f32 = 10.0;
/// Exposures a second that there is memory for. A faster camera fills it sooner, and the recording ends there.
const RATE: f32 = 60.0;

/// Body that cloth meets at one exposure.
pub(crate) struct RecordedBody {
    pub(crate) exposure: FrameId,
    /// Vertices (world, metres).
    pub(crate) vertices: Vec<P3>,
}

/// Bodies of a recording, in order; it is over once its recorder is gone.
pub(crate) type Recording = mpsc::Receiver<RecordedBody>;

/// Most bodies of a recording.
pub(crate) fn most_bodies(seconds: f32) -> usize {
    (seconds * RATE).ceil() as usize
}

/// The recording end of a session.
pub(crate) struct Recorder {
    bodies: mpsc::Sender<RecordedBody>,
    first: FrameId,
    length_ns: u64,
}

impl Recorder {
    /// Recorder of the `seconds` after an exposure.
    pub(crate) fn new(first: FrameId, seconds: f32) -> (Self, Recording) {
        let (bodies, recording) = mpsc::channel(most_bodies(seconds).max(1));
        let recorder = Self {
            bodies,
            first,
            length_ns: (f64::from(seconds) * 1e9) as u64,
        };
        (recorder, recording)
    }

    /// Adds a body; false once the recording is over, or nobody takes it.
    pub(crate) fn record(&self, exposure: FrameId, vertices: &[P3]) -> bool {
        let first = &self.first;
        let age = exposure.capture_time_ns.checked_sub(first.capture_time_ns);
        let is_within = age.is_some_and(|age| age <= self.length_ns);
        let body = || RecordedBody {
            exposure,
            vertices: vertices.to_vec(),
        };
        exposure.epoch == first.epoch && is_within && self.bodies.try_send(body()).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exposure(epoch: u64, ms: u64) -> FrameId {
        FrameId {
            epoch,
            capture_time_ns: ms * 1_000_000,
            ..Default::default()
        }
    }

    #[test]
    fn a_recording_ends_with_its_time_its_camera_or_its_memory() {
        let body = [P3::origin()];
        let (recorder, mut recording) = Recorder::new(exposure(1, 500), 0.1);
        assert!(recorder.record(exposure(1, 600), &body));
        assert!(!recorder.record(exposure(1, 601), &body), "later");
        assert!(!recorder.record(exposure(1, 499), &body), "earlier");
        assert!(!recorder.record(exposure(2, 550), &body), "another camera");
        for _ in 1..most_bodies(0.1) {
            assert!(recorder.record(exposure(1, 510), &body));
        }
        assert!(!recorder.record(exposure(1, 510), &body), "memory is full");
        drop(recorder);
        let taken = std::iter::from_fn(|| recording.blocking_recv());
        assert_eq!(taken.count(), most_bodies(0.1));
    }
}
