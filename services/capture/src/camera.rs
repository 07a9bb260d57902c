//! One camera: the task that owns it, its clock, its epochs.

use crate::recorder::{Recorder, Recording};
use crate::source::{OpenSource, open};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, oneshot, watch};
use tokio_util::sync::CancellationToken;
use tonic::Status;
use tryon::camera::{Calibration, RgbdFrame};
use tryon_kit::config::CameraConfig;
use tryon_kit::frames::{CameraKey, Exposure, FramePublisher, stage};
use tryon_kit::server::Context;
use tryon_kit::sessions::{random_u64, unix_ns};
use tryon_kit::status::unavailable;
use tryon_proto::v1::{self, CameraState};

/// A pause after a frame that could not be read, so that a broken recording does not spin.
const AFTER_FAULT: Duration = Duration::from_millis(100);
/// Bad frames in a row after which a source counts as failed.
const MAX_FAULTS: u32 = 30;

type Answer<T> = oneshot::Sender<Result<T, Status>>;

/// What a camera can be told.
pub(crate) enum Command {
    Start(Answer<v1::CameraInfo>),
    Stop(Answer<v1::CameraInfo>),
    Calibration(Answer<Calibration>),
    Record {
        folder: PathBuf,
        answer: Answer<String>,
    },
    EndRecording(Answer<Recording>),
}

/// How others reach the task.
pub(crate) struct Handle {
    pub(crate) commands: mpsc::Sender<Command>,
    pub(crate) info: watch::Receiver<v1::CameraInfo>,
}

/// Starts the task of a camera; it ends with `ctx.shutdown`.
pub(crate) fn spawn(config: CameraConfig, key: CameraKey, ctx: Context) -> Handle {
    let info = v1::CameraInfo {
        store: key.store().into(),
        camera: key.camera().into(),
        source: shown(&config.source),
        state: CameraState::Stopped.into(),
        ..Default::default()
    };
    let (tell, info) = watch::channel(info);
    let (commands, inbox) = mpsc::channel(8);
    let recorder = Recorder::default();
    tokio::spawn(
        Task {
            config,
            key,
            ctx,
            tell: Arc::new(tell),
            recorder,
            run: None,
        }
        .serve(inbox),
    );
    Handle { commands, info }
}

/// A recording is shown by its file name only: paths are nobody's business outside the box.
fn shown(source: &str) -> String {
    std::path::Path::new(source)
        .file_name()
        .map_or_else(|| source.into(), |n| n.to_string_lossy().into_owned())
}

struct Run {
    stop: CancellationToken,
    task: tokio::task::JoinHandle<()>,
    calibration: Calibration,
}

struct Task {
    config: CameraConfig,
    key: CameraKey,
    ctx: Context,
    tell: Arc<watch::Sender<v1::CameraInfo>>,
    recorder: Recorder,
    run: Option<Run>,
}

impl Task {
    async fn serve(mut self, mut inbox: mpsc::Receiver<Command>) {
        let shutdown = self.ctx.shutdown.clone();
        loop {
            let command = tokio::select! {
                c = inbox.recv() => c,
                () = shutdown.cancelled() => None,
            };
            let Some(command) = command else { break };
            // A caller that hung up meanwhile is no error.
            match command {
                Command::Start(answer) => drop(answer.send(self.start().await)),
                Command::Stop(answer) => {
                    self.stop().await;
                    let _ = answer.send(Ok(self.tell.borrow().clone()));
                }
                Command::Calibration(answer) => drop(answer.send(self.calibration().await)),
                Command::Record { folder, answer } => drop(answer.send(self.record(folder).await)),
                Command::EndRecording(answer) => drop(answer.send(self.end_recording().await)),
            }
        }
        self.stop().await;
    }

    async fn open(&self) -> Result<OpenSource, String> {
        let name = self.config.source.clone();
        match self.ctx.pool.run(move || open(&name)).await {
            Ok(opened) => opened.map_err(|e| e.to_string()),
            Err(e) => Err(e.to_string()),
        }
    }

    async fn start(&mut self) -> Result<v1::CameraInfo, Status> {
        if self.run.as_ref().is_some_and(|r| !r.task.is_finished()) {
            return Err(Status::failed_precondition(format!(
                "camera `{}` is running",
                self.key.camera()
            )));
        }
        self.stop().await;
        let source = match self.open().await {
            Ok(s) => s,
            Err(why) => {
                tracing::warn!(camera = %self.key, %why, "cannot be opened");
                self.tell.send_modify(|i| {
                    i.set_state(CameraState::Failed);
                    i.detail = why.clone();
                });
                return Err(unavailable("capture", &why));
            }
        };
        let calibration = source.calibration().clone();
        let publisher = self.ctx.bus.publish(&self.key, &calibration).await;
        let publisher = publisher.map_err(|e| unavailable("capture", &e.to_string()))?;
        let epoch = random_u64();
        self.tell.send_modify(|i| {
            i.set_state(CameraState::Running);
            (i.epoch, i.frames, i.detail) = (epoch, 0, String::new());
        });
        let stop = self.ctx.shutdown.child_token();
        let reader = Reader {
            source: Some(source),
            calibration: Arc::new(calibration.clone()),
            epoch,
            config: self.config.clone(),
            ctx: self.ctx.clone(),
            tell: self.tell.clone(),
            recorder: self.recorder.clone(),
        };
        let stopped = stop.clone();
        let task = tokio::spawn(async move {
            tokio::select! {
                () = reader.run(publisher) => {}
                () = stopped.cancelled() => {}
            }
        });
        self.run = Some(Run {
            stop,
            task,
            calibration,
        });
        tracing::info!(camera = %self.key, epoch, "publishing");
        Ok(self.tell.borrow().clone())
    }

    async fn stop(&mut self) {
        if let Some(run) = self.run.take() {
            run.stop.cancel();
            let _ = run.task.await;
        }
        let _ = self.end_recording().await;
        self.tell.send_modify(|i| {
            if i.state() == CameraState::Running {
                i.set_state(CameraState::Stopped);
            }
        });
    }

    async fn calibration(&self) -> Result<Calibration, Status> {
        if let Some(run) = &self.run {
            return Ok(run.calibration.clone());
        }
        self.open()
            .await
            .map(|s| s.calibration().clone())
            .map_err(|why| unavailable("capture", &why))
    }

    async fn record(&mut self, folder: PathBuf) -> Result<String, Status> {
        let Some(run) = self.run.as_ref().filter(|r| !r.task.is_finished()) else {
            return Err(Status::failed_precondition(format!(
                "camera `{}` does not run",
                self.key.camera()
            )));
        };
        let name = format!(
            "{}-{}-{}.mcap",
            self.key.store(),
            self.key.camera(),
            unix_ns() / 1_000_000_000
        );
        self.recorder
            .begin(folder.join(&name), run.calibration.clone())
            .await?;
        self.tell.send_modify(|i| i.recording = true);
        Ok(name)
    }

    async fn end_recording(&mut self) -> Result<Recording, Status> {
        let done = self.recorder.end().await;
        self.tell.send_modify(|i| i.recording = false);
        done
    }
}

/// Reads a source at its pace and publishes it.
struct Reader {
    /// Away while the pool reads it.
    source: Option<OpenSource>,
    calibration: Arc<Calibration>,
    epoch: u64,
    config: CameraConfig,
    ctx: Context,
    tell: Arc<watch::Sender<v1::CameraInfo>>,
    recorder: Recorder,
}

/// Turns the times of a source, round after round, into times to wait for.
struct Pace {
    begun: tokio::time::Instant,
    /// Nanoseconds of the source at `begun`, and what earlier rounds add.
    first_ns: Option<u64>,
    added_ns: u64,
    last_ns: u64,
    step_ns: u64,
    frames: u64,
}

impl Pace {
    fn new() -> Self {
        let begun = tokio::time::Instant::now();
        Self {
            begun,
            first_ns: None,
            added_ns: 0,
            last_ns: 0,
            step_ns: 33_333_333,
            frames: 0,
        }
    }
    /// The frame's time on a clock that never runs back, and when to show it.
    fn next(&mut self, time_ns: u64, config: &CameraConfig) -> (u64, Option<tokio::time::Instant>) {
        let first = *self.first_ns.get_or_insert(time_ns);
        let mut at = time_ns.saturating_sub(first) + self.added_ns;
        if self.frames > 0 && at <= self.last_ns {
            // A new round, or a clock that jumped back: go on where the last frame was.
            self.added_ns = self.last_ns + self.step_ns;
            self.first_ns = Some(time_ns);
            at = self.added_ns;
        } else if self.frames > 0 {
            self.step_ns = (at - self.last_ns).clamp(1_000_000, 1_000_000_000);
        }
        let due = if config.fast {
            None
        } else if config.rate > 0.0 {
            Some(self.begun + Duration::from_secs_f64(self.frames as f64 / config.rate))
        } else {
            Some(self.begun + Duration::from_nanos(at))
        };
        self.last_ns = at;
        self.frames += 1;
        (first + at, due)
    }
}

impl Reader {
    fn end(&self, state: CameraState, why: String) {
        tracing::info!(camera = self.config.name, ?state, %why, "the source has ended");
        self.tell.send_modify(|i| {
            i.set_state(state);
            i.detail = why;
        });
    }

    /// The next frame; rewinds at the end where that is wanted.
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
        let (source, frame) = self.ctx.pool.run(read).await.map_err(|e| e.to_string())?;
        self.source = Some(source);
        frame.map_err(|e| e.to_string())
    }

    async fn run(mut self, mut publisher: Box<dyn FramePublisher>) {
        let (mut pace, mut faults, mut sequence) = (Pace::new(), 0, 0);
        loop {
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
            let id = v1::FrameId {
                epoch: self.epoch,
                sequence,
                capture_time_ns: time_ns,
                received_unix_ns: unix_ns(),
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
                stages: vec![read],
            });
            self.recorder.offer(&exposure);
            if let Err(e) = publisher.send(exposure).await {
                tracing::warn!(camera = self.config.name, error = %e, "a frame did not get out");
            }
            metrics::counter!("tryon_capture_frames").increment(1);
            self.tell.send_if_modified(|i| {
                i.frames += 1;
                // Nobody waits for a count.
                false
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_never_runs_back_and_rounds_follow_each_other() {
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
