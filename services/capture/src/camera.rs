//! Task of one camera: commands, state, epochs.

use crate::consent::Leases;
use crate::live::{Awaited, DriverCalls, Liveness, Opening, say_lost, until_back};
use crate::push::{Feed, Newest, is_push};
use crate::reader::{ReadEnd, Reader};
use crate::recorder::{Recorder, Recording};
use crate::source::{OpenSource, liveness, upright};
use std::future::pending;
use std::path::PathBuf;
use std::sync::Arc;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;
use tonic::Status;
use tryon_geometry::camera::Calibration;
use tryon_kit::compute::Pool;
use tryon_kit::config::CameraConfig;
use tryon_kit::frames::CameraKey;
use tryon_kit::server::Context;
use tryon_kit::sessions::{random_u64, unix_ns};
use tryon_kit::status::unavailable;
use tryon_proto::v1::{self, CameraState};

type Answer<T> = oneshot::Sender<Result<T, Status>>;

/// Command to a camera.
pub(crate) enum Command {
    Start(Answer<v1::CameraInfo>),
    /// Runs a camera that a program feeds.
    Feed {
        feed: Feed,
        answer: Answer<v1::CameraInfo>,
    },
    Stop(Answer<v1::CameraInfo>),
    Calibration(Answer<Calibration>),
    Record {
        folder: PathBuf,
        answer: Answer<String>,
    },
    EndRecording(Answer<Recording>),
}

/// Access to a camera from the rpcs.
#[derive(Clone)]
pub(crate) struct Handle {
    pub(crate) commands: mpsc::Sender<Command>,
    pub(crate) info: watch::Receiver<v1::CameraInfo>,
    pub(crate) leases: Leases,
}

impl Handle {
    /// Somebody consents to be seen, or frames are recorded.
    pub(crate) fn is_watched(&self) -> bool {
        self.leases.sealer().is_some() || self.info.borrow().recording
    }
}

/// Starts the task of a camera; it ends with `ctx.shutdown`.
pub(crate) fn spawn(mut opening: Opening, key: CameraKey, ctx: Context) -> Handle {
    let config = &mut opening.camera;
    let liveness = liveness(&config.source);
    if liveness != Liveness::Patient {
        // Its frames come at their pace, once.
        (config.fast, config.looped) = (true, false);
    }
    let config = opening.camera.clone();
    let info = v1::CameraInfo {
        store: key.store().into(),
        camera: key.camera().into(),
        source: shown(&config.source),
        state: CameraState::Stopped.into(),
        ..Default::default()
    };
    let (sender, info) = watch::channel(info);
    let (commands, inbox) = mpsc::channel(8);
    let (recorder, leases) = (Recorder::default(), Leases::default());
    tokio::spawn(
        Task {
            config,
            key,
            ctx,
            info: Arc::new(sender),
            recorder,
            leases: leases.clone(),
            liveness,
            opening,
            calls: DriverCalls::default(),
            run: None,
            awaited: Awaited::default(),
        }
        .serve(inbox),
    );
    Handle {
        commands,
        info,
        leases,
    }
}

/// Name of a source outside the box: of a recording the file name only.
fn shown(source: &str) -> String {
    if liveness(source) != Liveness::Patient {
        return source.into();
    }
    std::path::Path::new(source)
        .file_name()
        .map_or_else(|| source.into(), |n| n.to_string_lossy().into_owned())
}

/// Run of a camera from start to stop.
struct Run {
    stop: CancellationToken,
    task: JoinHandle<()>,
    /// Its end, unless somebody stopped it.
    end: oneshot::Receiver<ReadEnd>,
    calibration: Calibration,
    /// Frames of the program that feeds it.
    newest: Option<Arc<Newest>>,
}

struct Task {
    config: CameraConfig,
    key: CameraKey,
    ctx: Context,
    info: Arc<watch::Sender<v1::CameraInfo>>,
    recorder: Recorder,
    leases: Leases,
    liveness: Liveness,
    opening: Opening,
    calls: DriverCalls,
    run: Option<Run>,
    awaited: Awaited,
}

/// Waits until a run has lost its device.
async fn lost(run: &mut Option<Run>) {
    let end = match run {
        Some(run) if !run.end.is_terminated() => (&mut run.end).await,
        _ => pending().await,
    };
    if end != Ok(ReadEnd::Lost) {
        pending().await
    }
}

impl Task {
    async fn serve(mut self, mut inbox: mpsc::Receiver<Command>) {
        let shutdown = self.ctx.shutdown.clone();
        loop {
            let command = tokio::select! {
                c = inbox.recv() => c,
                () = shutdown.cancelled() => None,
                () = lost(&mut self.run) => {
                    self.await_device();
                    continue;
                }
                source = self.awaited.back() => {
                    self.returned(source).await;
                    continue;
                }
            };
            let Some(command) = command else { break };
            // The send fails when the caller has hung up.
            match command {
                Command::Start(answer) => drop(answer.send(self.start().await)),
                Command::Feed { feed, answer } => drop(answer.send(self.feed(feed).await)),
                Command::Stop(answer) => {
                    self.stop().await;
                    let _ = answer.send(Ok(self.info.borrow().clone()));
                }
                Command::Calibration(answer) => drop(answer.send(self.calibration().await)),
                Command::Record { folder, answer } => drop(answer.send(self.record(folder).await)),
                Command::EndRecording(answer) => drop(answer.send(self.end_recording().await)),
            }
        }
        self.stop().await;
    }

    async fn open(&self) -> Result<OpenSource, String> {
        let opening = self.opening.clone();
        let opened = self.ctx.pool.run(move || opening.open()).await;
        opened
            .map_err(|e| e.to_string())?
            .map_err(|e| e.to_string())
    }

    async fn start(&mut self) -> Result<v1::CameraInfo, Status> {
        if self.awaited.is_running() || self.run.as_ref().is_some_and(|r| !r.task.is_finished()) {
            return Err(Status::failed_precondition(format!(
                "camera `{}` is running",
                self.key.camera()
            )));
        }
        self.stop().await;
        if self.liveness == Liveness::Reopened {
            say_lost(&self.info, "is being opened");
            self.await_device();
            return Ok(self.info.borrow().clone());
        }
        let source = match self.open().await {
            Ok(s) => s,
            Err(why) => {
                tracing::warn!(camera = %self.key, %why, "cannot be opened");
                self.info.send_modify(|i| {
                    i.set_state(CameraState::Failed);
                    i.detail = why.clone();
                });
                return Err(unavailable("capture", &why));
            }
        };
        self.read(source, None).await
    }

    /// Opens a device whenever it is there, with commands served meanwhile.
    fn await_device(&mut self) {
        let (opening, calls, info) = (self.opening.clone(), self.calls.clone(), self.info.clone());
        self.awaited.begin(until_back(opening, calls, info));
    }

    /// Reads a device that is back. A recording ends: its clock and calibration were those of before.
    async fn returned(&mut self, source: OpenSource) {
        if let Ok(done) = self.end_recording().await {
            tracing::warn!(camera = %self.key, file = done.file, "recorded until the device was lost");
        }
        if let Err(why) = self.read(source, None).await {
            say_lost(&self.info, why.message());
            self.await_device();
        }
    }

    /// Runs on the frames of a program; the one before it ends.
    async fn feed(&mut self, feed: Feed) -> Result<v1::CameraInfo, Status> {
        if !is_push(&self.config.source) {
            let why = format!("camera `{}` has a source of its own", self.key.camera());
            return Err(Status::failed_precondition(why));
        }
        self.stop().await;
        let source = match feed.device.as_str() {
            "" => self.config.source.clone(),
            device => format!("{}: {device}", self.config.source),
        };
        self.info.send_modify(|i| i.source = source);
        let upright = upright(&self.config, feed.source);
        self.read(upright, Some(feed.newest)).await
    }

    /// Reads a source under a new epoch.
    async fn read(
        &mut self,
        source: OpenSource,
        newest: Option<Arc<Newest>>,
    ) -> Result<v1::CameraInfo, Status> {
        let thread = Pool::background("source");
        let thread = thread.map_err(|e| unavailable("capture", &e.to_string()))?;
        let calibration = source.calibration().clone();
        let publisher = self.ctx.bus.publish(&self.key, &calibration).await;
        let publisher = publisher.map_err(|e| unavailable("capture", &e.to_string()))?;
        let epoch = random_u64();
        self.info.send_modify(|i| {
            i.set_state(CameraState::Running);
            (i.epoch, i.frames, i.detail) = (epoch, 0, String::new());
        });
        let stop = self.ctx.shutdown.child_token();
        let reader = Reader {
            source: Some(source),
            thread,
            calibration: Arc::new(calibration.clone()),
            epoch,
            config: self.config.clone(),
            info: self.info.clone(),
            recorder: self.recorder.clone(),
            leases: self.leases.clone(),
            liveness: self.liveness,
            calls: self.calls.clone(),
            flow: (self.ctx.stalls).flow("capture", format!("frames of {}", self.key)),
        };
        let stopped = stop.clone();
        let (ended, end) = oneshot::channel();
        let task = tokio::spawn(async move {
            tokio::select! {
                end = reader.run(publisher) => drop(ended.send(end)),
                () = stopped.cancelled() => {}
            }
        });
        self.run = Some(Run {
            stop,
            task,
            end,
            calibration,
            newest,
        });
        tracing::info!(camera = %self.key, epoch, "running");
        Ok(self.info.borrow().clone())
    }

    async fn stop(&mut self) {
        self.awaited.end();
        if let Some(run) = self.run.take() {
            if let Some(newest) = &run.newest {
                newest.close();
            }
            run.stop.cancel();
            let _ = run.task.await;
        }
        let _ = self.end_recording().await;
        self.info.send_modify(|i| {
            if matches!(i.state(), CameraState::Running | CameraState::Lost) {
                i.set_state(CameraState::Stopped);
            }
        });
    }

    async fn calibration(&self) -> Result<Calibration, Status> {
        if let Some(run) = &self.run {
            return Ok(run.calibration.clone());
        }
        if self.liveness == Liveness::Reopened {
            return Err(unavailable("capture", "the device is not open"));
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
        self.info.send_modify(|i| i.recording = true);
        Ok(name)
    }

    async fn end_recording(&mut self) -> Result<Recording, Status> {
        let done = self.recorder.end().await;
        self.info.send_modify(|i| i.recording = false);
        done
    }
}
