//! Simulation of a scene that its request holds, by either solver.

use crate::progress::{MAX_RESULT_BYTES, Publisher};
use bytes::Bytes;
use std::ops::ControlFlow;
use std::path::Path;
use tonic::Status;
use tryon::cloth::fine::{OfflineSettings, checkpoint_frame};
use tryon::cloth::scene::{self, OfflineScene, Scene};
use tryon::geometry::par::Par;
use tryon_proto::convert::WireError;
use tryon_proto::v1::{ClothSolver, StartSimulationRequest};

/// Largest scene text, bytes; as the contract says.
const MAX_SCENE_BYTES: usize = 1024 * 1024;
/// Largest checkpoint, bytes; as the contract says.
const MAX_CHECKPOINT_BYTES: usize = 4 << 20;

/// Scene with its solver and start.
pub(crate) struct SceneTask {
    scene: Scene,
    solver: ClothSolver,
    /// State to continue from and its frame.
    checkpoint: Option<(u32, Bytes)>,
}

impl SceneTask {
    /// Task of a request with this scene.
    ///
    /// # Errors
    /// INVALID_ARGUMENT names the field at fault.
    pub(crate) fn new(scene_json: &str, r: &StartSimulationRequest) -> Result<Self, Status> {
        Ok(Self {
            scene: check(scene_json)?,
            solver: r.solver(),
            checkpoint: check_checkpoint(r)?,
        })
    }

    /// First frame that is computed, and the one after the last.
    pub(crate) fn frames(&self) -> [u32; 2] {
        let first = self.checkpoint.as_ref().map_or(0, |(frame, _)| frame + 1);
        [first, self.scene.frames() as u32]
    }

    /// Vertices of the cloth.
    pub(crate) fn vertices(&self) -> u32 {
        self.scene.start.len() as u32
    }

    /// Runs the scene to its end, or until `publisher` breaks off.
    ///
    /// # Errors
    /// ABORTED for a step that is not solved.
    pub(crate) fn compute(&self, publisher: &mut Publisher) -> Result<(), Status> {
        match self.solver {
            ClothSolver::Offline => self.offline(publisher),
            ClothSolver::Unspecified | ClothSolver::Realtime => {
                scene::run(&self.scene, &self.scene.config(), |_, x| {
                    publisher.publish(x, None)
                })
                .map(drop)
                .map_err(|e| e.to_string())
            }
        }
        .map_err(Status::aborted)
    }

    /// All frames by the offline solver, the start first, or those after the checkpoint.
    fn offline(&self, publisher: &mut Publisher) -> Result<(), String> {
        let offline = OfflineScene::new(&self.scene).map_err(|e| e.to_string())?;
        let from = self.checkpoint.as_ref().map(|(_, bytes)| &bytes[..]);
        if from.is_none() {
            // Cancelled or not: without a frame there is no state to continue from.
            let _: ControlFlow<()> = publisher.publish(&self.scene.start, None);
        }
        let settings = OfflineSettings::default();
        offline
            .run(&settings, Par::Rayon, from, |done, solver| {
                let flow = publisher.publish(&solver.state().positions(), None);
                if flow.is_break() {
                    return publisher.keep(solver.checkpoint(done.frame as u64).into());
                }
                flow
            })
            .map(drop)
            .map_err(|e| e.to_string())
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

/// The scene of a text, or the field at fault.
fn check(scene_json: &str) -> Result<Scene, Status> {
    let fault = |why: &str| WireError::new("start_simulation_request.scene_json", why);
    if scene_json.len() > MAX_SCENE_BYTES {
        return Err(fault("at most 1 MiB").into());
    }
    let scene = scene::parse(scene_json, Path::new("scene_json"), None)
        .map_err(|e| fault(&e.to_string()))?;
    let bytes = scene.frames() * scene.start.len() * size_of::<[f32; 3]>();
    if bytes > MAX_RESULT_BYTES {
        let why = format!("duration_s: the frames take {bytes} bytes, at most {MAX_RESULT_BYTES}");
        return Err(fault(&why).into());
    }
    Ok(scene)
}
