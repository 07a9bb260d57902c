//! One session: its task, its outfit, its readers.

use crate::engine::{Body, Said, Worn, dress};
use crate::library::Library;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio::time::Instant;
use tonic::transport::Channel;
use tryon_kit::bodies::{News, follow};
use tryon_kit::queue::{latest, ordered};
use tryon_kit::server::Context;
use tryon_kit::sessions::Sessions;
use tryon_kit::telemetry::record_stages;
use tryon_proto::convert::garment::{Positions, WornGarment};
use tryon_proto::v1::{
    self, ClothStatus, DegradedReason, GarmentChoice, GarmentFrame, TrackingStatus,
};

/// A reader hears something at least this often.
const HEARTBEAT: Duration = Duration::from_millis(450);
/// Position updates that may wait for a slow reader.
const WAITING: usize = 2;
/// The end that was asked for.
const ASKED: &str = "asked to";

/// What is wanted: grows with each change.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Outfit {
    pub(crate) revision: u64,
    pub(crate) choices: Vec<GarmentChoice>,
}

/// How others reach a session.
pub(crate) struct Handle {
    pub(crate) outfit: watch::Sender<Outfit>,
    pub(crate) commands: mpsc::Sender<Command>,
}

/// What a session can be told.
pub(crate) enum Command {
    /// Somebody wants to read.
    Read(ordered::Sender<Told>),
    Close,
}

/// What a session's task needs.
pub(crate) struct Setup {
    pub(crate) id: String,
    pub(crate) ctx: Context,
    pub(crate) tracking: Channel,
    pub(crate) idle: Duration,
    pub(crate) library: Arc<Library>,
    pub(crate) directory: Sessions<Handle>,
}

/// A queue for one reader.
pub(crate) fn reader() -> (ordered::Sender<Told>, ordered::Receiver<Told>) {
    ordered::channel(WAITING)
}

/// Starts the task of a session that wears nothing yet.
pub(crate) fn spawn(setup: Setup) -> Handle {
    let (outfit, wanted) = watch::channel(Outfit::default());
    let (commands, inbox) = mpsc::channel(8);
    tokio::spawn(async move {
        let (id, directory) = (setup.id.clone(), setup.directory.clone());
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
            setup,
            wanted,
            worn: None,
            on: 0,
            failed: 0,
            dressing: None,
            dressed,
            readers: Vec::new(),
            skipped: 0,
        };
        let why = task.run(inbox, news, ready).await;
        following.abort();
        if why != ASKED {
            directory.remove(&id);
        }
        metrics::gauge!("tryon_cloth_sessions").set(directory.len() as f64);
        tracing::info!(session = id, why, "closed");
    });
    Handle { outfit, commands }
}

/// An outfit that is ready, or why not.
struct Dressed {
    revision: u64,
    outcome: Result<Worn, String>,
}

/// A message to one reader.
#[derive(Clone)]
pub(crate) struct Told {
    pub(crate) said: Said,
    /// The outfit, when this reader does not know it yet.
    pub(crate) keyframe: Option<Garments>,
}

/// An outfit as it was put on once.
type Garments = Arc<[Arc<WornGarment>]>;

struct Reader {
    queue: ordered::Sender<Told>,
    /// The outfit that it knows.
    has: Option<Garments>,
}

struct Task {
    setup: Setup,
    wanted: watch::Receiver<Outfit>,
    /// What is on, away while the pool steps it.
    worn: Option<Worn>,
    /// Revision of what is on; 0 for nothing.
    on: u64,
    /// Revision that could not be put on.
    failed: u64,
    /// Revision that is being put on beside the old one, and for which round of measuring.
    dressing: Option<u64>,
    dressed: mpsc::Sender<Dressed>,
    readers: Vec<Reader>,
    skipped: u64,
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
        let (mut said, mut read) = (Instant::now(), Instant::now());
        let mut status = Said::from(waiting(DegradedReason::NoPerson, String::new()));
        loop {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => return "shutting down",
                c = inbox.recv() => match c {
                    Some(Command::Read(queue)) => {
                        self.readers.push(Reader { queue, has: None });
                        self.tell(status.clone());
                    }
                    Some(Command::Close) | None => return ASKED,
                },
                Some(d) = ready.recv() => self.take_on(d),
                n = news.recv() => {
                    status = match n {
                        Some(n) => self.hear(n).await,
                        None => return "tracking cannot be followed",
                    };
                    self.skipped = news.dropped();
                    self.tell(status.clone());
                    said = Instant::now();
                    // What is repeated later must not pass old positions off as new ones.
                    status.positions = Positions::default();
                }
                _ = tick.tick() => {
                    if said.elapsed() >= HEARTBEAT {
                        if status.frame.status() == ClothStatus::Live {
                            status = waiting(DegradedReason::CameraSilent, "no body state".into()).into();
                        }
                        self.tell(status.clone());
                        said = Instant::now();
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

    /// Hands a message to every reader, each with the outfit that it does not know yet.
    fn tell(&mut self, mut said: Said) {
        let frame = &mut said.frame;
        frame.session_id = self.setup.id.clone();
        frame.steps_skipped = self.skipped;
        if frame.outfit_revision == 0 {
            frame.outfit_revision = self.on;
        }
        let garments = self.worn.as_ref().map(Worn::garments);
        let live = frame.status() == ClothStatus::Live;
        if live && said.positions.len() != garments.map_or(0, |g| g.len()) {
            // A repeated message without its positions: nothing that a reader could use.
            return;
        }
        let shown = garments.filter(|_| live && frame.frame.is_some());
        for r in &mut self.readers {
            let known = |g: &&Garments| r.has.as_ref().is_some_and(|has| Arc::ptr_eq(has, g));
            match shown.filter(|g| !known(g)) {
                Some(g) => {
                    r.has = Some(g.clone());
                    r.queue.keyframe(Told {
                        said: said.clone(),
                        keyframe: Some(g.clone()),
                    });
                }
                None => {
                    r.queue.update(Told {
                        said: said.clone(),
                        keyframe: None,
                    });
                }
            }
        }
    }

    async fn hear(&mut self, news: News) -> Said {
        let (state, shape, template) = match news {
            News::Gone(why) => return waiting(DegradedReason::TrackingUnavailable, why).into(),
            News::Body {
                state,
                shape,
                template,
            } => (*state, shape, template),
        };
        let frame = state.frame;
        let said = |mut f: GarmentFrame| {
            (f.frame, f.world_from_camera) = (frame, state.world_from_camera);
            Said::from(f)
        };
        match (state.status(), shape) {
            (TrackingStatus::Tracking, Some(shape)) => {
                let body = match Body::new(state.clone(), shape, template) {
                    Ok(b) => b,
                    Err(why) => return waiting(DegradedReason::StepFailed, why).into(),
                };
                self.follow_body(body).await
            }
            (TrackingStatus::Calibrating, _) => {
                // Another size, perhaps another person: what is on belongs to who was there before.
                self.undress();
                said(waiting(
                    DegradedReason::Unspecified,
                    "the body is being measured".into(),
                ))
            }
            (TrackingStatus::Lost, _) => {
                let mut f = waiting(state.reason(), state.detail.clone());
                f.set_status(ClothStatus::Holding);
                said(f)
            }
            _ => {
                self.undress();
                said(waiting(state.reason(), state.detail.clone()))
            }
        }
    }

    fn undress(&mut self) {
        (self.worn, self.on) = (None, 0);
        // What is being put on now is for a body that is gone.
        self.dressing = None;
    }

    fn take_on(&mut self, d: Dressed) {
        if self.dressing != Some(d.revision) {
            return;
        }
        self.dressing = None;
        match d.outcome {
            Ok(worn) => (self.worn, self.on) = (Some(worn), d.revision),
            Err(why) => {
                tracing::warn!(session = self.setup.id, %why, "cannot be dressed");
                self.failed = d.revision;
                self.tell(failed(d.revision, why).into());
            }
        }
    }

    async fn follow_body(&mut self, body: Body) -> Said {
        let wanted = self.wanted.borrow_and_update().clone();
        if wanted.choices.is_empty() {
            self.undress();
            self.on = wanted.revision;
            let s = &body.state;
            let bare = GarmentFrame {
                frame: s.frame,
                world_from_camera: s.world_from_camera,
                stages: s.stages.clone(),
                ..Default::default()
            };
            return live(bare.into(), wanted.revision);
        }
        let body = Arc::new(body);
        if self.on != wanted.revision
            && self.failed != wanted.revision
            && self.dressing != Some(wanted.revision)
        {
            self.put_on(body.clone(), wanted.clone());
        }
        let Some(mut worn) = self.worn.take() else {
            return match self.dressing {
                Some(_) => dressing(&body).into(),
                None => failed(wanted.revision, "the outfit could not be put on".into()).into(),
            };
        };
        let step = move || {
            let placed = worn.step(&body);
            (worn, placed)
        };
        match self.setup.ctx.pool.run(step).await {
            Ok((worn, placed)) => {
                self.worn = Some(worn);
                match placed {
                    Ok(p) => {
                        record_stages("cloth", &p.frame.stages);
                        metrics::counter!("tryon_cloth_steps").increment(1);
                        live(p, self.on)
                    }
                    Err(why) => waiting(DegradedReason::StepFailed, why).into(),
                }
            }
            Err(why) => {
                tracing::error!(session = self.setup.id, %why, "a step was lost");
                self.undress();
                waiting(DegradedReason::StepFailed, why.to_string()).into()
            }
        }
    }

    /// Dresses beside the stream: what is on stays on and moves meanwhile.
    fn put_on(&mut self, body: Arc<Body>, wanted: Outfit) {
        self.dressing = Some(wanted.revision);
        let (pool, done) = (self.setup.ctx.pool.clone(), self.dressed.clone());
        let library = self.setup.library.clone();
        tokio::spawn(async move {
            let outcome = pool
                .run(move || dress(&body, &wanted.choices, &library))
                .await;
            let outcome = outcome.map_err(|e| e.to_string()).and_then(|r| r);
            // The session may be gone by now.
            let _ = done
                .send(Dressed {
                    revision: wanted.revision,
                    outcome,
                })
                .await;
        });
    }
}

fn dressing(body: &Body) -> GarmentFrame {
    let mut f = waiting(
        DegradedReason::Unspecified,
        "garments are being put on".into(),
    );
    f.set_status(ClothStatus::Dressing);
    (f.frame, f.world_from_camera) = (body.state.frame, body.state.world_from_camera);
    f
}

fn live(mut said: Said, revision: u64) -> Said {
    said.frame.set_status(ClothStatus::Live);
    said.frame.outfit_revision = revision;
    said
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
