//! One try-on: its task, its life, its pictures.

use crate::card::Card;
use crate::engine::{Drawn, Encoding, Engine, Job, Placed};
use crate::life;
use crate::scene::{Body, Scene, not_after};
use crate::upstream::{self, Wanted};
use crate::viewer::Viewer;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::Instant;
use tonic::Status;
use tryon::session::{Ages, Effect, Event, Limits, Reason, State, transition};
use tryon_kit::bodies;
use tryon_kit::client::{CALL_DEADLINE, channel, request};
use tryon_kit::config::CompositorConfig;
use tryon_kit::frames::{CameraKey, Exposure, FrameSubscription};
use tryon_kit::queue::latest;
use tryon_kit::server::Context;
use tryon_kit::sessions::{Sessions, unix_ns};
use tryon_kit::status::unavailable;
use tryon_kit::telemetry::record_stages;
use tryon_proto::v1::tracking_service_client::TrackingServiceClient;
use tryon_proto::v1::{
    BodyState, CloseSessionRequest, FrameId, GarmentChoice, GarmentFit, GarmentFrame, Picture,
    PictureCodec, TrackingStatus, TryOnState, TryOnStatus, UndressRequest,
};

/// How often silence is looked for.
const TICK: Duration = Duration::from_millis(100);
/// A viewer hears something at least this often.
const HEARTBEAT: Duration = Duration::from_millis(450);
/// No word from tracking for this long, while it has a session, is a fault. It repeats itself twice a second.
const TRACKING_SILENCE: Duration = Duration::from_millis(800);
/// A picture older than this is no snapshot.
const SNAPSHOT_AGE: Duration = Duration::from_secs(1);
/// The end that was asked for.
const ASKED: &str = "asked to";

/// How others reach a try-on.
pub(crate) struct Handle {
    pub(crate) key: CameraKey,
    pub(crate) commands: mpsc::Sender<Command>,
    pub(crate) wanted: watch::Sender<Wanted>,
}

/// What a try-on can be told.
pub(crate) enum Command {
    View(Viewer),
    Snapshot(Encoding, oneshot::Sender<Result<Picture, Status>>),
    Touch,
    ShowFit(bool),
    Close,
}

/// What a try-on's task needs.
pub(crate) struct Setup {
    pub(crate) id: String,
    pub(crate) key: CameraKey,
    pub(crate) choices: Vec<GarmentChoice>,
    pub(crate) ctx: Context,
    pub(crate) config: CompositorConfig,
    pub(crate) card: Card,
    pub(crate) directory: Sessions<Handle>,
}

/// Starts the task of a try-on.
pub(crate) fn spawn(mut setup: Setup) -> Handle {
    let (commands, inbox) = mpsc::channel(8);
    let choices = std::mem::take(&mut setup.choices);
    let (wanted, outfit) = watch::channel(Wanted {
        revision: 1,
        choices,
    });
    let key = setup.key.clone();
    tokio::spawn(async move {
        let (id, directory) = (setup.id.clone(), setup.directory.clone());
        let why = open(setup, inbox, outfit).await;
        if why != ASKED {
            directory.remove(&id);
        }
        metrics::gauge!("tryon_try_ons").set(directory.len() as f64);
        tracing::info!(try_on = id, why, "closed");
    });
    Handle {
        key,
        commands,
        wanted,
    }
}

async fn open(
    setup: Setup,
    inbox: mpsc::Receiver<Command>,
    outfit: watch::Receiver<Wanted>,
) -> &'static str {
    let frames = match setup.ctx.bus.subscribe(&setup.key).await {
        Ok(f) => f,
        Err(e) => {
            tracing::error!(try_on = setup.id, error = %e, "cannot subscribe");
            return "the bus refused";
        }
    };
    // One connection for each stream; both URLs were checked at the start.
    let (Ok(tracking), Ok(cloth)) = (
        channel(&setup.config.tracking),
        channel(&setup.config.cloth),
    ) else {
        return "a URL is none";
    };
    let (tx, bodies) = latest::channel();
    let pool = setup.ctx.pool.clone();
    let a = tokio::spawn(bodies::follow(
        tracking.clone(),
        setup.id.clone(),
        Some(setup.key.clone()),
        pool,
        tx,
    ));
    let (tx, garments) = latest::channel();
    let b = tokio::spawn(upstream::follow(
        cloth.clone(),
        setup.id.clone(),
        outfit,
        tx,
    ));
    let (done, drawn) = mpsc::channel(1);
    let (id, now, card) = (setup.id.clone(), Instant::now(), setup.card.clone());
    let limits = Limits {
        camera_silence_ns: setup.config.camera_silence_ms * 1_000_000,
        tracking_silence_ns: TRACKING_SILENCE.as_nanos() as u64,
        garments_age_ns: setup.config.garments_late_ms * 1_000_000,
    };
    let task = Task {
        setup,
        limits,
        state: State::Opening,
        detail: String::new(),
        since: now,
        born: now,
        last_live: None,
        said: now,
        wanted: now,
        ages: Ages::default(),
        lost_at: None,
        shown: None,
        tracking_up: false,
        cloth_up: false,
        faults: Faults::default(),
        scene: Scene::default(),
        fit: (0, Vec::new()),
        tightness: Arc::new([]),
        show_fit: false,
        last: None,
        viewers: Vec::new(),
        engine: Some(Engine::new(card)),
        pending: None,
        done,
    };
    let why = task
        .run(Inputs {
            inbox,
            frames,
            bodies,
            garments,
            drawn,
        })
        .await;
    a.abort();
    b.abort();
    // The sessions behind it would end by themselves when idle; being polite must not hold anything up.
    let close = async {
        let session_id = id.clone();
        let _ = TrackingServiceClient::new(tracking)
            .close_session(request(CloseSessionRequest { session_id }))
            .await;
        let _ = upstream::client(cloth)
            .undress(request(UndressRequest { session_id: id }))
            .await;
    };
    let _ = tokio::time::timeout(CALL_DEADLINE, close).await;
    why
}

struct Inputs {
    inbox: mpsc::Receiver<Command>,
    frames: FrameSubscription,
    bodies: latest::Receiver<bodies::News>,
    garments: latest::Receiver<upstream::News>,
    drawn: mpsc::Receiver<Done>,
}

/// Faults are levels: repeated to the table as long as they last.
#[derive(Default)]
struct Faults {
    tracking: Option<(Reason, String)>,
    cloth: Option<(Reason, String)>,
}

/// A job that came back from the pool.
struct Done {
    engine: Option<Engine>,
    job: Job,
    outcome: Result<Drawn, String>,
    answer: Option<oneshot::Sender<Result<Picture, Status>>>,
}

struct Pending {
    job: Job,
    answer: Option<oneshot::Sender<Result<Picture, Status>>>,
}

struct Task {
    setup: Setup,
    limits: Limits,
    state: State,
    detail: String,
    /// In `state` since.
    since: Instant,
    born: Instant,
    last_live: Option<Instant>,
    /// Viewers last heard something.
    said: Instant,
    /// Somebody last wanted this try-on.
    wanted: Instant,
    ages: Ages,
    /// Newest exposure in which nobody was followed: garments up to it are nobody's.
    lost_at: Option<FrameId>,
    /// Newest exposure shown.
    shown: Option<FrameId>,
    tracking_up: bool,
    cloth_up: bool,
    faults: Faults,
    scene: Scene,
    /// Fit of the garments as last told, and the revision it belongs to.
    fit: (u64, Vec<GarmentFit>),
    /// How tight each vertex of each garment is, which pictures do not carry.
    tightness: Arc<[bytes::Bytes]>,
    /// Garments are drawn in the colours of their fit.
    show_fit: bool,
    /// What the last picture was made of, for snapshots.
    last: Option<(Instant, Job)>,
    viewers: Vec<Viewer>,
    /// Away while the pool draws.
    engine: Option<Engine>,
    /// The newest job waits here; older ones are replaced.
    pending: Option<Pending>,
    done: mpsc::Sender<Done>,
}

impl Task {
    async fn run(mut self, mut i: Inputs) -> &'static str {
        let shutdown = self.setup.ctx.shutdown.clone();
        let mut tick = tokio::time::interval(TICK);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let idle = Duration::from_secs(self.setup.config.idle_s);
        loop {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => {
                    self.happen(Event::Drain);
                    return "shutting down";
                }
                c = i.inbox.recv() => match c {
                    Some(Command::View(v)) => {
                        v.status(self.status());
                        self.viewers.push(v);
                    }
                    Some(Command::Snapshot(encoding, answer)) => self.snapshot(encoding, answer),
                    Some(Command::Touch) => self.wanted = Instant::now(),
                    Some(Command::ShowFit(show)) => self.show_fit = show,
                    Some(Command::Close) | None => {
                        self.happen(Event::Close);
                        return ASKED;
                    }
                },
                Some(d) = i.drawn.recv() => self.drawn(d),
                g = i.garments.recv() => match g {
                    Some(g) => self.garments(g),
                    None => return "cloth cannot be followed",
                },
                b = i.bodies.recv() => match b {
                    Some(b) => self.body(b),
                    None => return "tracking cannot be followed",
                },
                f = i.frames.next() => match f {
                    Some(f) => self.frame(f),
                    None => return "the bus is gone",
                },
                _ = tick.tick() => {
                    self.tick();
                    if self.wanted.elapsed() > idle {
                        self.happen(Event::Close);
                        return "nobody watches";
                    }
                }
            }
        }
    }

    fn now_ns(&self, at: Instant) -> u64 {
        u64::try_from(at.saturating_duration_since(self.born).as_nanos()).unwrap_or(u64::MAX)
    }

    /// One row of the table.
    fn happen(&mut self, event: Event) {
        let (next, effects) = transition(self.state, event);
        if next != self.state {
            tracing::info!(try_on = self.setup.id, from = ?self.state, to = ?next, detail = self.detail, "state");
            if self.state == State::Live {
                self.last_live = Some(Instant::now());
            }
            (self.state, self.since) = (next, Instant::now());
        }
        for effect in effects {
            match effect {
                Effect::Announce(_) => {
                    let status = self.status();
                    self.say(&status);
                }
                Effect::ForgetGarments => self.ages.garments_ns = None,
                // Followers reopen and dress by themselves; viewers' streams end with this task.
                Effect::Reopen(_) | Effect::Dress | Effect::CloseUpstream | Effect::EndStreams => {}
            }
        }
    }

    fn fail(&mut self, reason: Reason, detail: &str) {
        if self.detail != detail {
            self.detail = detail.into();
        }
        self.happen(Event::Failed(reason));
    }

    fn status(&self) -> TryOnStatus {
        let degraded = self.state.reason();
        TryOnStatus {
            state: life::state(self.state).into(),
            reason: life::reason(self.state).into(),
            age: self.since.elapsed().as_secs_f32(),
            service: life::service(self.state).into(),
            detail: match degraded {
                Some(r) if self.detail.is_empty() => r.words().into(),
                Some(_) => self.detail.clone(),
                None => String::new(),
            },
            retry_after: 0.0,
        }
    }

    fn say(&mut self, status: &TryOnStatus) {
        self.viewers.retain(|v| v.status(status.clone()));
        self.said = Instant::now();
    }

    fn tick(&mut self) {
        let now = Instant::now();
        if let Some((reason, why)) = self.faults.cloth.clone() {
            self.fail(reason, &why);
        }
        if let Some((reason, why)) = self.faults.tracking.clone() {
            self.fail(reason, &why);
        }
        if let Some(reason) = self.ages.overdue(self.now_ns(now), &self.limits) {
            self.fail(reason, "");
        } else if self.ages.frame_ns.is_none()
            && self.born.elapsed().as_nanos() > u128::from(self.limits.camera_silence_ns)
        {
            self.fail(Reason::CameraSilent, "no frame has come yet");
        }
        self.viewers.retain(|v| !v.is_gone());
        if !self.viewers.is_empty() {
            self.wanted = now;
        }
        if self.said.elapsed() >= HEARTBEAT {
            let status = self.status();
            self.say(&status);
        }
    }

    /// Both services behind it answer, for the first time or again.
    fn opened(&mut self) {
        let service = matches!(
            self.state,
            State::Opening
                | State::Degraded(Reason::TrackingUnavailable | Reason::ClothUnavailable)
        );
        if service && self.tracking_up && self.cloth_up {
            self.happen(Event::Opened);
        }
    }

    fn frame(&mut self, e: Arc<Exposure>) {
        self.ages.frame_ns = Some(self.now_ns(Instant::now()));
        if self.state == State::Degraded(Reason::CameraSilent) {
            self.happen(Event::CameraBack);
        }
        self.scene.frame(e.clone());
        // While live, pictures wait for their garments; otherwise the plain picture is the newest truth.
        if !self.state.shows_garments() {
            self.draw(Job {
                exposure: e,
                placed: None,
                body: None,
                formats: Vec::new(),
                fit: None,
            });
        }
    }

    fn body(&mut self, news: bodies::News) {
        let (state, shape, template) = match news {
            bodies::News::Gone(why) => {
                self.tracking_up = false;
                self.ages.body_ns = None;
                self.fail(Reason::TrackingUnavailable, &why);
                self.faults.tracking = Some((Reason::TrackingUnavailable, why));
                return;
            }
            bodies::News::Body {
                state,
                shape,
                template,
            } => (*state, shape, template),
        };
        self.tracking_up = true;
        self.ages.body_ns = Some(self.now_ns(Instant::now()));
        self.opened();
        self.faults.tracking = None;
        match state.status() {
            TrackingStatus::Calibrating | TrackingStatus::Tracking => {
                self.happen(Event::PersonFound);
                if let Some(shape) = shape {
                    self.scene.body(Body {
                        state: Arc::new(state),
                        shape,
                        template,
                    });
                }
            }
            _ => self.nobody(&state),
        }
    }

    fn nobody(&mut self, state: &BodyState) {
        let reason = life::from_wire(state.reason()).unwrap_or(Reason::TrackingLost);
        // That the camera is silent is for this service to see with its own eyes.
        if reason == Reason::CameraSilent {
            return;
        }
        self.lost_at = state.frame;
        self.fail(reason, &state.detail);
        self.faults.tracking = Some((reason, state.detail.clone()));
    }

    fn garments(&mut self, news: upstream::News) {
        match news {
            upstream::News::Gone(why) => {
                self.cloth_up = false;
                self.fail(Reason::ClothUnavailable, &why);
                self.faults.cloth = Some((Reason::ClothUnavailable, why));
            }
            upstream::News::Status(frame) => {
                self.cloth_up = true;
                self.opened();
                self.faults.cloth = None;
                self.ages.garments_ns = None;
                self.not_placed(&frame);
            }
            upstream::News::Placed(frame, placed) => {
                self.cloth_up = true;
                self.opened();
                self.faults.cloth = None;
                if !frame.fit.is_empty() || self.fit.0 != placed.revision {
                    let mut fit = frame.fit;
                    self.tightness = fit
                        .iter_mut()
                        .map(|f| std::mem::take(&mut f.tightness))
                        .collect();
                    self.fit = (placed.revision, fit);
                }
                if let Some(id) = frame.frame {
                    self.placed(&id, placed);
                }
            }
        }
    }

    /// Cloth says why there is nothing to show; tracking's own word comes from tracking.
    fn not_placed(&mut self, frame: &GarmentFrame) {
        if life::from_wire(frame.reason()) == Some(Reason::StepFailed) {
            self.fail(Reason::StepFailed, &frame.detail);
        }
    }

    fn placed(&mut self, id: &FrameId, placed: Arc<Placed>) {
        let Some((arrived, exposure)) = self.scene.find(id) else {
            metrics::counter!("tryon_compositor_unmatched").increment(1);
            return;
        };
        self.ages.garments_ns = Some(self.now_ns(arrived));
        let late = arrived.elapsed().as_nanos() > u128::from(self.limits.garments_age_ns);
        if late || self.lost_at.as_ref().is_some_and(|l| not_after(id, l)) || !self.tracking_up {
            return;
        }
        self.happen(Event::GarmentsOn);
        if self.state.shows_garments() {
            let body = self.scene.find_body(id);
            let fit = self.show_fit.then(|| self.tightness.clone());
            self.draw(Job {
                exposure,
                placed: Some(placed),
                body,
                formats: Vec::new(),
                fit,
            });
        }
    }

    /// Draws for whoever wants a picture now; the newest job wins.
    fn draw(&mut self, mut job: Job) {
        if self
            .shown
            .as_ref()
            .is_some_and(|s| not_after(&job.exposure.id, s))
        {
            return;
        }
        for v in self.viewers.iter().filter(|v| v.wants()) {
            let f = Job::wants(&v.format);
            if !job.formats.contains(&f) {
                job.formats.push(f);
            }
        }
        self.last = Some((Instant::now(), job.clone()));
        if job.formats.is_empty() {
            // Nobody looks, so nothing is drawn; what would have been is known to snapshots.
            metrics::counter!("tryon_compositor_skipped").increment(1);
            return;
        }
        if let Some(old) = self.pending.take()
            && old.answer.is_some()
        {
            // A snapshot goes first.
            self.pending = Some(old);
            return;
        }
        self.pending = Some(Pending { job, answer: None });
        self.start();
    }

    fn start(&mut self) {
        let Some(mut engine) = self.engine.take() else {
            return;
        };
        let Some(p) = self.pending.take() else {
            self.engine = Some(engine);
            return;
        };
        let (pool, done) = (self.setup.ctx.pool.clone(), self.done.clone());
        tokio::spawn(async move {
            let job = p.job.clone();
            let work = move || {
                let outcome = engine.draw(&job);
                (engine, outcome)
            };
            let (engine, outcome) = match pool.run(work).await {
                Ok((e, o)) => (Some(e), o),
                Err(why) => (None, Err(why.to_string())),
            };
            // The try-on may be gone by now.
            let _ = done
                .send(Done {
                    engine,
                    job: p.job,
                    outcome,
                    answer: p.answer,
                })
                .await;
        });
    }

    fn drawn(&mut self, d: Done) {
        // Not the default: a new engine letterboxes, as the contract says.
        self.engine = d
            .engine
            .or_else(|| Some(Engine::new(self.setup.card.clone())));
        match d.outcome {
            Ok(drawn) => {
                record_stages("compositor", &drawn.stages);
                if let Some(answer) = d.answer {
                    let picture = drawn
                        .pictures
                        .first()
                        .map(|p| self.picture(&d.job, &drawn, p));
                    let _ =
                        answer.send(picture.ok_or_else(|| unavailable("compositor", "no picture")));
                } else if d.job.placed.is_some() == self.state.shows_garments() {
                    self.deliver(&d.job, &drawn);
                }
            }
            Err(why) => {
                tracing::warn!(try_on = self.setup.id, %why, "a picture could not be drawn");
                if let Some(answer) = d.answer {
                    let _ = answer.send(Err(unavailable("compositor", &why)));
                }
                self.fail(Reason::StepFailed, &why);
            }
        }
        self.start();
    }

    fn deliver(&mut self, job: &Job, drawn: &Drawn) {
        let id = job.exposure.id;
        if self.shown.as_ref().is_some_and(|s| not_after(&id, s)) {
            return;
        }
        self.shown = Some(id);
        let mut viewers = std::mem::take(&mut self.viewers);
        for v in viewers.iter_mut().filter(|v| v.wants()) {
            let (size, encoding) = Job::wants(&v.format);
            if let Some(p) = drawn
                .pictures
                .iter()
                .find(|p| (p.size, p.encoding) == (size, encoding))
            {
                v.picture(self.picture(job, drawn, p));
            }
        }
        self.viewers = viewers;
        self.said = Instant::now();
        metrics::counter!("tryon_pictures", "state" => self.state_name()).increment(1);
        let latency = unix_ns().saturating_sub(id.received_unix_ns) as f64 * 1e-6;
        metrics::histogram!("tryon_stage_ms", "stage" => "latency").record(latency);
    }

    fn state_name(&self) -> &'static str {
        life::state(self.state).as_str_name()
    }

    fn picture(&self, job: &Job, drawn: &Drawn, p: &crate::engine::Encoded) -> Picture {
        let id = job.exposure.id;
        // A picture says what it shows, whatever has happened since.
        let state = if job.placed.is_some() {
            TryOnState::Live
        } else {
            life::state(self.state)
        };
        let degraded = state == TryOnState::Degraded;
        Picture {
            frame: Some(id),
            state: state.into(),
            reason: if degraded {
                life::reason(self.state).into()
            } else {
                0
            },
            degraded_age: if degraded {
                self.last_live.map_or(0.0, |t| t.elapsed().as_secs_f32())
            } else {
                0.0
            },
            codec: match p.encoding {
                Encoding::Jpeg(_) => PictureCodec::Jpeg.into(),
                Encoding::Png => PictureCodec::Png.into(),
            },
            width: p.width,
            height: p.height,
            image: p.bytes.clone(),
            outfit_revision: job.placed.as_ref().map_or(0, |p| p.revision),
            latency_ms: unix_ns().saturating_sub(id.received_unix_ns) as f32 * 1e-6,
            stages: drawn.stages.clone(),
            dropped: 0,
            fit: job
                .placed
                .as_ref()
                .filter(|p| p.revision == self.fit.0)
                .map_or(Vec::new(), |_| self.fit.1.clone()),
        }
    }

    fn snapshot(&mut self, encoding: Encoding, answer: oneshot::Sender<Result<Picture, Status>>) {
        let young = self
            .last
            .as_ref()
            .filter(|(at, _)| at.elapsed() < SNAPSHOT_AGE);
        let Some((_, job)) = young else {
            let _ = answer.send(Err(unavailable(
                "compositor",
                "there is no picture younger than a second",
            )));
            return;
        };
        let job = Job {
            formats: vec![(None, encoding)],
            ..job.clone()
        };
        self.pending = Some(Pending {
            job,
            answer: Some(answer),
        });
        self.start();
    }
}
