//! Simulations on request: their directory, their threads, and how long they are kept.
//!
//! Each runs on threads of its own, at low priority beside the compute pool of live sessions. Its finished frames stay in
//! memory for any number of readers, those of a session no longer than the session knows the body.

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
}

/// Simulations by their ids, which are secrets like those of sessions.
#[derive(Clone, Default)]
struct Directory(Arc<Mutex<BTreeMap<String, Entry>>>);

impl Directory {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Entry>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
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
        let simulation_id = self.launch(plan, move |publisher| task.compute(publisher))?;
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
        let (exposure, world_from_camera) = (snapshot.exposure, snapshot.world_from_camera);
        let (origin, wanted) = (snapshot.body.clone(), start.clone());
        let task = tokio::task::spawn_blocking(move || FineTask::new(snapshot, &wanted)).await;
        let task = task.map_err(|e| Status::internal(e.to_string()))??;
        let frame_count = task.frame_count();
        let plan = Plan {
            place,
            frames: [0, frame_count],
            session: Some(start.session_id.clone()),
            origin,
        };
        let mut response = StartSimulationResponse {
            frame_count,
            vertex_count: task.vertices(),
            garments: task.topology(),
            exposure: Some(exposure),
            world_from_camera,
            ..Default::default()
        };
        response.simulation_id = self.launch(plan, move |publisher| task.compute(publisher))?;
        Ok(response)
    }

    /// Runs `work` on threads of its own; the id of the simulation.
    fn launch(
        &self,
        plan: Plan,
        work: impl FnOnce(&mut Publisher) -> Result<(), Status> + Send + 'static,
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
        let (shared, shown) = (progress.clone(), brief(&id));
        let run = move || {
            let work = || run_in_background(|| work(&mut publisher));
            // A panic loses the state of this simulation only.
            let end = match catch_unwind(AssertUnwindSafe(work)) {
                Ok(Ok(end)) => end,
                Ok(Err(e)) => Err(Status::internal(e.to_string())),
                Err(_) => Err(Status::internal("the simulation panicked")),
            };
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
        let entry = Entry { session, progress };
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
