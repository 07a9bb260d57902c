//! One session: its task, its outfit, its readers.

use crate::chosen_sizes::ChosenSizes;
use crate::detail_ladder::DetailLadder;
use crate::engine::{Body, Update, Worn, dress, frame_of};
use crate::fine_task::Snapshot;
use crate::library::Library;
use crate::recording::Recorder;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::Instant;
use tonic::Status;
use tryon_kit::auth::Connection;
use tryon_kit::bodies::{News, follow};
use tryon_kit::consent::{FORGET_AFTER, REMEMBER_FOR};
use tryon_kit::queue::{latest, ordered};
use tryon_kit::server::Context;
use tryon_kit::session_task::{self, Place};
use tryon_kit::sessions::{Sessions, brief};
use tryon_kit::telemetry::record_stages;
use tryon_proto::convert::garment::{Positions, WornGarment};
use tryon_proto::v1::{
    self, ClothDetail, ClothStatus, DegradedReason, FrameId, GarmentChoice, GarmentFrame,
    TrackingStatus,
};

/// Longest interval between messages to a reader; a silent stream repeats its last status.
const HEARTBEAT: Duration = Duration::from_millis(450);
/// Position updates that wait for a slow reader; a further one replaces the oldest.
const WAITING: usize = 2;
/// Outfit that the client asked for; the revision grows with each change.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct WantedOutfit {
    pub(crate) revision: u64,
    pub(crate) choices: Vec<GarmentChoice>,
}

/// Access to a session from the rpcs.
pub(crate) struct Handle {
    pub(crate) outfit: watch::Sender<WantedOutfit>,
    pub(crate) commands: mpsc::Sender<Command>,
}

/// Command to a session.
pub(crate) enum Command {
    /// Adds a reader.
    Read(ordered::Sender<Message>),
    /// Answers with the outfit as it is worn now, and records the body from now on.
    Snapshot {
        /// Length of the recording (s); 0 for none.
        motion_seconds: f32,
        answer: oneshot::Sender<Result<Snapshot, Status>>,
    },
    /// Ends the session.
    Close,
}

/// Dependencies of a session's task.
pub(crate) struct Setup {
    pub(crate) id: String,
    pub(crate) ctx: Context,
    pub(crate) tracking: Connection,
    pub(crate) idle: Duration,
    pub(crate) adapts_detail: bool,
    /// Sizes that the caller remembers of the first outfit.
    pub(crate) sizes: Option<ChosenSizes>,
    pub(crate) library: Arc<Library>,
    pub(crate) directory: Sessions<Handle>,
}

/// Queue for one reader.
pub(crate) fn reader() -> (ordered::Sender<Message>, ordered::Receiver<Message>) {
    ordered::channel(WAITING)
}

/// Starts the task of a session that wears nothing yet.
pub(crate) fn spawn(setup: Setup) -> Handle {
    let (outfit, wanted) = watch::channel(WantedOutfit::default());
    let (commands, inbox) = mpsc::channel(8);
    tokio::spawn(async move {
        let id = setup.id.clone();
        let is_over = |h: &Handle| h.commands.is_closed();
        let _place = Place::new(
            setup.directory.clone(),
            &id,
            "tryon_cloth_sessions",
            is_over,
        );
        let (tx, news) = latest::channel();
        let following = follow(
            setup.tracking.clone(),
            id.clone(),
            None,
            setup.ctx.pool.clone(),
            tx,
        );
        let following = tokio::spawn(following);
        let (dressed, ready) = mpsc::channel(1);
        let task = Task {
            sizes: setup.sizes.clone(),
            setup,
            wanted,
            worn: None,
            subject: 0,
            body: watch::Sender::new(()),
            recorders: Vec::new(),
            on: 0,
            failed: 0,
            dressing: None,
            dressed,
            readers: Vec::new(),
            skipped: 0,
            ladder: DetailLadder::new(std::time::Instant::now()),
            missed: 0,
            refused: None,
        };
        let why = session_task::run("cloth", &id, task.run(inbox, news, ready)).await;
        following.abort();
        tracing::info!(session = brief(&id), why, "closed");
    });
    Handle { outfit, commands }
}

/// Result of dressing one revision.
struct Dressed {
    revision: u64,
    is_coarse: bool,
    outcome: Result<Worn, String>,
}

/// Message to one reader.
#[derive(Clone)]
pub(crate) struct Message {
    pub(crate) update: Update,
    /// Outfit, for a reader that does not have it yet.
    pub(crate) keyframe: Option<Garments>,
}

/// Immutable part of a worn outfit.
type Garments = Arc<[Arc<WornGarment>]>;

struct Reader {
    queue: ordered::Sender<Message>,
    /// Outfit of its last keyframe.
    has: Option<Garments>,
}

struct Task {
    setup: Setup,
    wanted: watch::Receiver<WantedOutfit>,
    /// Worn outfit; `None` while the pool steps it.
    worn: Option<Worn>,
    /// Tracking's number of the person who is followed.
    subject: u64,
    /// Sizes that the last outfit had on its person.
    sizes: Option<ChosenSizes>,
    /// Replaced when the body is forgotten: what is kept of it elsewhere goes then.
    body: watch::Sender<()>,
    /// Recordings of the body that go on.
    recorders: Vec<Recorder>,
    /// Revision of the worn outfit; 0 for nothing.
    on: u64,
    /// Revision that failed to be put on.
    failed: u64,
    /// Revision that is being put on while the old one stays on; `None` once the body it is for is gone.
    dressing: Option<u64>,
    dressed: mpsc::Sender<Dressed>,
    readers: Vec<Reader>,
    /// Body states that were replaced by newer ones.
    skipped: u64,
    ladder: DetailLadder,
    /// Exposures without garments so far, on their way from the camera to here.
    missed: u64,
    /// Revision that could not be put on from such cloth, coarse or not: it is worn as it is.
    refused: Option<(u64, bool)>,
}

impl Task {
    async fn run(
        mut self,
        mut inbox: mpsc::Receiver<Command>,
        mut news: latest::Receiver<News>,
        mut ready: mpsc::Receiver<Dressed>,
    ) -> &'static str {
        let shutdown = self.setup.ctx.shutdown.clone();
        let mut tick = tokio::time::interval(HEARTBEAT / 3);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let now = Instant::now();
        let (mut published, mut read, mut followed) = (now, now, now);
        let mut status = Update::from(waiting(DegradedReason::NoPerson, String::new()));
        loop {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => return "shutting down",
                c = inbox.recv() => match c {
                    Some(Command::Read(queue)) => {
                        self.readers.push(Reader { queue, has: None });
                        self.publish(status.clone());
                    }
                    Some(Command::Snapshot { motion_seconds, answer }) => {
                        // Its caller may have gone.
                        let _ = answer.send(self.snapshot(&status.frame, motion_seconds));
                    }
                    Some(Command::Close) | None => return "asked to",
                },
                Some(d) = ready.recv() => self.on_dressed(d),
                n = news.recv() => {
                    self.skipped = news.dropped();
                    if matches!(&n, Some(News::Body { state, .. }) if state.pose.is_some()) {
                        followed = Instant::now();
                    }
                    status = match n {
                        Some(n) => self.on_tracking(n).await,
                        None => return "tracking cannot be followed",
                    };
                    self.record(&status.frame);
                    self.publish(status.clone());
                    published = Instant::now();
                    // A repetition of the status must not present old positions as new.
                    status.positions = Positions::default();
                    self.measure_fit().await;
                }
                _ = tick.tick() => {
                    if followed.elapsed() >= FORGET_AFTER {
                        // Nobody knows whom the worn outfit fits.
                        self.forget_body();
                    }
                    if followed.elapsed() >= REMEMBER_FOR {
                        self.sizes = None;
                    }
                    if published.elapsed() >= HEARTBEAT {
                        if status.frame.status() == ClothStatus::Live {
                            status = waiting(DegradedReason::CameraSilent, "no body state".into()).into();
                        }
                        self.publish(status.clone());
                        published = Instant::now();
                    }
                    self.readers.retain(|r| !r.queue.is_closed());
                    if !self.readers.is_empty() {
                        read = Instant::now();
                    } else if read.elapsed() > self.setup.idle {
                        return "nobody reads it";
                    }
                }
            }
        }
    }

    /// Queues a message for every reader, as a keyframe for those that lack the outfit.
    fn publish(&mut self, mut update: Update) {
        let frame = &mut update.frame;
        frame.session_id = self.setup.id.clone();
        frame.steps_skipped = self.skipped;
        if frame.outfit_revision == 0 {
            frame.outfit_revision = self.on;
        }
        let garments = self.worn.as_ref().map(Worn::garments);
        let live = frame.status() == ClothStatus::Live;
        if live && update.positions.len() != garments.map_or(0, |g| g.len()) {
            // A repeated status has no positions, and without them a reader cannot use it.
            return;
        }
        let shown = garments.filter(|_| live && frame.frame.is_some());
        for r in &mut self.readers {
            let known = |g: &&Garments| r.has.as_ref().is_some_and(|has| Arc::ptr_eq(has, g));
            match shown.filter(|g| !known(g)) {
                Some(g) => {
                    r.has = Some(g.clone());
                    r.queue.keyframe(Message {
                        update: update.clone(),
                        keyframe: Some(g.clone()),
                    });
                }
                None => {
                    r.queue.update(Message {
                        update: update.clone(),
                        keyframe: None,
                    });
                }
            }
        }
    }

    async fn on_tracking(&mut self, news: News) -> Update {
        let (state, shape, template) = match news {
            News::Gone(why) => return waiting(DegradedReason::TrackingUnavailable, why).into(),
            News::Body {
                state,
                shape,
                template,
            } => (*state, shape, template),
        };
        let frame = state.frame;
        let for_frame = |mut f: GarmentFrame| {
            (f.frame, f.world_from_camera) = (frame, state.world_from_camera);
            Update::from(f)
        };
        if std::mem::replace(&mut self.subject, state.subject) != state.subject {
            // Measured from nothing, perhaps another person: the worn outfit is for the old one.
            self.forget_body();
        }
        match (state.status(), shape) {
            (TrackingStatus::Calibrating | TrackingStatus::Tracking, Some(shape)) => {
                let body = match Body::new(state.clone(), shape, template) {
                    Ok(b) => b,
                    Err(why) => return waiting(DegradedReason::StepFailed, why).into(),
                };
                self.follow_body(body).await
            }
            (TrackingStatus::Lost | TrackingStatus::Sitting, _) => {
                let mut f = waiting(state.reason(), state.detail.clone());
                f.set_status(ClothStatus::Holding);
                for_frame(f)
            }
            _ => {
                self.forget_body();
                for_frame(waiting(state.reason(), state.detail.clone()))
            }
        }
    }

    /// Outfit and exposure of the message that is `shown`, if its garments are simulated.
    fn simulated(&self, shown: &GarmentFrame) -> Option<(&Worn, FrameId)> {
        let is_simulated = shown.status() == ClothStatus::Live
            && shown.outfit_revision == self.on
            && matches!(
                shown.cloth_detail(),
                ClothDetail::Full | ClothDetail::Coarse
            );
        let worn = self.worn.as_ref().filter(|_| is_simulated)?;
        Some((worn, shown.frame?))
    }

    fn snapshot(&mut self, shown: &GarmentFrame, motion_seconds: f32) -> Result<Snapshot, Status> {
        let (worn, exposure) = self.simulated(shown).ok_or_else(|| {
            Status::failed_precondition("the session has no garments that are simulated now")
        })?;
        let (outfit, template) = worn.outfit();
        let mut snapshot = Snapshot {
            outfit: outfit.clone(),
            template: template.clone(),
            garments: worn.garments().clone(),
            exposure,
            world_from_camera: shown.world_from_camera,
            recording: None,
            body: self.body.subscribe(),
        };
        if motion_seconds > 0.0 {
            let (recorder, recording) = Recorder::new(exposure, motion_seconds);
            self.recorders.push(recorder);
            snapshot.recording = Some(recording);
        }
        Ok(snapshot)
    }

    /// Adds the body of the message that is `shown` to the recordings. They end when garments are no longer live; cloth that
    /// follows skin leaves a gap.
    fn record(&mut self, shown: &GarmentFrame) {
        let mut recorders = std::mem::take(&mut self.recorders);
        if let Some((worn, exposure)) = self.simulated(shown) {
            let body = worn.outfit().0.state.collision_body().vertices();
            recorders.retain(|r| r.record(exposure, body));
        } else if shown.status() != ClothStatus::Live {
            recorders.clear();
        }
        self.recorders = recorders;
    }

    /// Forgets the body and everything that is kept of it.
    fn forget_body(&mut self) {
        self.undress();
        self.recorders.clear();
        self.body = watch::Sender::new(());
    }

    fn undress(&mut self) {
        (self.worn, self.on) = (None, 0);
        // The outfit in preparation is for a body that is gone.
        self.dressing = None;
    }

    fn on_dressed(&mut self, d: Dressed) {
        if self.dressing != Some(d.revision) {
            return;
        }
        self.dressing = None;
        match d.outcome {
            Ok(worn) => (self.worn, self.on) = (Some(worn), d.revision),
            Err(why) if self.on == d.revision => {
                tracing::info!(session = brief(&self.setup.id), %why, "keeps its cloth");
                self.refused = Some((d.revision, d.is_coarse));
            }
            Err(why) => {
                tracing::warn!(session = brief(&self.setup.id), %why, "cannot be dressed");
                self.failed = d.revision;
                self.publish(failed(d.revision, why).into());
            }
        }
    }

    async fn follow_body(&mut self, body: Body) -> Update {
        let wanted = self.wanted.borrow_and_update().clone();
        if wanted.choices.is_empty() {
            self.undress();
            self.on = wanted.revision;
            return live(frame_of(&body).into(), wanted.revision);
        }
        let missed = self.skipped + body.state.frames_dropped;
        let newly_missed = missed.saturating_sub(std::mem::replace(&mut self.missed, missed));
        let (begun, detail) = (std::time::Instant::now(), self.ladder.detail());
        if self.dressing.is_some() {
            self.ladder.restart(begun);
        }
        if detail == ClothDetail::None {
            self.ladder.count(begun, newly_missed, Duration::ZERO);
            self.report_detail(detail);
            return plain_mirror(&body).into();
        }
        let body = Arc::new(body);
        if self.needs_dressing(wanted.revision, detail) {
            self.start_dressing(body.clone(), wanted.clone(), detail != ClothDetail::Full);
        }
        let Some(mut worn) = self.worn.take() else {
            return match self.dressing {
                Some(_) => dressing(&body, "garments are being put on").into(),
                None => failed(wanted.revision, "the outfit could not be put on".into()).into(),
            };
        };
        let stepped = body.clone();
        let follow = move || {
            let placed = worn.follow(&stepped, detail != ClothDetail::Skinned);
            (worn, placed)
        };
        let followed = self.setup.ctx.pool.run(follow).await;
        if self.setup.adapts_detail {
            self.ladder
                .count(std::time::Instant::now(), newly_missed, begun.elapsed());
            self.report_detail(detail);
        }
        match followed {
            Ok((worn, placed)) => {
                self.remember_sizes(&worn);
                let update = match placed {
                    Ok(p) => {
                        record_stages("cloth", p.frame.frame.as_ref(), &p.frame.stages);
                        metrics::counter!("tryon_cloth_steps").increment(1);
                        live(p, self.on)
                    }
                    Err(why) => waiting(DegradedReason::StepFailed, why).into(),
                };
                if worn.is_past_mending() {
                    self.undress();
                } else {
                    self.worn = Some(worn);
                }
                update
            }
            Err(why) => {
                tracing::error!(session = brief(&self.setup.id), %why, "a step was lost");
                self.undress();
                waiting(DegradedReason::StepFailed, why.to_string()).into()
            }
        }
    }

    /// Remembers the sizes of the worn outfit once they have settled.
    fn remember_sizes(&mut self, worn: &Worn) {
        let (on, subject) = (self.on, self.subject);
        let is_known = (self.sizes.as_ref()).is_some_and(|s| s.is_of(on, subject));
        if subject != 0
            && !is_known
            && let Some(sizes) = worn.settled_sizes()
        {
            self.sizes = Some(ChosenSizes::new(on, subject, sizes));
        }
    }

    /// Measures the fit when that is due, after the garments are on their way.
    async fn measure_fit(&mut self) {
        let Some(mut worn) = self.worn.take_if(|w| w.is_fit_due()) else {
            return;
        };
        let work = move || {
            let measured = worn.measure_fit();
            (worn, measured)
        };
        match self.setup.ctx.pool.run(work).await {
            Ok((worn, measured)) => {
                self.worn = Some(worn);
                if let Err(why) = measured {
                    tracing::warn!(session = brief(&self.setup.id), %why, "the fit is not known");
                }
            }
            Err(why) => {
                tracing::error!(session = brief(&self.setup.id), %why, "an outfit was lost");
                self.undress();
            }
        }
    }

    /// The wanted outfit is not on and not on its way, or is of other cloth than the detail asks for, or in other sizes than
    /// the body.
    fn needs_dressing(&self, revision: u64, detail: ClothDetail) -> bool {
        if self.on != revision {
            return self.failed != revision && self.dressing != Some(revision);
        }
        let is_coarse = detail != ClothDetail::Full;
        let is_other = |w: &Worn| w.is_coarse() != is_coarse || w.is_misfit();
        self.dressing.is_none()
            && detail != ClothDetail::Skinned
            && self.refused != Some((revision, is_coarse))
            && self.worn.as_ref().is_some_and(is_other)
    }

    /// Logs and counts a change of the detail from `before`.
    fn report_detail(&self, before: ClothDetail) {
        let now = self.ladder.detail();
        if now != before {
            let (from, to) = (before.as_str_name(), now.as_str_name());
            tracing::info!(session = brief(&self.setup.id), from, to, "detail of cloth");
            metrics::counter!("tryon_cloth_detail_changes", "to" => to).increment(1);
        }
    }

    /// Dresses on the pool; the worn outfit is stepped meanwhile.
    fn start_dressing(&mut self, body: Arc<Body>, mut wanted: WantedOutfit, is_coarse: bool) {
        self.dressing = Some(wanted.revision);
        let is_same = |s: &&ChosenSizes| s.is_of(wanted.revision, body.state.subject);
        if let Some(sizes) = self.sizes.as_ref().filter(is_same) {
            wanted.choices = sizes.fill(&wanted.choices);
        }
        let (pool, done) = (self.setup.ctx.pool.clone(), self.dressed.clone());
        let library = self.setup.library.clone();
        tokio::spawn(async move {
            let work = move || dress(&body, &wanted.choices, &library, is_coarse);
            let outcome = tokio::select! {
                outcome = pool.run(work) => outcome,
                // The session is gone: nobody waits for it.
                () = done.closed() => return,
            };
            let outcome = outcome.map_err(|e| e.to_string()).and_then(|r| r);
            // The session may be gone by now.
            let _ = done
                .send(Dressed {
                    revision: wanted.revision,
                    is_coarse,
                    outcome,
                })
                .await;
        });
    }
}

fn dressing(body: &Body, detail: &str) -> GarmentFrame {
    let mut f = waiting(DegradedReason::Unspecified, detail.into());
    f.set_status(ClothStatus::Dressing);
    (f.frame, f.world_from_camera) = (body.state.frame, body.state.world_from_camera);
    f
}

/// Message of a machine that has no time for garments.
fn plain_mirror(body: &Body) -> GarmentFrame {
    let mut f = waiting(
        DegradedReason::GarmentsLate,
        "this machine has no time for garments now".into(),
    );
    (f.frame, f.world_from_camera) = (body.state.frame, body.state.world_from_camera);
    f.set_cloth_detail(ClothDetail::None);
    f
}

fn live(mut update: Update, revision: u64) -> Update {
    update.frame.set_status(ClothStatus::Live);
    update.frame.outfit_revision = revision;
    update
}

fn waiting(reason: DegradedReason, detail: String) -> GarmentFrame {
    let mut f = v1::GarmentFrame {
        detail,
        ..Default::default()
    };
    f.set_status(ClothStatus::Waiting);
    f.set_reason(reason);
    f
}

fn failed(revision: u64, detail: String) -> GarmentFrame {
    let mut f = v1::GarmentFrame {
        detail,
        outfit_revision: revision,
        ..Default::default()
    };
    f.set_status(ClothStatus::Failed);
    f
}
