//! Task of one session: its tracker, its clock.

use crate::engine::{Engine, PreparedModel, SessionCounts};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use tryon_kit::compute::ComputeError;
use tryon_kit::consent::{FORGET_AFTER, REMEMBER_FOR};
use tryon_kit::flow::Flow;
use tryon_kit::frames::{CameraKey, Exposure, FrameSubscription};
use tryon_kit::server::Context;
use tryon_kit::session_task::{self, Place};
use tryon_kit::sessions::{Sessions, brief};
use tryon_kit::telemetry::record_stages;
use tryon_proto::v1::{self, DegradedReason, TrackingStatus};
use tryon_tracking::KnownBody;

/// Time without a frame after which the camera counts as silent: half of the time in which clients must know.
const SILENCE: Duration = Duration::from_millis(500);

/// Interval of searches while nobody is in view: a person who comes is found within it. More is noticed, less costs more.
const SEARCH_EVERY: Duration = Duration::from_millis(100);

/// Access to a session from the rpcs.
pub(crate) struct Handle {
    pub(crate) key: CameraKey,
    pub(crate) commands: mpsc::Sender<Command>,
    /// Ends the session, also in the middle of a step: on a busy machine that waits for seconds.
    pub(crate) closing: CancellationToken,
    pub(crate) states: watch::Receiver<Arc<v1::BodyState>>,
}

/// Command to a session.
pub(crate) enum Command {
    /// Forgets body and pose.
    Reset,
    /// Keeps the session open.
    Touch,
    /// Goes on with a body that was measured before, unless there is one.
    Know(Arc<KnownBody>),
}

/// Dependencies of a session's task.
pub(crate) struct Setup {
    pub(crate) id: String,
    pub(crate) key: CameraKey,
    pub(crate) ctx: Context,
    pub(crate) model: PreparedModel,
    pub(crate) idle: Duration,
    /// Body that was measured before.
    pub(crate) known: Option<Arc<KnownBody>>,
    pub(crate) directory: Sessions<Handle>,
}

/// Likely cause of a camera's silence.
fn silence(frames: &FrameSubscription) -> &'static str {
    if frames.alive() {
        "the camera is on the bus but sends nothing"
    } else {
        "the camera is not on the bus: is capture up, do bus.connect and the router lead to it?"
    }
}

/// State of a session that knows of nobody.
fn searching(id: &str) -> v1::BodyState {
    v1::BodyState {
        session_id: id.into(),
        status: TrackingStatus::Searching.into(),
        reason: DegradedReason::NoPerson.into(),
        ..Default::default()
    }
}

/// Starts the task of a session.
pub(crate) fn spawn(setup: Setup) -> Handle {
    let mut first = searching(&setup.id);
    first.subject = setup.known.as_ref().map_or(0, |k| k.subject);
    let (sender, states) = watch::channel(Arc::new(first));
    let (commands, inbox) = mpsc::channel(8);
    let key = setup.key.clone();
    let closing = CancellationToken::new();
    let closed = closing.clone();
    tokio::spawn(async move {
        let id = setup.id.clone();
        let is_over = |h: &Handle| h.commands.is_closed();
        let _place = Place::new(
            setup.directory.clone(),
            &id,
            "tryon_tracking_sessions",
            is_over,
        );
        let flow = format!("session {} of {}", brief(&id), setup.key);
        let task = Task {
            flow: setup.ctx.stalls.flow("tracking", flow),
            known: setup.known.clone().map(GivenBody::now),
            setup,
            states: sender,
            engine: None,
            counts: SessionCounts::default(),
        }
        .run(inbox);
        let task = async move {
            tokio::select! {
                biased;
                () = closed.cancelled() => "asked to",
                why = task => why,
            }
        };
        let why = session_task::run("tracking", &id, task).await;
        tracing::info!(session = brief(&id), why, "closed");
    });
    Handle {
        key,
        commands,
        closing,
        states,
    }
}

/// Body that a caller remembers, until the tracker has it.
struct GivenBody {
    body: Arc<KnownBody>,
    at: Instant,
}

impl GivenBody {
    fn now(body: Arc<KnownBody>) -> Self {
        Self {
            body,
            at: Instant::now(),
        }
    }
}

struct Task {
    setup: Setup,
    states: watch::Sender<Arc<v1::BodyState>>,
    /// `None` while the pool steps it.
    engine: Option<Engine>,
    counts: SessionCounts,
    /// Known body that nobody was found for yet.
    known: Option<GivenBody>,
    /// Frames of the camera.
    flow: Flow,
}

impl Task {
    async fn run(mut self, mut inbox: mpsc::Receiver<Command>) -> &'static str {
        let mut frames = match self.setup.ctx.bus.subscribe(&self.setup.key).await {
            Ok(f) => f,
            Err(e) => {
                tracing::error!(session = brief(&self.setup.id), error = %e, "cannot subscribe");
                return "the bus refused";
            }
        };
        let shutdown = self.setup.ctx.shutdown.clone();
        let mut tick = tokio::time::interval(SILENCE / 2);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let now = Instant::now();
        let (mut received, mut published, mut wanted, mut due) = (now, now, now, now);
        loop {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => return "shutting down",
                c = inbox.recv() => match c {
                    Some(Command::Reset) => self.reset(),
                    Some(Command::Know(body)) => self.known = Some(GivenBody::now(body)),
                    Some(Command::Touch) => wanted = Instant::now(),
                    None => return "asked to",
                },
                frame = frames.next_from(due) => match frame {
                    Some(f) => {
                        self.flow.moves();
                        let taken = Instant::now();
                        self.step(f, frames.skipped()).await;
                        due = if self.is_nobody() { taken + SEARCH_EVERY } else { taken };
                        (received, published) = (Instant::now(), Instant::now());
                    }
                    None => return "the bus is gone",
                },
                _ = tick.tick() => {
                    if received.elapsed() >= FORGET_AFTER {
                        self.forget();
                    }
                    self.forget_known();
                    if received.elapsed() >= SILENCE {
                        // On the bus and silent: without a lease of consent nothing is to come.
                        if frames.alive() {
                            self.flow.moves();
                        } else {
                            self.flow.waits(|| silence(&frames).into());
                        }
                        if published.elapsed() >= SILENCE {
                            self.fault(DegradedReason::CameraSilent, silence(&frames).into());
                            published = Instant::now();
                        }
                    }
                    // One receiver is the handle of the directory.
                    if self.states.receiver_count() > 1 {
                        wanted = Instant::now();
                    } else if wanted.elapsed() > self.setup.idle {
                        return "nobody reads it";
                    }
                }
            }
        }
    }

    /// Nobody is in view.
    fn is_nobody(&self) -> bool {
        let reason = self.states.borrow().reason();
        matches!(
            reason,
            DegradedReason::NoPerson | DegradedReason::PersonLeft
        )
    }

    async fn step(&mut self, exposure: Arc<Exposure>, skipped: u64) {
        let engine = self.engine.take();
        let (model, counts) = (self.setup.model.clone(), self.counts);
        let given = self.known.as_ref().map(|k| k.body.clone());
        let work = move || {
            // Of another run of the camera, within a second.
            let own = (engine.as_ref())
                .filter(|e| !e.is_for(&exposure))
                .and_then(Engine::known_body);
            let known = own.map(Arc::new).or(given);
            let fresh = || {
                Engine::new(
                    &model,
                    exposure.calibration.clone(),
                    exposure.id.epoch,
                    counts,
                )
            };
            let mut engine = engine.filter(|e| e.is_for(&exposure)).unwrap_or_else(fresh);
            if let Some(known) = known {
                engine.know(&known);
            }
            let state = engine.step(&exposure);
            (engine, state)
        };
        match self.setup.ctx.pool.run(work).await {
            Ok((engine, mut state)) => {
                self.counts = engine.counts();
                self.known.take_if(|_| !engine.is_known_awaited());
                state.session_id = self.setup.id.clone();
                state.frames_dropped = skipped;
                record_stages("tracking", state.frame.as_ref(), &state.stages);
                metrics::counter!("tryon_tracking_steps").increment(1);
                self.states.send_replace(Arc::new(state));
                self.adapt(engine).await;
            }
            Err(why) => self.lost(&why),
        }
    }

    /// Second half of a step, while others work on the pose.
    async fn adapt(&mut self, mut engine: Engine) {
        let work = move || {
            engine.adapt();
            engine
        };
        match self.setup.ctx.pool.run(work).await {
            Ok(engine) => self.engine = Some(engine),
            Err(why) => self.lost(&why),
        }
    }

    /// The tracker is lost to its panic: the next frame starts a new one.
    fn lost(&mut self, why: &ComputeError) {
        tracing::error!(session = brief(&self.setup.id), %why, "a step was lost");
        self.fault(DegradedReason::StepFailed, why.to_string());
    }

    /// Forgets body and pose on request.
    fn reset(&mut self) {
        self.known = None;
        if let Some(e) = &mut self.engine {
            e.reset();
        }
    }

    /// Drops a known body for which nobody came.
    fn forget_known(&mut self) {
        let is_late = |k: &mut GivenBody| k.at.elapsed() > REMEMBER_FOR;
        if self.known.take_if(is_late).is_some()
            && let Some(e) = self.engine.as_mut().filter(|e| e.is_known_awaited())
        {
            e.reset();
        }
    }

    /// Drops body and pose: nobody knows who stands before the camera now.
    fn forget(&mut self) {
        if self.engine.take().is_some() {
            self.states
                .send_replace(Arc::new(searching(&self.setup.id)));
        }
    }

    /// Repeats the last state as lost, or as searching when there never was one.
    fn fault(&mut self, reason: DegradedReason, detail: String) {
        let mut state = v1::BodyState::clone(&self.states.borrow());
        if state.pose.is_some() {
            state.set_status(TrackingStatus::Lost);
        }
        state.set_reason(reason);
        state.detail = detail;
        state.age_frames = state.age_frames.saturating_add(1);
        self.states.send_replace(Arc::new(state));
    }
}
