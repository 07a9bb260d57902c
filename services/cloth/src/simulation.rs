//! Simulations of scenes without a camera.
//!
//! Each runs on a thread of its own, apart from the compute pool of live sessions. Its finished frames stay in memory
//! for any number of readers.

use bytes::Bytes;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;
use tonic::Status;
use tryon::cloth::scene::{self, RunConfig, Scene};
use tryon::math::P3;
use tryon::offline::{OfflineScene, OfflineSettings};
use tryon::par::Par;
use tryon_kit::status::{exhausted, not_found};
use tryon_proto::convert::WireError;
use tryon_proto::v1::{
    ClothSolver, FollowSimulationResponse, StartSimulationRequest, StartSimulationResponse,
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

/// Progress of a simulation. `frames` only grows.
#[derive(Default)]
struct Progress {
    frames: Vec<(Bytes, f32)>,
    end: Option<(Instant, Result<(), String>)>,
}

/// Simulations of the process; one without an entry breaks off.
pub(crate) struct Simulations {
    limit: usize,
    started: AtomicU64,
    running: Mutex<Directory>,
}

/// Number of frames and progress of each simulation by its id.
type Directory = BTreeMap<String, (u32, watch::Receiver<Progress>)>;

/// Removes simulations that ended more than [`KEPT`] ago.
fn forget(all: &mut Directory) {
    all.retain(|_, (_, p)| {
        p.borrow()
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
        let solver = r.solver();
        let (tx, rx) = watch::channel(Progress::default());
        let frame_count = scene.frames() as u32;
        let vertex_count = scene.start.len() as u32;
        let id = format!(
            "simulation-{}",
            self.started.fetch_add(1, Ordering::Relaxed)
        );
        {
            let mut all = self.running.lock().unwrap_or_else(PoisonError::into_inner);
            forget(&mut all);
            if all
                .values()
                .filter(|(_, p)| p.borrow().end.is_none())
                .count()
                >= self.limit
            {
                return Err(exhausted("simulations", self.limit));
            }
            all.insert(id.clone(), (frame_count, rx));
        }
        let spawned = std::thread::Builder::new()
            .name(id.clone())
            .spawn(move || compute(&scene, solver, &tx));
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
        })
    }

    /// All frames from `first` on, then the end.
    pub(crate) fn follow(&self, id: &str, first: u32) -> Result<Frames, Status> {
        let mut all = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        forget(&mut all);
        let (frame_count, progress) = all
            .get(id)
            .cloned()
            .ok_or_else(|| not_found("simulation", id))?;
        if first >= frame_count {
            let why = format!("{first}: there are {frame_count} frames");
            return Err(WireError::new("follow_simulation_request.first_frame", why).into());
        }
        Ok(Box::pin(futures::stream::unfold(
            Some((first, progress)),
            move |at| async move {
                let (next, mut progress) = at?;
                match wait(&mut progress, next).await {
                    Ok(Some((positions, ms))) => {
                        let m = FollowSimulationResponse {
                            frame: next,
                            frame_count,
                            positions,
                            ms,
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

/// The frame `next`, or the end.
async fn wait(
    progress: &mut watch::Receiver<Progress>,
    next: u32,
) -> Result<Option<(Bytes, f32)>, Status> {
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

/// Runs a scene to its end, or until no reader can follow it.
fn compute(scene: &Scene, solver: ClothSolver, progress: &watch::Sender<Progress>) {
    let mut last = Instant::now();
    let mut publish = |positions: &[P3]| {
        let bytes: Vec<u8> = positions
            .iter()
            .flat_map(|p| [p.x, p.y, p.z])
            .flat_map(f32::to_le_bytes)
            .collect();
        let ms = last.elapsed().as_secs_f32() * 1e3;
        progress.send_modify(|p| p.frames.push((bytes.into(), ms)));
        last = Instant::now();
        if progress.receiver_count() == 0 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let end = match solver {
        ClothSolver::Offline => offline(scene, &mut publish),
        ClothSolver::Unspecified | ClothSolver::Realtime => {
            scene::run(scene, &RunConfig::default(), |_, x| publish(x))
                .map(drop)
                .map_err(|e| e.to_string())
        }
    };
    if let Err(why) = &end {
        tracing::warn!(why, "simulation failed");
    }
    progress.send_modify(|p| p.end = Some((Instant::now(), end)));
}

/// All frames by the offline solver, the start first.
fn offline(
    scene: &Scene,
    publish: &mut impl FnMut(&[P3]) -> ControlFlow<()>,
) -> Result<(), String> {
    let offline = OfflineScene::new(scene).map_err(|e| e.to_string())?;
    if publish(&scene.start).is_break() {
        return Ok(());
    }
    offline
        .run(&OfflineSettings::default(), Par::Rayon, |_, x| publish(x))
        .map(drop)
        .map_err(|e| e.to_string())
}
