//! Reader of a source: frames at their pace, onto the bus under a lease of consent, and into a recording.

use crate::consent::Leases;
use crate::live::{DriverCalls, Liveness, Silence, say_back};
use crate::pace::{ClockFault, Pace};
use crate::recorder::Recorder;
use crate::source::OpenSource;
use std::convert::Infallible;
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

/// End of a run that nobody stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReadEnd {
    /// The source has ended or failed.
    Over,
    /// A device is to be opened anew.
    Lost,
}

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
    pub(crate) liveness: Liveness,
    pub(crate) calls: DriverCalls,
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
    fn end(&self, state: CameraState, why: String) -> ReadEnd {
        tracing::info!(camera = self.config.name, ?state, %why, "the source has ended");
        self.info.send_modify(|i| {
            i.set_state(state);
            i.detail = why;
        });
        ReadEnd::Over
    }

    /// Counts a fault of the clock; its frame is ordered after those before it.
    fn clock_fault(&self, fault: ClockFault) {
        let labels = [
            ("camera", self.config.name.clone()),
            ("fault", fault.name().into()),
        ];
        metrics::counter!("tryon_clock_faults", &labels).increment(1);
        tracing::debug!(
            camera = self.config.name,
            fault = fault.name(),
            "a clock at fault"
        );
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

    /// The next frame; a looped source rewinds at its end. `None` when a device is given up.
    async fn read(&mut self, silence: &Silence) -> Option<Result<Option<RgbdFrame>, String>> {
        let Some(mut source) = self.source.take() else {
            return Some(Err("the source was lost to a panic".into()));
        };
        let (looped, call) = (self.config.looped, self.calls.begin());
        let read = move || {
            let frame = match source.next_frame() {
                Ok(None) if looped && !source.is_empty() => {
                    source.rewind().and_then(|()| source.next_frame())
                }
                other => other,
            };
            drop(call);
            (source, frame)
        };
        // Dropped, it leaves a call that hangs to its thread, which ends with it.
        let read = silence.within(&self.info, self.thread.run(read)).await?;
        Some(match read {
            Ok((source, frame)) => {
                self.source = Some(source);
                frame.map_err(|e| e.to_string())
            }
            Err(e) => Err(e.to_string()),
        })
    }

    /// The source's next frame, or why it cannot be read; an error when the source is over.
    async fn next(&mut self, silence: &Silence) -> Result<Result<RgbdFrame, String>, ReadEnd> {
        let is_device = self.liveness == Liveness::Reopened;
        match self.read(silence).await {
            Some(Ok(Some(frame))) => Ok(Ok(frame)),
            None => Err(ReadEnd::Lost),
            Some(Ok(None)) if is_device => Err(ReadEnd::Lost),
            Some(Ok(None)) => Err(self.end(CameraState::Ended, String::new())),
            Some(Err(why)) if is_device && self.source.is_none() => {
                tracing::error!(camera = self.config.name, %why, "a driver is lost");
                Err(ReadEnd::Lost)
            }
            Some(Err(why)) => Ok(Err(why)),
        }
    }

    /// Leaves out an unreadable frame; the end after too many of them in a row.
    async fn leave_out(&mut self, why: String, faults: u32) -> Result<(), ReadEnd> {
        tracing::warn!(camera = self.config.name, %why, "left out a frame");
        metrics::counter!("tryon_capture_faults").increment(1);
        let is_device = self.liveness == Liveness::Reopened;
        if (faults == MAX_FAULTS && !is_device) || self.source.is_none() {
            return Err(self.end(CameraState::Failed, why));
        }
        tokio::time::sleep(AFTER_FAULT).await;
        Ok(())
    }

    /// Publishes an exposure if somebody may see it: the consent may have ended since it was read.
    async fn publish(&mut self, publisher: &mut dyn FramePublisher, exposure: Arc<Exposure>) {
        let Some(sealer) = self.leases.sealer() else {
            return;
        };
        let (id, read) = (exposure.id, exposure.stages.clone());
        let sending = Instant::now();
        match publisher.send(exposure, sealer).await {
            Ok(true) => self.flow.moves(),
            Ok(false) => self.flow.waits(|| UNRECEIVED.into()),
            Err(e) => {
                tracing::warn!(camera = self.config.name, error = %e, "a frame did not get out");
                self.flow.waits(|| format!("frames do not get out: {e}"));
            }
        }
        let stages: Vec<_> = (read.into_iter())
            .chain([stage("capture.publish", sending)])
            .collect();
        frame_trace::record("capture", &id, &stages);
        metrics::counter!("tryon_capture_frames").increment(1);
        self.info.send_if_modified(|i| {
            i.frames += 1;
            // The count alone wakes no receiver.
            false
        });
    }

    /// Publishes frames until the source ends, fails or is lost.
    pub(crate) async fn run(mut self, publisher: Box<dyn FramePublisher>) -> ReadEnd {
        match self.read_on(publisher).await {
            Ok(never) => match never {},
            Err(end) => end,
        }
    }

    async fn read_on(
        &mut self,
        mut publisher: Box<dyn FramePublisher>,
    ) -> Result<Infallible, ReadEnd> {
        let is_live = self.liveness != Liveness::Patient;
        let (mut pace, mut faults, mut sequence) = (Pace::new(is_live), 0, 0);
        let mut silence = Silence::new(self.liveness);
        let mut sampler = Sampler::default();
        loop {
            let pause = wanted(&self.leases, self.info.subscribe()).await;
            if !pause.is_zero() {
                self.flow.moves();
                silence = Silence::new(self.liveness);
            }
            pace.pause(pause);
            if faults == 0 {
                silence.restart();
            }
            let start = Instant::now();
            let frame = match self.next(&silence).await? {
                Ok(frame) => frame,
                Err(why) => {
                    faults += 1;
                    self.leave_out(why, faults).await?;
                    continue;
                }
            };
            faults = 0;
            silence.frame();
            say_back(&self.info);
            let read = stage("capture.read", start);
            let moment = pace.next(frame.time_ns, &self.config);
            if let Some(fault) = moment.fault {
                self.clock_fault(fault);
            }
            if let Some(due) = moment.due {
                tokio::time::sleep_until(due).await;
            }
            let received_unix_ns = unix_ns();
            let id = v1::FrameId {
                epoch: self.epoch,
                sequence,
                capture_time_ns: moment.time_ns,
                received_unix_ns,
                trace: sampler.trace(received_unix_ns),
            };
            sequence += 1;
            let exposure = Arc::new(Exposure {
                id,
                calibration: self.calibration.clone(),
                rgbd: RgbdFrame {
                    sequence: id.sequence,
                    time_ns: id.capture_time_ns,
                    ..frame
                },
                stages: vec![read],
            });
            if !self.recorder.offer(&exposure) {
                self.recording_failed();
            }
            self.publish(&mut *publisher, exposure).await;
        }
    }
}
