//! One session: its task, its tracker, its clock.

use crate::engine::Engine;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio::time::Instant;
use tryon::body::Template;
use tryon_kit::frames::{CameraKey, Exposure, FrameSubscription};
use tryon_kit::server::Context;
use tryon_kit::sessions::Sessions;
use tryon_kit::telemetry::record_stages;
use tryon_proto::v1::{self, DegradedReason, TrackingStatus};

/// A camera that says nothing for this long is silent; half of what a client may wait for the news.
const SILENCE: Duration = Duration::from_millis(500);

/// The end that was asked for.
const ASKED: &str = "asked to";

/// How others reach a session.
pub(crate) struct Handle {
    pub(crate) key: CameraKey,
    pub(crate) commands: mpsc::Sender<Command>,
    pub(crate) states: watch::Receiver<Arc<v1::BodyState>>,
}

/// What a session can be told.
pub(crate) enum Command {
    Reset,
    Close,
    /// Somebody opened it again: it is wanted.
    Touch,
}

/// What a session's task needs.
pub(crate) struct Setup {
    pub(crate) id: String,
    pub(crate) key: CameraKey,
    pub(crate) ctx: Context,
    pub(crate) template: Arc<Template>,
    pub(crate) idle: Duration,
    pub(crate) directory: Sessions<Handle>,
}

/// Starts the task of a session.
pub(crate) fn spawn(setup: Setup) -> Handle {
    let first = v1::BodyState {
        session_id: setup.id.clone(),
        status: TrackingStatus::Searching.into(),
        reason: DegradedReason::NoPerson.into(),
        ..Default::default()
    };
    let (tell, states) = watch::channel(Arc::new(first));
    let (commands, inbox) = mpsc::channel(8);
    let key = setup.key.clone();
    tokio::spawn(async move {
        let (id, directory) = (setup.id.clone(), setup.directory.clone());
        let why = Task {
            setup,
            tell,
            engine: None,
            shape_version: 0,
        }
        .run(inbox)
        .await;
        // Who asked for the end has taken it out already, and may have opened another of that id.
        if why != ASKED {
            directory.remove(&id);
        }
        metrics::gauge!("tryon_tracking_sessions").set(directory.len() as f64);
        tracing::info!(session = id, why, "closed");
    });
    Handle {
        key,
        commands,
        states,
    }
}

struct Task {
    setup: Setup,
    tell: watch::Sender<Arc<v1::BodyState>>,
    /// Away while the pool steps it.
    engine: Option<Engine>,
    shape_version: u64,
}

impl Task {
    async fn run(mut self, mut inbox: mpsc::Receiver<Command>) -> &'static str {
        let mut frames = match self.setup.ctx.bus.subscribe(&self.setup.key).await {
            Ok(f) => f,
            Err(e) => {
                tracing::error!(session = self.setup.id, error = %e, "cannot subscribe");
                return "the bus refused";
            }
        };
        let shutdown = self.setup.ctx.shutdown.clone();
        let mut tick = tokio::time::interval(SILENCE / 2);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let (mut heard, mut said, mut wanted) = (Instant::now(), Instant::now(), Instant::now());
        loop {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => return "shutting down",
                c = inbox.recv() => match c {
                    Some(Command::Reset) => if let Some(e) = &mut self.engine { e.reset() },
                    Some(Command::Touch) => wanted = Instant::now(),
                    Some(Command::Close) | None => return ASKED,
                },
                frame = frames.next() => match frame {
                    Some(f) => {
                        self.step(f, frames.skipped()).await;
                        (heard, said) = (Instant::now(), Instant::now());
                    }
                    None => return "the bus is gone",
                },
                _ = tick.tick() => {
                    if heard.elapsed() >= SILENCE && said.elapsed() >= SILENCE {
                        self.silent(&frames);
                        said = Instant::now();
                    }
                    // One receiver is the handle in the directory.
                    if self.tell.receiver_count() > 1 {
                        wanted = Instant::now();
                    } else if wanted.elapsed() > self.setup.idle {
                        return "nobody reads it";
                    }
                }
            }
        }
    }

    async fn step(&mut self, exposure: Arc<Exposure>, skipped: u64) {
        let engine = self.engine.take().filter(|e| e.fits(&exposure));
        let (template, version) = (self.setup.template.clone(), self.shape_version);
        let work = move || {
            let fresh = || {
                Engine::new(
                    template,
                    exposure.calibration.clone(),
                    exposure.id.epoch,
                    version,
                )
            };
            let mut engine = engine.unwrap_or_else(fresh);
            let state = engine.step(&exposure);
            (engine, state)
        };
        match self.setup.ctx.pool.run(work).await {
            Ok((engine, mut state)) => {
                self.shape_version = engine.shape_version();
                self.engine = Some(engine);
                state.session_id = self.setup.id.clone();
                state.frames_dropped = skipped;
                record_stages("tracking", &state.stages);
                metrics::counter!("tryon_tracking_steps").increment(1);
                self.tell.send_replace(Arc::new(state));
            }
            Err(why) => {
                // The tracker went down with its panic: start over, and say so.
                tracing::error!(session = self.setup.id, %why, "a step was lost");
                self.fault(DegradedReason::StepFailed, why.to_string());
            }
        }
    }

    fn silent(&mut self, frames: &FrameSubscription) {
        let why = if frames.alive() {
            "the camera is on the bus but sends nothing"
        } else {
            "the camera is not on the bus"
        };
        self.fault(DegradedReason::CameraSilent, why.into());
    }

    /// Repeats the last state as lost, or as searching when there never was one.
    fn fault(&mut self, reason: DegradedReason, detail: String) {
        let mut state = v1::BodyState::clone(&self.tell.borrow());
        if state.pose.is_some() {
            state.set_status(TrackingStatus::Lost);
        }
        state.set_reason(reason);
        state.detail = detail;
        state.age_frames = state.age_frames.saturating_add(1);
        self.tell.send_replace(Arc::new(state));
    }
}
