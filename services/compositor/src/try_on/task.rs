//! Task of one try-on: joins frames, bodies and garments, and hands pictures to viewers.

use super::drawing::{Done, Drawing, End};
use super::handle::{Answer, Command, Setup};
use super::lifecycle::Lifecycle;
use crate::empty_scene::EmptyScene;
use crate::encoding::Encoding;
use crate::engine::{Encoded, Job, Placed};
use crate::formats::{self, Format, Formats};
use crate::join_buffer::{JoinBuffer, ReportedBody, not_after};
use crate::life;
use crate::off_person;
use crate::upstream::{self, Wanted};
use crate::viewer::Viewer;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio::time::Instant;
use tonic::Status;
use tryon::session::{Event, Fault};
use tryon_kit::bodies;
use tryon_kit::consent::FORGET_AFTER;
use tryon_kit::flow::Flow;
use tryon_kit::frames::{Exposure, FrameSubscription};
use tryon_kit::queue::latest;
use tryon_kit::remembered_body::RememberedBody;
use tryon_kit::sessions::{brief, unix_ns};
use tryon_kit::status::{exhausted, unavailable};
use tryon_kit::telemetry::record_stages;
use tryon_proto::v1::{
    BodyState, ClothStatus, FrameId, GarmentFit, GarmentFrame, Picture, PictureCodec,
    TrackingStatus, TryOnEnd, TryOnState, TryOnStatus,
};

/// Interval of the checks for silence.
const TICK: Duration = Duration::from_millis(100);
/// Longest interval between messages to a viewer.
const HEARTBEAT: Duration = Duration::from_millis(450);
/// Time that the consent is held on for who has just opened the try-on, or lost its stream and streams again.
const LINGER: Duration = Duration::from_millis(500);
/// Age above which a picture is no snapshot.
const SNAPSHOT_AGE: Duration = Duration::from_secs(1);
/// Streams into a try-on.
pub(super) struct Inputs {
    pub(super) inbox: mpsc::Receiver<Command>,
    pub(super) frames: FrameSubscription,
    pub(super) bodies: latest::Receiver<bodies::News>,
    pub(super) garments: latest::Receiver<upstream::News>,
    pub(super) drawn: mpsc::Receiver<Done>,
}

/// Ends of a task's channels that others read.
pub(super) struct Outputs {
    /// Finished jobs.
    pub(super) done: mpsc::Sender<Done>,
    /// Somebody watches: the consent is renewed while this is true.
    pub(super) is_watched: watch::Sender<bool>,
    /// Body that tracking is given when it has lost it.
    pub(super) known: RememberedBody,
    /// Wanted outfit, with the sizes that cloth is given when it has lost them.
    pub(super) outfit: watch::Sender<Wanted>,
}

/// Fit of the worn outfit as cloth last reported it.
#[derive(Default)]
struct OutfitFit {
    /// Revision of the outfit.
    revision: u64,
    /// Fit of each garment, without the bulk.
    garments: Vec<GarmentFit>,
    /// Tightness of each vertex of each garment, which pictures do not carry.
    tightness: Arc<[bytes::Bytes]>,
    /// Garments are drawn in the colours of their fit.
    is_shown: bool,
}

/// State of one try-on.
pub(super) struct Task {
    setup: Setup,
    life: Lifecycle,
    drawing: Drawing,
    join: JoinBuffer,
    fit: OutfitFit,
    viewers: Vec<Viewer>,
    is_watched: watch::Sender<bool>,
    /// Settled body of the person, for as long as somebody watches.
    known: RememberedBody,
    outfit: watch::Sender<Wanted>,
    /// Last time that somebody watched, or was about to.
    watched: Instant,
    formats: Formats,
    /// Last sign of interest in this try-on.
    wanted: Instant,
    /// Newest exposure in which nobody was followed; garments up to it are not shown.
    lost_at: Option<FrameId>,
    /// Newest exposure shown, and the job that shows it.
    shown: Option<FrameId>,
    showing: Option<Arc<Job>>,
    /// The picture while nobody is in view.
    scene: EmptyScene,
    /// Time from which exposures are taken.
    due: Instant,
    /// Last job, for snapshots.
    last: Option<(Instant, Job)>,
    /// Pictures to those who watch.
    flow: Flow,
}

impl Task {
    /// A try-on without viewers.
    pub(super) fn new(setup: Setup, life: Lifecycle, outputs: Outputs) -> Self {
        let now = Instant::now();
        let flow = format!("pictures of try-on {}", brief(&setup.id));
        Self {
            flow: setup.ctx.stalls.flow("compositor", flow),
            drawing: Drawing::new(setup.card.clone(), setup.ctx.pool.clone(), outputs.done),
            setup,
            life,
            join: JoinBuffer::default(),
            fit: OutfitFit::default(),
            viewers: Vec::new(),
            is_watched: outputs.is_watched,
            known: outputs.known,
            outfit: outputs.outfit,
            watched: now,
            formats: Formats::default(),
            wanted: now,
            lost_at: None,
            shown: None,
            showing: None,
            scene: EmptyScene::default(),
            due: now,
            last: None,
        }
    }

    /// Runs to the end of the try-on; the reason of the end.
    pub(super) async fn run(mut self, mut inputs: Inputs) -> &'static str {
        let mut tick = tokio::time::interval(TICK);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            let end = self.next(&mut inputs, &mut tick).await;
            for status in self.life.take_announced() {
                self.say(&status);
            }
            if let Some(why) = end {
                return why;
            }
        }
    }

    /// Handles one event; the reason if it ends the try-on.
    async fn next(
        &mut self,
        i: &mut Inputs,
        tick: &mut tokio::time::Interval,
    ) -> Option<&'static str> {
        tokio::select! {
            biased;
            () = self.setup.ctx.shutdown.cancelled() => {
                self.life.apply(Event::Drain);
                return Some("shutting down");
            }
            c = i.inbox.recv() => return self.on_command(c),
            Some(d) = i.drawn.recv() => self.on_done(d),
            g = i.garments.recv() => match g {
                Some(g) => self.on_garments(g),
                None => return Some("cloth cannot be followed"),
            },
            b = i.bodies.recv() => match b {
                Some(b) => self.on_body(b),
                None => return Some("tracking cannot be followed"),
            },
            f = i.frames.next_from(self.due) => match f {
                Some(f) => self.on_frame(f),
                None => return Some("the bus is gone"),
            },
            _ = tick.tick() => {
                self.on_tick();
                if self.wanted.elapsed() > Duration::from_secs(self.setup.config.idle_s) {
                    self.life.close(TryOnEnd::Idle);
                    return Some("nobody watches");
                }
            }
        }
        None
    }

    fn on_command(&mut self, command: Option<Command>) -> Option<&'static str> {
        match command {
            Some(Command::View(v, answer)) => {
                // The receiver may be gone, and then its viewer leaves with the next tick.
                let _ = answer.send(self.admit(v));
            }
            Some(Command::Acknowledge(stream, number)) => {
                (self.viewers.iter_mut()).for_each(|v| v.acknowledge(stream, number));
            }
            Some(Command::Snapshot(encoding, answer)) => self.snapshot(encoding, answer),
            Some(Command::Recent(answer)) => {
                // The receiver may be gone.
                let _ = answer.send(self.join.clone());
            }
            Some(Command::Touch) => (self.wanted, self.watched) = (Instant::now(), Instant::now()),
            Some(Command::ShowFit(show)) => self.fit.is_shown = show,
            Some(Command::Close(end)) => {
                self.life.close(end);
                return Some(match end {
                    TryOnEnd::Withdrawn => "consent was withdrawn",
                    _ => "asked to",
                });
            }
            None => return Some("nobody can reach it"),
        }
        None
    }

    /// Adds a viewer; RESOURCE_EXHAUSTED when it is one too many, or its format is.
    fn admit(&mut self, mut v: Viewer) -> Result<(), Status> {
        let (max_viewers, max_formats) =
            (self.setup.config.max_viewers, self.setup.config.max_formats);
        if self.viewers.len() >= max_viewers {
            return Err(exhausted("viewers of a try-on", max_viewers));
        }
        let formats: BTreeSet<_> = (self.viewers.iter().chain([&v]))
            .map(|v| Job::wants(&v.format))
            .collect();
        if formats.len() > max_formats {
            let what = "sizes and qualities of a try-on's pictures";
            return Err(exhausted(what, max_formats));
        }
        v.status(self.life.status());
        self.viewers.push(v);
        self.watched = Instant::now();
        self.is_watched.send_replace(true);
        // Its first picture does not wait for a change of the scene.
        (self.scene, self.due) = (EmptyScene::default(), Instant::now());
        Ok(())
    }

    fn say(&mut self, status: &TryOnStatus) {
        self.viewers.retain_mut(|v| v.status(status.clone()));
    }

    fn on_tick(&mut self) {
        self.life.check();
        self.viewers.retain(|v| !v.is_over());
        if !self.viewers.is_empty() {
            self.wanted = Instant::now();
        }
        if self.viewers.iter().any(Viewer::is_watching) {
            self.watched = Instant::now();
        }
        let is_watched = self.watched.elapsed() < LINGER;
        self.is_watched
            .send_if_modified(|w| std::mem::replace(w, is_watched) != is_watched);
        if self.life.silence().is_some_and(|s| s >= FORGET_AFTER) {
            self.forget();
        }
        if is_watched {
            self.known.check();
            self.flow.waits(|| self.life.stall());
        } else {
            // No lease of consent is renewed.
            self.known.forget();
            self.outfit.send_if_modified(|w| w.forget());
            self.flow.moves();
        }
        let status = self.life.status();
        (self.viewers).retain_mut(|v| v.repeat(&status, HEARTBEAT));
    }

    /// Drops all pictures and poses: nobody knows who stands before the camera now. Size and shape are handed to tracking,
    /// which compares them with whom it finds.
    fn forget(&mut self) {
        self.join = JoinBuffer::default();
        (self.last, self.showing) = (None, None);
        self.scene = EmptyScene::default();
        self.fit.garments.clear();
        self.fit.tightness = Arc::default();
        self.drawing.forget();
    }

    fn on_frame(&mut self, e: Arc<Exposure>) {
        self.life.on_frame();
        self.join.push_frame(e.clone());
        // While live, pictures wait for their garments; otherwise the plain picture is shown at once.
        if !self.life.state().shows_garments() && self.is_worth_a_picture(&e) {
            self.draw(Job {
                exposure: e,
                placed: None,
                body: None,
                formats: Vec::new(),
                fit: None,
            });
        }
    }

    /// False for an empty scene that stands still: its exposures are taken and drawn now and then.
    fn is_worth_a_picture(&mut self, e: &Exposure) -> bool {
        let now = Instant::now();
        self.due = now;
        if !self.life.is_nobody_in_view() {
            return true;
        }
        let look = self.scene.look(e.rgbd.color.as_ref(), now);
        self.due = look.next;
        if !look.is_due {
            self.flow.moves();
            metrics::counter!("tryon_compositor_still").increment(1);
        }
        look.is_due
    }

    fn on_body(&mut self, news: bodies::News) {
        let (state, shape, template) = match news {
            bodies::News::Gone(why) => return self.life.on_tracking_gone(why),
            bodies::News::Body {
                state,
                shape,
                template,
            } => (*state, shape, template),
        };
        self.life.on_tracking();
        self.known.see(&state, shape.as_ref(), &template);
        match state.status() {
            TrackingStatus::Calibrating | TrackingStatus::Tracking => {
                self.life.apply(Event::PersonFound);
                if let Some(shape) = shape {
                    self.join.push_body(ReportedBody {
                        state: Arc::new(state),
                        shape,
                        template,
                    });
                }
            }
            _ => self.on_nobody(&state),
        }
    }

    fn on_nobody(&mut self, state: &BodyState) {
        let reason = life::from_wire(state.reason()).unwrap_or(Fault::TrackingLost);
        // The silence of the camera is detected here, from the frames themselves.
        if reason != Fault::CameraSilent {
            self.lost_at = state.frame;
            self.life.on_nobody(reason, &state.detail);
        }
    }

    fn on_garments(&mut self, news: upstream::News) {
        match news {
            upstream::News::Gone(why) => self.life.on_cloth_gone(why),
            upstream::News::Status(frame) => {
                self.life.on_cloth(false);
                if frame.status() == ClothStatus::Dressing {
                    self.life.apply(Event::OutfitOff);
                }
                // Reasons other than its own step reach this service from tracking.
                if life::from_wire(frame.reason()) == Some(Fault::StepFailed) {
                    self.life.fail(Fault::StepFailed, &frame.detail);
                }
            }
            upstream::News::Placed(frame, placed) => {
                self.life.on_cloth(true);
                let id = frame.frame;
                self.remember_sizes(&frame, placed.revision);
                self.fit.update(*frame, placed.revision);
                if let Some(id) = id {
                    self.on_placed(&id, placed);
                }
            }
        }
    }

    /// Remembers the sizes of a message with fits, for the person of its exposure.
    fn remember_sizes(&self, frame: &GarmentFrame, revision: u64) {
        let body = frame.frame.and_then(|id| self.join.find_body(&id));
        let Some(body) = body.filter(|_| !frame.fit.is_empty()) else {
            return;
        };
        self.outfit.send_if_modified(|w| {
            if w.revision == revision {
                w.remember(body.state.subject, &frame.fit);
            }
            // Nothing new is wanted.
            false
        });
    }

    fn on_placed(&mut self, id: &FrameId, placed: Arc<Placed>) {
        let Some((arrived, exposure)) = self.join.find(id) else {
            metrics::counter!("tryon_compositor_unmatched").increment(1);
            return;
        };
        self.life.on_garments(arrived);
        let is_lost = self.lost_at.as_ref().is_some_and(|l| not_after(id, l));
        if self.life.is_late(arrived) || is_lost || !self.life.is_tracking_up() {
            return;
        }
        self.life.apply(Event::GarmentsOn);
        if self.life.state().shows_garments() {
            let fit = self.fit.is_shown.then(|| self.fit.tightness.clone());
            self.draw(Job {
                exposure,
                placed: Some(placed),
                body: self.join.find_body(id),
                formats: Vec::new(),
                fit,
            });
        }
    }

    /// Draws for the viewers whose rate allows a picture now, in the formats that fit; the newest job wins.
    fn draw(&mut self, mut job: Job) {
        if self.is_shown(&job.exposure.id) {
            return;
        }
        let wanted = self.wanted_formats();
        let depth = &job.exposure.rgbd.depth;
        let pixels = f64::from(depth.width()) * f64::from(depth.height());
        job.formats = self.formats.choose(&wanted, pixels, Instant::now());
        let skipped = wanted.len() - job.formats.len();
        metrics::counter!("tryon_compositor_formats_skipped").increment(skipped as u64);
        self.last = Some((Instant::now(), job.clone()));
        if job.formats.is_empty() {
            // Without a viewer nothing is drawn; a snapshot can still be drawn from `last`.
            self.flow.moves();
            metrics::counter!("tryon_compositor_skipped").increment(1);
            return;
        }
        self.drawing.queue(job);
    }

    /// Formats that viewers want now. A connection has one voice, however many streams it opens.
    fn wanted_formats(&mut self) -> BTreeMap<Format, formats::Wanted> {
        let mut streams = BTreeMap::<_, usize>::new();
        for v in &self.viewers {
            *streams.entry(v.connection).or_default() += 1;
        }
        let mut wanted = BTreeMap::<_, formats::Wanted>::new();
        for (rank, v) in self
            .viewers
            .iter_mut()
            .enumerate()
            .filter(|(_, v)| v.wants())
        {
            if v.is_behind() {
                v.skip();
                continue;
            }
            let fresh = formats::Wanted { voices: 0.0, rank };
            let w = wanted.entry(Job::wants(&v.format)).or_insert(fresh);
            w.voices += 1.0 / streams[&v.connection] as f64;
        }
        wanted
    }

    fn is_shown(&self, id: &FrameId) -> bool {
        self.shown.as_ref().is_some_and(|s| not_after(id, s))
    }

    fn on_done(&mut self, d: Done) {
        match d {
            Done::Picture(job, picture) => {
                self.formats.record(picture.format, picture.cost);
                if job.placed.is_some() == self.life.state().shows_garments() {
                    self.deliver(&job, &picture);
                }
            }
            Done::End(end) => self.on_end(*end),
        }
    }

    fn on_end(&mut self, end: End) {
        let answer = match &end.outcome {
            Ok(drawn) => {
                let picture = drawn.as_ref().map(|p| self.picture(&end.job, p));
                picture.ok_or_else(|| unavailable("compositor", "no picture"))
            }
            Err(why) => {
                tracing::warn!(try_on = brief(&self.setup.id), %why, "a picture could not be drawn");
                self.life.fail(Fault::StepFailed, why);
                Err(unavailable("compositor", why))
            }
        };
        if let Some(caller) = end.answer {
            // The caller may be gone.
            let _ = caller.send(answer);
        }
        self.drawing.resume(end.engine);
    }

    /// Hands a picture to the viewers that want its format. One exposure is shown by one job only.
    fn deliver(&mut self, job: &Arc<Job>, drawn: &Encoded) {
        let is_next = self.showing.as_ref().is_some_and(|s| Arc::ptr_eq(s, job));
        if !is_next && self.is_shown(&job.exposure.id) {
            return;
        }
        let mut viewers = std::mem::take(&mut self.viewers);
        for v in viewers.iter_mut().filter(|v| v.wants() && !v.is_behind()) {
            if Job::wants(&v.format) == drawn.format {
                v.picture(self.picture(job, drawn));
            }
        }
        self.viewers = viewers;
        if !is_next {
            self.on_shown(job, drawn);
        }
    }

    /// Counts a new exposure on show.
    fn on_shown(&mut self, job: &Arc<Job>, drawn: &Encoded) {
        self.flow.moves();
        let id = job.exposure.id;
        (self.shown, self.showing) = (Some(id), Some(job.clone()));
        record_stages("compositor", Some(&id), &drawn.stages);
        let state = life::state(self.life.state()).as_str_name();
        metrics::counter!("tryon_pictures", "state" => state).increment(1);
        let latency = unix_ns().saturating_sub(id.received_unix_ns) as f64 * 1e-6;
        metrics::histogram!("tryon_stage_ms", "stage" => "latency").record(latency);
    }

    fn picture(&self, job: &Job, p: &Encoded) -> Picture {
        let id = job.exposure.id;
        // The state of the picture's content, which may differ from the state by now.
        let state = if job.placed.is_some() {
            TryOnState::Live
        } else {
            life::state(self.life.state())
        };
        let is_degraded = state == TryOnState::Degraded;
        let mut picture = Picture {
            frame: Some(id),
            state: state.into(),
            codec: PictureCodec::from(p.format.encoding).into(),
            width: p.width,
            height: p.height,
            image: p.bytes.clone(),
            latency_ms: unix_ns().saturating_sub(id.received_unix_ns) as f32 * 1e-6,
            stages: p.stages.clone(),
            ..Picture::default()
        };
        if is_degraded {
            picture.reason = life::reason(self.life.state()).into();
            picture.degraded_age = self.life.degraded_age();
        }
        if let Some(placed) = &job.placed {
            picture.outfit_revision = placed.revision;
            picture.set_cloth_detail(placed.detail);
            off_person::describe(&mut picture, p.off_person.as_ref());
            if placed.revision == self.fit.revision {
                picture.fit.clone_from(&self.fit.garments);
            }
        }
        picture
    }

    fn snapshot(&mut self, encoding: Encoding, answer: Answer) {
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
            formats: vec![Format {
                shape: None,
                encoding,
            }],
            ..job.clone()
        };
        self.drawing.queue_snapshot(job, answer);
    }
}

impl OutfitFit {
    /// Takes the fit of a message; most messages have none, and then it is kept for the same outfit.
    fn update(&mut self, frame: GarmentFrame, revision: u64) {
        if frame.fit.is_empty() && self.revision == revision {
            return;
        }
        let mut garments = frame.fit;
        self.tightness = garments
            .iter_mut()
            .map(|f| std::mem::take(&mut f.tightness))
            .collect();
        (self.revision, self.garments) = (revision, garments);
    }
}
