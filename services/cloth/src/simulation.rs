//! Simulations of scenes without a camera.
//!
//! Each runs on a thread of its own, apart from the compute pool of live sessions. Its finished frames stay in memory
//! for any number of readers.

use bytes::Bytes;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;
use tonic::Status;
use tryon::cloth::scene::{self, RunConfig, Scene};
use tryon::math::P3;
use tryon::offline::{OfflineScene, OfflineSettings, checkpoint_frame};
use tryon::par::Par;
use tryon_kit::status::{exhausted, not_found};
use tryon_proto::convert::WireError;
use tryon_proto::v1::{
    CancelSimulationResponse, ClothSolver, FollowSimulationResponse, StartSimulationRequest,
    StartSimulationResponse,
};

/// Frame stream of one reader.
pub(crate) type Frames =
    Pin<Box<dyn futures::Stream<Item = Result<FollowSimulationResponse, Status>> + Send>>;

/// Largest scene text, bytes; as the contract says.
const MAX_SCENE_BYTES: usize = 1024 * 1024;
/// Most memory for the frames of one simulation, bytes: 10 s of 20,000 vertices at 60 frames/s take 144 MB.
const MAX_RESULT_BYTES: usize = 256 << 20;
/// Time that frames are kept after the end; as the contract says.
const KEPT: Duration = Duration::from_secs(600);

/// Largest checkpoint, bytes; as the contract says.
const MAX_CHECKPOINT_BYTES: usize = 4 << 20;

/// A finished frame.
#[derive(Clone)]
struct Finished {
    positions: Bytes,
    /// Computing time (ms).
    ms: f32,
    /// Estimated computing time of the frames after it (s).
    seconds_left: f32,
}

/// Progress of a simulation. `frames` only grows.
#[derive(Default)]
struct Progress {
    frames: Vec<Finished>,
    /// State after the last frame of a cancelled simulation.
    checkpoint: Bytes,
    end: Option<(Instant, Result<(), String>)>,
}

/// A simulation as readers reach it.
#[derive(Clone)]
struct Entry {
    /// First frame that it computes, and the frame after its last.
    frames: [u32; 2],
    progress: watch::Receiver<Progress>,
    is_cancelled: Arc<AtomicBool>,
}

/// Simulations of the process; one without an entry breaks off.
pub(crate) struct Simulations {
    limit: usize,
    started: AtomicU64,
    running: Mutex<Directory>,
}

/// Simulations by their ids.
type Directory = BTreeMap<String, Entry>;

/// Removes simulations that ended more than [`KEPT`] ago.
fn forget(all: &mut Directory) {
    all.retain(|_, entry| {
        let progress = entry.progress.borrow();
        progress
            .end
            .as_ref()
            .is_none_or(|(at, _)| at.elapsed() < KEPT)
    });
}

impl Simulations {
    /// At most `limit` at a time, finished ones that are still kept not counted.
    pub(crate) fn new(limit: usize) -> Self {
        Self {
            limit,
            started: AtomicU64::new(0),
            running: Mutex::new(BTreeMap::new()),
        }
    }

    /// Checks the scene and starts its simulation.
    pub(crate) async fn start(
        &self,
        r: &StartSimulationRequest,
    ) -> Result<StartSimulationResponse, Status> {
        let scene = check(r)?;
        let checkpoint = check_checkpoint(r)?;
        let solver = r.solver();
        let (tx, rx) = watch::channel(Progress::default());
        let frame_count = scene.frames() as u32;
        let first_frame = checkpoint.as_ref().map_or(0, |(frame, _)| frame + 1);
        let vertex_count = scene.start.len() as u32;
        let id = format!(
            "simulation-{}",
            self.started.fetch_add(1, Ordering::Relaxed)
        );
        let is_cancelled = Arc::new(AtomicBool::new(false));
        {
            let mut all = self.running.lock().unwrap_or_else(PoisonError::into_inner);
            forget(&mut all);
            if all
                .values()
                .filter(|e| e.progress.borrow().end.is_none())
                .count()
                >= self.limit
            {
                return Err(exhausted("simulations", self.limit));
            }
            let entry = Entry {
                frames: [first_frame, frame_count],
                progress: rx,
                is_cancelled: Arc::clone(&is_cancelled),
            };
            all.insert(id.clone(), entry);
        }
        let task = Task {
            scene,
            solver,
            checkpoint: checkpoint.map(|(_, bytes)| bytes),
            is_cancelled,
        };
        let spawned = std::thread::Builder::new()
            .name(id.clone())
            .spawn(move || task.compute(&tx));
        if let Err(e) = spawned {
            self.running
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .remove(&id);
            return Err(Status::internal(format!("no thread for a simulation: {e}")));
        }
        tracing::info!(simulation = id, frame_count, vertex_count, "started");
        Ok(StartSimulationResponse {
            simulation_id: id,
            frame_count,
            vertex_count,
            first_frame,
        })
    }

    /// Ends a simulation after the frame in work.
    pub(crate) async fn cancel(&self, id: &str) -> Result<CancelSimulationResponse, Status> {
        let Entry {
            frames: [first, _],
            mut progress,
            is_cancelled,
        } = self.entry(id)?;
        is_cancelled.store(true, Ordering::Relaxed);
        let ended = progress
            .wait_for(|p| p.end.is_some())
            .await
            .map_err(|_| Status::aborted("the simulation broke off"))?;
        Ok(CancelSimulationResponse {
            next_frame: first + ended.frames.len() as u32,
            checkpoint: ended.checkpoint.clone(),
        })
    }

    fn entry(&self, id: &str) -> Result<Entry, Status> {
        let mut all = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        forget(&mut all);
        let entry = all.get(id).cloned();
        entry.ok_or_else(|| not_found("simulation", id))
    }

    /// All frames from `first` on, then the end.
    pub(crate) fn follow(&self, id: &str, first: u32) -> Result<Frames, Status> {
        let entry = self.entry(id)?;
        let ([offset, frame_count], progress) = (entry.frames, entry.progress);
        if first >= frame_count {
            let why = format!("{first}: there are {frame_count} frames");
            return Err(WireError::new("follow_simulation_request.first_frame", why).into());
        }
        Ok(Box::pin(futures::stream::unfold(
            Some((first.max(offset), progress)),
            move |at| async move {
                let (next, mut progress) = at?;
                match wait(&mut progress, next - offset).await {
                    Ok(Some(done)) => {
                        let m = FollowSimulationResponse {
                            frame: next,
                            frame_count,
                            positions: done.positions,
                            ms: done.ms,
                            seconds_left: done.seconds_left,
                        };
                        Some((Ok(m), Some((next + 1, progress))))
                    }
                    Ok(None) => None,
                    Err(status) => Some((Err(status), None)),
                }
            },
        )))
    }
}

/// The frame `next` of those computed, or the end.
async fn wait(
    progress: &mut watch::Receiver<Progress>,
    next: u32,
) -> Result<Option<Finished>, Status> {
    let known = progress
        .wait_for(|p| p.frames.len() > next as usize || p.end.is_some())
        .await
        .map_err(|_| Status::aborted("the simulation broke off"))?;
    match (known.frames.get(next as usize), &known.end) {
        (Some(frame), _) => Ok(Some(frame.clone())),
        (None, Some((_, Err(why)))) => Err(Status::aborted(why.clone())),
        (None, _) => Ok(None),
    }
}

/// The checkpoint of a request and its frame, or the fault of the field.
fn check_checkpoint(r: &StartSimulationRequest) -> Result<Option<(u32, Bytes)>, Status> {
    if r.checkpoint.is_empty() {
        return Ok(None);
    }
    let fault = |why: String| WireError::new("start_simulation_request.checkpoint", why);
    if r.checkpoint.len() > MAX_CHECKPOINT_BYTES {
        return Err(fault("at most 4 MiB".into()).into());
    }
    if r.solver() != ClothSolver::Offline {
        return Err(fault("only the offline solver has checkpoints".into()).into());
    }
    let frame = checkpoint_frame(&r.checkpoint).map_err(|e| fault(e.to_string()))?;
    let frame = u32::try_from(frame).map_err(|e| fault(e.to_string()))?;
    Ok(Some((frame, r.checkpoint.clone())))
}

/// The scene of a request, or the field at fault.
fn check(r: &StartSimulationRequest) -> Result<Scene, Status> {
    let fault = |field: &str, why: &str| {
        Status::from(WireError::new(
            format!("start_simulation_request.{field}"),
            why,
        ))
    };
    if r.scene_json.len() > MAX_SCENE_BYTES {
        return Err(fault("scene_json", "at most 1 MiB"));
    }
    let scene = scene::parse(&r.scene_json, Path::new("scene_json"), None)
        .map_err(|e| fault("scene_json", &e.to_string()))?;
    let bytes = scene.frames() * scene.start.len() * size_of::<[f32; 3]>();
    if bytes > MAX_RESULT_BYTES {
        return Err(fault(
            "scene_json",
            &format!("duration_s: the frames take {bytes} bytes, at most {MAX_RESULT_BYTES}"),
        ));
    }
    Ok(scene)
}

/// Work of one simulation.
struct Task {
    scene: Scene,
    solver: ClothSolver,
    checkpoint: Option<Bytes>,
    is_cancelled: Arc<AtomicBool>,
}

/// Frames on their way to the readers.
struct Publisher<'a> {
    progress: &'a watch::Sender<Progress>,
    is_cancelled: &'a AtomicBool,
    started: Instant,
    last: Instant,
    /// Frames still to compute.
    left: usize,
    published: u32,
}

impl Publisher<'_> {
    /// Adds a frame; breaks off when cancelled, or when no reader can follow any more.
    fn publish(&mut self, positions: &[P3]) -> ControlFlow<()> {
        let positions: Vec<u8> = positions
            .iter()
            .flat_map(|p| [p.x, p.y, p.z])
            .flat_map(f32::to_le_bytes)
            .collect();
        self.published += 1;
        self.left = self.left.saturating_sub(1);
        let mean = self.started.elapsed().as_secs_f32() / self.published as f32;
        let frame = Finished {
            positions: positions.into(),
            ms: self.last.elapsed().as_secs_f32() * 1e3,
            seconds_left: mean * self.left as f32,
        };
        self.last = Instant::now();
        self.progress.send_modify(|p| p.frames.push(frame));
        if self.is_cancelled.load(Ordering::Relaxed) || self.progress.receiver_count() == 0 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

impl Task {
    /// Runs the scene to its end, until it is cancelled, or until no reader can follow it.
    fn compute(&self, progress: &watch::Sender<Progress>) {
        let now = Instant::now();
        let mut publisher = Publisher {
            progress,
            is_cancelled: &self.is_cancelled,
            started: now,
            last: now,
            left: self.scene.frames(),
            published: 0,
        };
        let end = match self.solver {
            ClothSolver::Offline => self.offline(&mut publisher),
            ClothSolver::Unspecified | ClothSolver::Realtime => {
                scene::run(&self.scene, &RunConfig::default(), |_, x| {
                    publisher.publish(x)
                })
                .map(drop)
                .map_err(|e| e.to_string())
            }
        };
        if let Err(why) = &end {
            tracing::warn!(why, "simulation failed");
        }
        progress.send_modify(|p| p.end = Some((Instant::now(), end)));
    }

    /// All frames by the offline solver, the start first, or those after the checkpoint.
    fn offline(&self, publisher: &mut Publisher<'_>) -> Result<(), String> {
        let offline = OfflineScene::new(&self.scene).map_err(|e| e.to_string())?;
        let from = self.checkpoint.as_deref();
        match from.map(checkpoint_frame) {
            Some(frame) => {
                let done = frame.map_err(|e| e.to_string())? as usize + 1;
                publisher.left = publisher.left.saturating_sub(done);
            }
            None => {
                // Cancelled or not: without a frame there is no state to continue from.
                let _: ControlFlow<()> = publisher.publish(&self.scene.start);
            }
        }
        let settings = OfflineSettings::default();
        offline
            .run(&settings, Par::Rayon, from, |done, solver| {
                let flow = publisher.publish(&solver.state().positions());
                if flow.is_break() {
                    let state = solver.checkpoint(done.frame as u64);
                    let progress = publisher.progress;
                    progress.send_modify(|p| p.checkpoint = state.into());
                }
                flow
            })
            .map(drop)
            .map_err(|e| e.to_string())
    }
}
