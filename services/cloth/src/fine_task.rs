//! A session's garments on finer meshes, from the real-time result on: draped to rest in one pose, then through the
//! recorded motion of the body.

use crate::progress::{MAX_RESULT_BYTES, Publisher};
use crate::recording::{MAX_SECONDS, Recording, most_bodies};
use std::ops::ControlFlow;
use std::sync::Arc;
use tokio::sync::watch;
use tonic::Status;
use tryon::body::Template;
use tryon::cloth::fine::DrapeReport;
use tryon::geometry::par::Par;
use tryon::mirror::{DressedOutfit, FrameClock, MirrorError, OfflineOutfit, OfflineRun, time_step};
use tryon_proto::convert::WireError;
use tryon_proto::convert::garment::{WornGarment, topology_to_wire};
use tryon_proto::v1::{
    ClothSolver, DrapeStep, FrameId, GarmentTopology, RigidTransform, SessionStart,
    StartSimulationRequest, StartSimulationResponse,
};

/// Most vertices that can be asked for, as the contract says: the finest garments of the paper.
const MAX_VERTICES: u32 = 50_000;

/// Outfit of a session at one exposure.
pub(crate) struct Snapshot {
    pub(crate) outfit: DressedOutfit,
    pub(crate) template: Arc<Template>,
    /// Garments of the outfit as keyframes describe them.
    pub(crate) garments: Arc<[Arc<WornGarment>]>,
    pub(crate) exposure: FrameId,
    pub(crate) world_from_camera: Option<RigidTransform>,
    /// The body after that exposure; `None` for the pose of that exposure alone.
    pub(crate) recording: Option<Recording>,
    /// Its sender is gone once the session has forgotten the body.
    pub(crate) body: watch::Receiver<()>,
}

/// Checks a request that starts from a session.
///
/// # Errors
/// INVALID_ARGUMENT names the field at fault.
pub(crate) fn check(r: &StartSimulationRequest, start: &SessionStart) -> Result<(), Status> {
    if !(1..=MAX_VERTICES).contains(&start.vertices) {
        let why = format!("{}, but 1 to {MAX_VERTICES} are needed", start.vertices);
        return fault("session.vertices", why);
    }
    if !(0.0..=MAX_SECONDS).contains(&start.motion_seconds) {
        let why = format!(
            "{}, but 0 to {MAX_SECONDS} are needed",
            start.motion_seconds
        );
        return fault("session.motion_seconds", why);
    }
    check_solver(r)
}

/// Checks the solver and the checkpoint of a request for a session's simulation, new or continued.
///
/// # Errors
/// INVALID_ARGUMENT names the field at fault.
pub(crate) fn check_solver(r: &StartSimulationRequest) -> Result<(), Status> {
    if !matches!(r.solver(), ClothSolver::Unspecified | ClothSolver::Offline) {
        return fault("solver", "a session has the offline solver only".into());
    }
    if !r.checkpoint.is_empty() {
        return fault("checkpoint", "only scenes have checkpoints".into());
    }
    Ok(())
}

fn fault(field: &str, why: String) -> Result<(), Status> {
    let field = format!("start_simulation_request.{field}");
    Err(WireError::new(field, why).into())
}

fn aborted(e: impl ToString) -> Status {
    Status::aborted(e.to_string())
}

/// Status of a drape that failed.
fn refused(e: MirrorError) -> Status {
    match e {
        MirrorError::TangledStart { .. } => Status::failed_precondition(e.to_string()),
        e => aborted(e),
    }
}

/// Simulation from one snapshot on, or its remainder after a cancel.
pub(crate) struct FineTask {
    snapshot: Snapshot,
    outfit: OfflineOutfit,
    /// `None` before the drape is done.
    last: Option<LastFrame>,
}

/// Last finished frame.
struct LastFrame {
    number: u32,
    captured_ns: u64,
    /// State after it.
    checkpoint: Vec<u8>,
}

impl LastFrame {
    fn of(run: &OfflineRun<'_>, number: u32, exposure: FrameId) -> Self {
        Self {
            number,
            captured_ns: exposure.capture_time_ns,
            checkpoint: run.solver().checkpoint(u64::from(number)),
        }
    }
}

impl FineTask {
    /// Task of a request that was checked; divides the meshes, so it takes a while.
    ///
    /// # Errors
    /// FAILED_PRECONDITION for a garment without area or mass; INVALID_ARGUMENT when the frames would take too much memory.
    pub(crate) fn new(snapshot: Snapshot, start: &SessionStart) -> Result<Self, Status> {
        let faces = snapshot.template.mesh().faces();
        let outfit = OfflineOutfit::new(&snapshot.outfit, faces, start.vertices as usize);
        let outfit = outfit.map_err(|e| Status::failed_precondition(e.to_string()))?;
        let frames = 1 + most_bodies(start.motion_seconds);
        let bytes = frames * outfit.cloth().len() * size_of::<[f32; 3]>();
        if bytes > MAX_RESULT_BYTES {
            let field = "start_simulation_request.session.motion_seconds";
            let why = format!("the frames take {bytes} bytes, at most {MAX_RESULT_BYTES}");
            return Err(WireError::new(field, why).into());
        }
        let last = None;
        Ok(Self {
            snapshot,
            outfit,
            last,
        })
    }

    /// First frame that is computed, and the one after the last or 0 while the body is being recorded.
    pub(crate) fn frames(&self) -> [u32; 2] {
        let first = self.last.as_ref().map_or(0, |l| l.number + 1);
        let draped = u32::from(self.last.is_none());
        match &self.snapshot.recording {
            Some(recording) if !recording.is_closed() => [first, 0],
            recording => {
                let recorded = recording.as_ref().map_or(0, |r| r.len() as u32);
                [first, first + draped + recorded]
            }
        }
    }

    /// Its sender is gone once the session has forgotten the body.
    pub(crate) fn body(&self) -> watch::Receiver<()> {
        self.snapshot.body.clone()
    }

    /// Response to a start, but for the id, with the numbers of [`Self::frames`].
    pub(crate) fn response(&self, [first_frame, frame_count]: [u32; 2]) -> StartSimulationResponse {
        StartSimulationResponse {
            first_frame,
            frame_count,
            vertex_count: self.outfit.cloth().len() as u32,
            garments: self.topology(),
            exposure: Some(self.snapshot.exposure),
            world_from_camera: self.snapshot.world_from_camera,
            ..Default::default()
        }
    }

    /// Garments on their finer meshes.
    fn topology(&self) -> Vec<GarmentTopology> {
        let garments = self.outfit.garments().iter().zip(&*self.snapshot.garments);
        let finer = garments.map(|(mesh, worn)| WornGarment {
            vertices: mesh.vertices,
            drawn: mesh.render.vertex.clone(),
            faces: mesh.render.faces.clone(),
            uvs: mesh.render.uv.clone(),
            ..(**worn).clone()
        });
        finer.map(|g| topology_to_wire(&g)).collect()
    }

    /// Publishes the frames that are missing, the drape first, until `publisher` breaks off; returns the task of those that
    /// are still missing then.
    ///
    /// # Errors
    /// FAILED_PRECONDITION for a start that cannot be freed of intersections, ABORTED for a step that is not solved.
    pub(crate) fn compute(mut self, publisher: &mut Publisher) -> Result<Option<Self>, Status> {
        let flow = self.run(publisher)?;
        Ok(flow.is_break().then_some(self).filter(Self::has_more))
    }

    /// False once the last frame of a recording that is over is done.
    fn has_more(&self) -> bool {
        let recording = self.snapshot.recording.as_ref();
        self.last.is_none() || recording.is_some_and(|r| !r.is_closed() || !r.is_empty())
    }

    /// Frames of a recording that may still go on, after the drape or the last finished one. A drape that breaks off starts
    /// anew in the task that is left.
    fn run(&mut self, publisher: &mut Publisher) -> Result<ControlFlow<()>, Status> {
        let (mut run, mut number, exposed_ns) = match self.last.take() {
            Some(last) => {
                let run = OfflineRun::resumed(&self.outfit, &last.checkpoint, Par::Rayon);
                (run.map_err(aborted)?, last.number, last.captured_ns)
            }
            None => {
                let show =
                    |vertices, step: &DrapeReport| publisher.show(drape_step(vertices, step));
                let worn = &self.snapshot.outfit;
                let draped = self.outfit.drape(worn, Par::Rayon, show);
                let (run, _) = draped.map_err(refused)?;
                if publisher.is_cancelled() {
                    return Ok(ControlFlow::Break(()));
                }
                let exposure = self.snapshot.exposure;
                if publish(&run, publisher, exposure).is_break() {
                    self.last = Some(LastFrame::of(&run, 0, exposure));
                    return Ok(ControlFlow::Break(()));
                }
                (run, 0, exposure.capture_time_ns)
            }
        };
        let Some(recording) = &mut self.snapshot.recording else {
            return Ok(ControlFlow::Continue(()));
        };
        let mut clock = FrameClock::at(exposed_ns);
        while let Some(body) = recording.blocking_recv() {
            let dt = time_step(clock.gap(body.exposure.capture_time_ns));
            run.follow(&body.vertices, dt).map_err(aborted)?;
            if recording.is_closed() {
                publisher.expect(1 + recording.len());
            }
            number += 1;
            if publish(&run, publisher, body.exposure).is_break() {
                self.last = Some(LastFrame::of(&run, number, body.exposure));
                return Ok(ControlFlow::Break(()));
            }
        }
        publisher.expect(0);
        Ok(ControlFlow::Continue(()))
    }
}

/// Publishes the cloth of a run.
fn publish(run: &OfflineRun<'_>, publisher: &mut Publisher, exposure: FrameId) -> ControlFlow<()> {
    publisher.publish(&run.solver().state().positions(), Some(exposure))
}

fn drape_step(vertices: usize, step: &DrapeReport) -> DrapeStep {
    DrapeStep {
        vertex_count: vertices as u32,
        steps: step.steps as u32,
        motion: step.motion as f32,
        settled: step.settled,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::progress::Progress;
    use std::error::Error;
    use tonic::Code;
    use tryon::body::measure::measure;
    use tryon::body::{BodyShape, Pose, embedded};
    use tryon::geometry::math::{Body, Rigid, World};
    use tryon::mirror::{Choice, PutOn, Subject};

    /// A garment on the mean body, of which nothing is recorded and which is forgotten.
    pub(crate) fn snapshot(garment: &str, how: PutOn) -> Result<Snapshot, Box<dyn Error>> {
        let template = embedded::template();
        let rest = template.personalise(&BodyShape::default());
        let mut pose: Pose<World> =
            Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
        pose.lower_arms(template.skeleton(), &rest, 0.9);
        let subject = Subject {
            template: &template,
            rest: &rest,
            pose: &pose,
            world_from_camera: Rigid::identity(),
        };
        let sized = Choice::library(garment, None)?.sized(&measure(&template, &rest)?)?;
        let mut outfit = DressedOutfit::put_on(&subject, vec![sized], how)?;
        outfit.carry_to(&subject)?;
        Ok(Snapshot {
            outfit,
            template,
            garments: Arc::new([]),
            exposure: FrameId::default(),
            world_from_camera: None,
            recording: None,
            body: watch::Sender::new(()).subscribe(),
        })
    }

    /// A T-shirt whose front was pushed through the wearer and out of the back cannot start a simulation, and says why.
    #[test]
    fn a_tangled_start_is_refused_with_its_places() -> Result<(), Box<dyn Error>> {
        let mut snapshot = snapshot("tshirt", PutOn::default())?;
        let front = |z: f32| z > 0.05;
        let cloth = &mut snapshot.outfit.state.garments[0].positions;
        cloth
            .iter_mut()
            .filter(|p| front(p.z))
            .for_each(|p| p.z -= 0.4);
        let start = SessionStart {
            vertices: 2000,
            ..SessionStart::default()
        };
        let task = FineTask::new(snapshot, &start)?;
        let mut publisher = Publisher::new(Progress::of([0, 1]));
        let Err(why) = task.compute(&mut publisher) else {
            panic!("a start that is tangled");
        };
        assert_eq!(why.code(), Code::FailedPrecondition, "{why}");
        assert!(why.message().contains("tshirt"), "{why}");
        Ok(())
    }
}
