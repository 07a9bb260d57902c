//! Reader of a source: frames at their pace, onto the bus under a lease of consent, and into a recording.

use crate::consent::Leases;
use crate::pace::Pace;
use crate::push::is_push;
use crate::recorder::Recorder;
use crate::source::OpenSource;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::watch;
use tryon_geometry::camera::{Calibration, RgbdFrame};
use tryon_kit::compute::Pool;
use tryon_kit::config::CameraConfig;
use tryon_kit::flow::Flow;
use tryon_kit::frame_trace::{self, Sampler};
use tryon_kit::frames::{Exposure, FramePublisher, stage};
use tryon_kit::sessions::unix_ns;
use tryon_proto::v1::{self, CameraState};

/// Pause after an unreadable frame, so that a broken recording does not spin.
const AFTER_FAULT: Duration = Duration::from_millis(100);
/// Unreadable frames in a row after which a source counts as failed.
const MAX_FAULTS: u32 = 30;

/// Likely cause of frames without a receiver.
const UNRECEIVED: &str = "somebody consented to frames that nobody receives: do bus.connect of tracking and compositor, and \
                          the router's connect.endpoints, lead to this process?";

/// Reader of one run of a source.
pub(crate) struct Reader {
    /// `None` while its thread reads it.
    pub(crate) source: Option<OpenSource>,
    /// Thread of the source. It waits for a device, or makes frames ahead of their time.
    pub(crate) thread: Arc<Pool>,
    pub(crate) calibration: Arc<Calibration>,
    pub(crate) epoch: u64,
    pub(crate) config: CameraConfig,
    pub(crate) info: Arc<watch::Sender<v1::CameraInfo>>,
    pub(crate) recorder: Recorder,
    pub(crate) leases: Leases,
    /// From here to somebody who receives the frames.
    pub(crate) flow: Flow,
}

/// Waits until somebody may see the frames; none is read before. The length of the wait.
async fn wanted(leases: &Leases, mut info: watch::Receiver<v1::CameraInfo>) -> Duration {
    if leases.sealer().is_some() {
        return Duration::ZERO;
    }
    let (begun, camera) = (Instant::now(), info.borrow().camera.clone());
    let is_watched = metrics::gauge!("tryon_capture_watched", "camera" => camera);
    is_watched.set(0.0);
    let recording = async { info.wait_for(|i| i.recording).await.is_ok() };
    tokio::select! {
        () = leases.begun() => {}
        _ = recording => {}
    }
    is_watched.set(1.0);
    begun.elapsed()
}

impl Reader {
    fn end(&self, state: CameraState, why: String) {
        tracing::info!(camera = self.config.name, ?state, %why, "the source has ended");
        self.info.send_modify(|i| {
            i.set_state(state);
            i.detail = why;
        });
    }

    /// Shows, once, that the recording has ended by a fault; StopRecording tells its kind. Publishing goes on.
    fn recording_failed(&self) {
        let is_first = self
            .info
            .send_if_modified(|i| std::mem::replace(&mut i.recording, false));
        if is_first {
            metrics::counter!("tryon_recordings_failed").increment(1);
            tracing::error!(camera = self.config.name, "the recording cannot be written");
        }
    }

    /// The next frame; a looped source rewinds at its end.
    async fn read(&mut self) -> Result<Option<RgbdFrame>, String> {
        let Some(mut source) = self.source.take() else {
            return Err("the source was lost to a panic".into());
        };
        let looped = self.config.looped;
        let read = move || {
            let frame = match source.next_frame() {
                Ok(None) if looped && !source.is_empty() => {
                    source.rewind().and_then(|()| source.next_frame())
                }
                other => other,
            };
            (source, frame)
        };
        let (source, frame) = self.thread.run(read).await.map_err(|e| e.to_string())?;
        self.source = Some(source);
        frame.map_err(|e| e.to_string())
    }

    /// Publishes frames until the source ends or fails.
    pub(crate) async fn run(mut self, mut publisher: Box<dyn FramePublisher>) {
        let (mut pace, mut faults, mut sequence) = (Pace::new(), 0, 0);
        let mut sampler = Sampler::default();
        loop {
            let pause = wanted(&self.leases, self.info.subscribe()).await;
            if !pause.is_zero() {
                self.flow.moves();
            }
            // The clock of a camera that is fed goes on by itself.
            if !is_push(&self.config.source) {
                pace.pause(pause);
            }
            let start = Instant::now();
            let frame = match self.read().await {
                Ok(Some(f)) => f,
                Ok(None) => return self.end(CameraState::Ended, String::new()),
                Err(why) => {
                    faults += 1;
                    tracing::warn!(camera = self.config.name, %why, "left out a frame");
                    metrics::counter!("tryon_capture_faults").increment(1);
                    if faults == MAX_FAULTS || self.source.is_none() {
                        return self.end(CameraState::Failed, why);
                    }
                    tokio::time::sleep(AFTER_FAULT).await;
                    continue;
                }
            };
            faults = 0;
            let read = stage("capture.read", start);
            let (time_ns, due) = pace.next(frame.time_ns, &self.config);
            if let Some(due) = due {
                tokio::time::sleep_until(due).await;
            }
            let received_unix_ns = unix_ns();
            let id = v1::FrameId {
                epoch: self.epoch,
                sequence,
                capture_time_ns: time_ns,
                received_unix_ns,
                trace: sampler.trace(received_unix_ns),
            };
            sequence += 1;
            let rgbd = RgbdFrame {
                sequence: id.sequence,
                time_ns,
                ..frame
            };
            let exposure = Arc::new(Exposure {
                id,
                calibration: self.calibration.clone(),
                rgbd,
                stages: vec![read.clone()],
            });
            if !self.recorder.offer(&exposure) {
                self.recording_failed();
            }
            // The consent may have ended since the frame was read.
            let Some(sealer) = self.leases.sealer() else {
                continue;
            };
            let sending = Instant::now();
            match publisher.send(exposure, sealer).await {
                Ok(true) => self.flow.moves(),
                Ok(false) => self.flow.waits(|| UNRECEIVED.into()),
                Err(e) => {
                    tracing::warn!(camera = self.config.name, error = %e, "a frame did not get out");
                    self.flow.waits(|| format!("frames do not get out: {e}"));
                }
            }
            frame_trace::record("capture", &id, &[read, stage("capture.publish", sending)]);
            metrics::counter!("tryon_capture_frames").increment(1);
            self.info.send_if_modified(|i| {
                i.frames += 1;
                // The count alone wakes no receiver.
                false
            });
        }
    }
}
