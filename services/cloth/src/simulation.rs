//! Simulations on request: their directory, their threads, and how long they are kept.
//!
//! Each runs on threads of its own, at low priority beside the compute pool of live sessions. Its finished frames stay in
//! memory for any number of readers, those of a session no longer than the session knows the body. A cancelled simulation
//! of a session can be continued as long.

use crate::fine_task::{FineTask, Snapshot};
use crate::progress::{self, Frames, Progress, Publisher, SharedProgress};
use crate::scene_task::SceneTask;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tonic::Status;
use tryon_kit::compute::run_in_background;
use tryon_kit::sessions::{brief, random_id};
use tryon_kit::status::{exhausted, not_found};
use tryon_proto::convert::WireError;
use tryon_proto::v1::{CancelSimulationResponse, SessionStart, StartSimulationResponse};

/// Time that frames are kept after the end; as the contract says.
const KEPT: Duration = Duration::from_secs(600);

/// A simulation as the rpcs reach it.
#[derive(Clone)]
struct Entry {
    /// Session that it belongs to; `None` for a scene.
    session: Option<String>,
    progress: SharedProgress,
    remainder: SharedRemainder,
}

/// Part of a session's simulation that a cancel left; empty once another simulation computes it. It holds the body, and
/// goes with its entry.
struct Remainder(Option<Box<FineTask>>);

/// Remainder as its thread and its directory share it; `None` before the end, and after an end by itself.
type SharedRemainder = Arc<Mutex<Option<Remainder>>>;

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Simulations by their ids, which are secrets like those of sessions.
#[derive(Clone, Default)]
struct Directory(Arc<Mutex<BTreeMap<String, Entry>>>);

impl Directory {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Entry>> {
        lock(&self.0)
    }

    fn entry(&self, id: &str) -> Result<Entry, Status> {
        let entry = self.lock().get(id).cloned();
        entry.ok_or_else(|| not_found("simulation", id))
    }
}

/// Right to be kept. Dropping it forgets the simulation.
struct Keep {
    directory: Directory,
    id: String,
}

impl Keep {
    /// Ends with `origin`, or some time after the end of the simulation.
    async fn run(self, mut origin: watch::Receiver<()>, mut progress: watch::Receiver<Progress>) {
        let over = async {
            // Its sender lives as long as the entry.
            let _ = progress.wait_for(Progress::has_ended).await;
            tokio::time::sleep(KEPT).await;
        };
        tokio::select! {
            _ = origin.changed() => {}
            () = over => {}
        }
    }
}

impl Drop for Keep {
    fn drop(&mut self) {
        let entry = self.directory.lock().remove(&self.id);
        if let Some(entry) = entry {
            entry.progress.send_modify(Progress::forget);
        }
    }
}

/// Place, owner and frames of a simulation that is about to run.
struct Plan {
    place: OwnedSemaphorePermit,
    /// First frame that is computed, and the one after the last or 0 while it isn't known.
    frames: [u32; 2],
    session: Option<String>,
    /// The simulation is forgotten once its sender is gone.
    origin: watch::Receiver<()>,
}

/// Simulations of the process.
pub(crate) struct Simulations {
    limit: usize,
    places: Arc<Semaphore>,
    directory: Directory,
    /// Origin of scenes: gone with the service.
    service: watch::Sender<()>,
}

impl Simulations {
    /// At most `limit` at a time, finished ones that are still kept not counted.
    pub(crate) fn new(limit: usize) -> Self {
        Self {
            limit,
            places: Arc::new(Semaphore::new(limit)),
            directory: Directory::default(),
            service: watch::Sender::new(()),
        }
    }

    /// Place for one more simulation.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED when as many run as may.
    pub(crate) fn place(&self) -> Result<OwnedSemaphorePermit, Status> {
        let place = Arc::clone(&self.places).try_acquire_owned();
        place.map_err(|_| exhausted("simulations", self.limit))
    }

    /// Starts the simulation of a scene.
    pub(crate) fn start_scene(&self, task: SceneTask) -> Result<StartSimulationResponse, Status> {
        let plan = Plan {
            place: self.place()?,
            frames: task.frames(),
            session: None,
            origin: self.service.subscribe(),
        };
        let ([first_frame, frame_count], vertex_count) = (plan.frames, task.vertices());
        let compute = move |publisher: &mut Publisher| task.compute(publisher).map(|()| None);
        let simulation_id = self.launch(plan, compute)?;
        Ok(StartSimulationResponse {
            simulation_id,
            frame_count,
            vertex_count,
            first_frame,
            ..Default::default()
        })
    }

    /// Starts the simulation of a session's garments, in a place taken before.
    pub(crate) async fn start_fine(
        &self,
        place: OwnedSemaphorePermit,
        start: &SessionStart,
        snapshot: Snapshot,
    ) -> Result<StartSimulationResponse, Status> {
        let wanted = start.clone();
        let task = tokio::task::spawn_blocking(move || FineTask::new(snapshot, &wanted)).await;
        let task = task.map_err(|e| Status::internal(e.to_string()))??;
        self.launch_fine(place, &start.session_id, task)
    }

    /// Starts a simulation of the frames that a cancelled one of a session left.
    ///
    /// # Errors
    /// FAILED_PRECONDITION for a simulation that left none; RESOURCE_EXHAUSTED when as many run as may.
    pub(crate) fn resume(&self, id: &str) -> Result<StartSimulationResponse, Status> {
        let entry = self.directory.entry(id)?;
        let refused = |why: &str| {
            let why = format!("simulation `{id}` cannot be continued: {why}");
            Err(Status::failed_precondition(why))
        };
        let Some(session) = entry.session else {
            return refused("that of a scene continues from its checkpoint");
        };
        let has_ended = entry.progress.borrow().has_ended();
        let mut remainder = lock(&entry.remainder);
        let Some(Remainder(left)) = &mut *remainder else {
            return refused(if has_ended {
                "it ended by itself"
            } else {
                "it has not ended"
            });
        };
        match (left.take(), self.place()) {
            (Some(task), Ok(place)) => self.launch_fine(place, &session, *task),
            (Some(task), Err(full)) => {
                *left = Some(task);
                Err(full)
            }
            (None, _) => refused("it was continued before"),
        }
    }

    fn launch_fine(
        &self,
        place: OwnedSemaphorePermit,
        session: &str,
        task: FineTask,
    ) -> Result<StartSimulationResponse, Status> {
        let plan = Plan {
            place,
            frames: task.frames(),
            session: Some(session.to_owned()),
            origin: task.body(),
        };
        let mut response = task.response(plan.frames);
        response.simulation_id = self.launch(plan, move |publisher| task.compute(publisher))?;
        Ok(response)
    }

    /// Runs `work`, which returns what it left, on threads of its own; the id of the simulation.
    fn launch(
        &self,
        plan: Plan,
        work: impl FnOnce(&mut Publisher) -> Result<Option<FineTask>, Status> + Send + 'static,
    ) -> Result<String, Status> {
        let Plan {
            place,
            frames,
            session,
            origin,
        } = plan;
        let id = random_id();
        let progress = Progress::of(frames);
        let mut publisher = Publisher::new(progress.clone());
        let remainder = SharedRemainder::default();
        let (shared, rest, shown) = (progress.clone(), remainder.clone(), brief(&id));
        let run = move || {
            let work = || run_in_background(|| work(&mut publisher));
            // A panic loses the state of this simulation only.
            let end = match catch_unwind(AssertUnwindSafe(work)) {
                Ok(Ok(end)) => end,
                Ok(Err(e)) => Err(Status::internal(e.to_string())),
                Err(_) => Err(Status::internal("the simulation panicked")),
            };
            // Moved: nothing of the body stays with this thread after the end.
            let end = end.map(move |left| {
                if let Some(task) = left {
                    *lock(&rest) = Some(Remainder(Some(Box::new(task))));
                }
            });
            if let Err(why) = &end {
                tracing::warn!(simulation = shown, why = why.message(), "simulation failed");
            }
            drop(place);
            shared.send_modify(|p| p.finish(end));
        };
        let thread = std::thread::Builder::new().name("simulation".into());
        thread
            .spawn(run)
            .map_err(|e| Status::internal(format!("no thread for a simulation: {e}")))?;
        tracing::info!(simulation = brief(&id), frame_count = frames[1], "started");
        let ended = progress.subscribe();
        let entry = Entry {
            session,
            progress,
            remainder,
        };
        self.directory.lock().insert(id.clone(), entry);
        let keep = Keep {
            directory: self.directory.clone(),
            id: id.clone(),
        };
        tokio::spawn(keep.run(origin, ended));
        Ok(id)
    }

    /// Session that a simulation belongs to; `None` for a scene.
    pub(crate) fn session(&self, id: &str) -> Result<Option<String>, Status> {
        Ok(self.directory.entry(id)?.session)
    }

    /// Ends a simulation after the frame in work.
    pub(crate) async fn cancel(&self, id: &str) -> Result<CancelSimulationResponse, Status> {
        let progress = self.directory.entry(id)?.progress;
        progress.send_modify(Progress::cancel);
        let mut progress = progress.subscribe();
        let ended = progress
            .wait_for(Progress::has_ended)
            .await
            .map_err(|_| Status::aborted("the simulation broke off"))?;
        let (next_frame, checkpoint) = ended.outcome();
        Ok(CancelSimulationResponse {
            next_frame,
            checkpoint,
        })
    }

    /// All frames from `first` on, then the end.
    pub(crate) fn follow(&self, id: &str, first: u32) -> Result<Frames, Status> {
        let progress = self.directory.entry(id)?.progress.subscribe();
        let count = progress.borrow().frame_count();
        if count > 0 && first >= count {
            let why = format!("{first}: there are {count} frames");
            return Err(WireError::new("follow_simulation_request.first_frame", why).into());
        }
        Ok(progress::follow(progress, first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fine_task::tests::snapshot;
    use crate::recording::{Recorder, Recording};
    use bytes::Bytes;
    use futures::StreamExt;
    use std::error::Error;
    use tonic::Code;
    use tryon::geometry::math::{P3, V3};
    use tryon::mirror::PutOn;
    use tryon_proto::v1::FrameId;

    /// Recorded bodies.
    const BODIES: u64 = 4;
    /// Time within which they are exposed (s).
    const SECONDS: f32 = 0.5;

    /// A coarse skirt and the body that wears it, which moves aside.
    struct Subject {
        worn: Snapshot,
        body: watch::Sender<()>,
    }

    impl Subject {
        fn new() -> Result<Self, Box<dyn Error>> {
            let how = PutOn {
                is_coarse: true,
                ..PutOn::default()
            };
            Ok(Self {
                worn: snapshot("skirt", how)?,
                body: watch::Sender::new(()),
            })
        }

        fn record(&self, recorder: &Recorder, number: u64) -> bool {
            let exposure = FrameId {
                // Uneven, as a camera's.
                capture_time_ns: number * (30 + number) * 1_000_000,
                ..FrameId::default()
            };
            let aside = V3::new(0.001 * number as f32, 0.0, 0.0);
            let body = self.worn.outfit.state.collision_body().vertices();
            let body: Vec<P3> = body.iter().map(|p| p + aside).collect();
            recorder.record(exposure, &body)
        }

        async fn start(
            &self,
            simulations: &Simulations,
            recording: Recording,
        ) -> Result<String, Status> {
            let snapshot = Snapshot {
                outfit: self.worn.outfit.clone(),
                template: self.worn.template.clone(),
                garments: self.worn.garments.clone(),
                recording: Some(recording),
                body: self.body.subscribe(),
                ..self.worn
            };
            let start = SessionStart {
                session_id: "mine".into(),
                vertices: 1,
                motion_seconds: SECONDS,
            };
            let place = simulations.place()?;
            let started = simulations.start_fine(place, &start, snapshot).await?;
            assert_eq!(started.first_frame, 0);
            Ok(started.simulation_id)
        }
    }

    /// The next `count` frames of a simulation from `first` on: number, exposure and positions.
    async fn frames(
        simulations: &Simulations,
        id: &str,
        [first, count]: [u32; 2],
    ) -> Result<Vec<(u32, Option<FrameId>, Bytes)>, Status> {
        let messages = simulations.follow(id, first)?;
        let frames = messages.filter_map(async |m| match m {
            Ok(m) if m.positions.is_empty() => None,
            Ok(m) => Some(Ok((m.frame, m.exposure, m.positions))),
            Err(why) => Some(Err(why)),
        });
        let frames: Vec<_> = Box::pin(frames.take(count as usize)).collect().await;
        frames.into_iter().collect()
    }

    fn refusal(simulations: &Simulations, id: &str) -> (Code, String) {
        let refused = simulations.resume(id).expect_err("refused");
        (refused.code(), refused.message().to_owned())
    }

    #[tokio::test]
    async fn a_cancelled_simulation_of_a_session_continues_once_to_the_same_bits()
    -> Result<(), Box<dyn Error>> {
        let (simulations, subject) = (Simulations::new(1), Subject::new()?);
        let (recorder, recording) = Recorder::new(FrameId::default(), SECONDS);
        assert!((1..=BODIES).all(|n| subject.record(&recorder, n)));
        drop(recorder);
        let id = subject.start(&simulations, recording).await?;
        let all = [0, 1 + BODIES as u32];
        let whole = frames(&simulations, &id, all).await?;
        assert_eq!(whole.len(), all[1] as usize);
        simulations.cancel(&id).await?;
        let (code, why) = refusal(&simulations, &id);
        assert!(code == Code::FailedPrecondition && why.contains("ended by itself"));

        let (recorder, recording) = Recorder::new(FrameId::default(), SECONDS);
        let draped = subject.start(&simulations, recording).await?;
        let (code, why) = refusal(&simulations, &draped);
        assert!(code == Code::FailedPrecondition && why.contains("has not ended"));
        let cancelled = simulations.cancel(&draped).await?;
        assert_eq!(cancelled, CancelSimulationResponse::default());

        // The drape anew, and the frames of bodies that were recorded in between.
        assert!((1..BODIES - 1).all(|n| subject.record(&recorder, n)));
        let moved = simulations.resume(&draped)?;
        assert_eq!((moved.first_frame, moved.frame_count), (0, 0));
        let (code, why) = refusal(&simulations, &draped);
        assert!(code == Code::FailedPrecondition && why.contains("continued before"));
        let moved = moved.simulation_id;
        frames(&simulations, &moved, [0, BODIES as u32 - 1]).await?;
        // It waits for a further body, or has not yet gone on from the last one.
        let further = async { assert!(subject.record(&recorder, BODIES - 1)) };
        let (cancelled, ()) = tokio::join!(simulations.cancel(&moved), further);
        let CancelSimulationResponse {
            next_frame,
            checkpoint,
        } = cancelled?;
        let possible = [BODIES as u32 - 1, BODIES as u32];
        assert!(possible.contains(&next_frame), "{next_frame}");
        assert!(checkpoint.is_empty(), "no recorded body leaves the service");

        assert!(subject.record(&recorder, BODIES));
        drop(recorder);
        let held = simulations.place()?;
        assert_eq!(refusal(&simulations, &moved).0, Code::ResourceExhausted);
        drop(held);
        let end = simulations.resume(&moved)?;
        assert_eq!([end.first_frame, end.frame_count], [next_frame, all[1]]);
        let mut parts = frames(&simulations, &moved, all).await?;
        assert_eq!(parts.len(), next_frame as usize);
        parts.extend(frames(&simulations, &end.simulation_id, all).await?);
        assert!(parts == whole, "other bits");
        Ok(())
    }

    #[tokio::test]
    async fn nothing_is_left_to_continue_once_the_body_is_forgotten() -> Result<(), Box<dyn Error>>
    {
        let (simulations, subject) = (Simulations::new(1), Subject::new()?);
        let (recorder, recording) = Recorder::new(FrameId::default(), SECONDS);
        let id = subject.start(&simulations, recording).await?;
        simulations.cancel(&id).await?;
        assert!(subject.record(&recorder, 1), "it can be continued");
        drop(subject.body);
        while simulations.session(&id).is_ok() {
            tokio::task::yield_now().await;
        }
        assert_eq!(refusal(&simulations, &id).0, Code::NotFound);
        let body = subject.worn.outfit.state.collision_body().vertices();
        let exposure = FrameId::default();
        assert!(
            !recorder.record(exposure, body),
            "nobody holds the recording"
        );
        Ok(())
    }
}
