//! Fine picture of a try-on: cloth drapes its garments on finer meshes, and the exposure of that pose is drawn with them.

use crate::card::Card;
use crate::encoding::Encoding;
use crate::engine::{Engine, Job, Placed};
use crate::formats::Format;
use crate::join_buffer::JoinBuffer;
use crate::off_person;
use crate::try_on::{Command, Handle};
use crate::upstream::MAX_GARMENT_BYTES;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, mpsc, oneshot, watch};
use tonic::{Code, Request, Status};
use tryon::geometry::math::P3;
use tryon_kit::auth::Connection;
use tryon_kit::compute::Pool;
use tryon_kit::frames::stage;
use tryon_kit::sessions::{brief, unix_ns};
use tryon_kit::simulations::{FineFrame, FollowError, FrameOrder, LossPolicy, SimulationClient};
use tryon_kit::status::{from_upstream, not_found, unavailable};
use tryon_proto::convert::WireError;
use tryon_proto::convert::geometry::rigid_from_wire;
use tryon_proto::convert::required;
use tryon_proto::convert::simulation::{self, garments_from_wire};
use tryon_proto::v1::start_simulation_request::Start;
use tryon_proto::v1::take_fine_picture_response::Content;
use tryon_proto::v1::{
    ClothDetail, DrapeStep, FollowSimulationResponse, FrameId, Picture, PictureCodec, SessionStart,
    StartSimulationRequest, StartSimulationResponse, TakeFinePictureResponse, TryOnState,
};

/// Vertices of all garments without a wish.
const VERTICES: u32 = 30_000;
/// Most vertices, as the contract says.
const MAX_VERTICES: u32 = 50_000;
/// Longest wait for the start of a simulation, which divides the meshes.
const START_DEADLINE: Duration = Duration::from_secs(10);
/// Time after the request in which the exposure that cloth starts from is sure to have arrived.
const ARRIVAL: Duration = Duration::from_millis(300);

/// Time in which later poses are tried while the garments pass through themselves or the body too much to start from.
const OTHER_POSES: Duration = Duration::from_secs(20);
/// Longest time without a message: the server ends connections that are silent for ten seconds, and a step of fine cloth takes
/// longer.
const HEARTBEAT: Duration = Duration::from_secs(1);
/// Pause before another pose.
const POSE_PAUSE: Duration = Duration::from_millis(300);
/// Times that a line which broke is mended without a message between.
const LOST_LINES: usize = 8;

/// Stream of one fine picture.
pub(crate) type Messages = mpsc::Receiver<Result<TakeFinePictureResponse, Status>>;
type Sender = mpsc::Sender<Result<TakeFinePictureResponse, Status>>;
/// Newest step of the drape.
type Steps = watch::Sender<DrapeStep>;

/// Means and wishes of one fine picture.
pub(crate) struct FinePicture {
    pub(crate) try_on_id: String,
    pub(crate) handle: Arc<Handle>,
    pub(crate) cloth: Connection,
    pub(crate) card: Card,
    pub(crate) pool: Arc<Pool>,
    pub(crate) encoding: Encoding,
    /// Vertices of all garments, about.
    pub(crate) vertices: u32,
}

/// Number of vertices that is asked for; 0 is none in particular.
///
/// # Errors
/// Names the field when it is out of range.
pub(crate) fn vertices(wanted: u32) -> Result<u32, WireError> {
    match wanted {
        0 => Ok(VERTICES),
        1..=MAX_VERTICES => Ok(wanted),
        _ => Err(WireError::new(
            "take_fine_picture_request.vertices",
            format!("{wanted} is too many, at most {MAX_VERTICES}"),
        )),
    }
}

/// Simulation in cloth. Dropping it ends it; one that has ended stays as it is.
struct Simulation {
    client: SimulationClient,
    id: String,
}

impl Drop for Simulation {
    fn drop(&mut self) {
        let client = self.client.clone();
        let id = std::mem::take(&mut self.id);
        tokio::spawn(async move { client.abandon(&id).await });
    }
}

impl FinePicture {
    /// Starts the work. It ends with the picture, with an error, when nobody listens any more, and with the try-on.
    pub(crate) fn spawn(self, place: OwnedSemaphorePermit) -> Messages {
        let (messages, reader) = mpsc::channel(8);
        tokio::spawn(async move {
            let _place = place;
            let handle = self.handle.clone();
            let made = tokio::select! {
                made = self.told(&messages) => made,
                () = handle.commands.closed() => Err(not_found("try-on", &self.try_on_id)),
                () = messages.closed() => return,
            };
            if let Err(why) = &made {
                tracing::warn!(try_on = brief(&self.try_on_id), %why, "no fine picture");
            }
            let last = made.map(|picture| message(Content::Picture(picture)));
            // The caller may have left.
            let _ = messages.send(last).await;
        });
        reader
    }

    /// The picture; until then each step is told, and the newest again after a while: the line is not dead.
    async fn told(&self, messages: &Sender) -> Result<Picture, Status> {
        let (steps, mut newest) = watch::channel(DrapeStep::default());
        let picture = self.make(&steps);
        tokio::pin!(picture);
        loop {
            tokio::select! {
                made = &mut picture => return made,
                // Its sender is above.
                _ = tokio::time::timeout(HEARTBEAT, newest.changed()) => {}
            }
            let step = *newest.borrow_and_update();
            // A reader without room has messages to read.
            let _ = messages.try_send(Ok(message(Content::Drape(step))));
        }
    }

    /// The picture of the first pose from now on that can be draped.
    async fn make(&self, steps: &Steps) -> Result<Picture, Status> {
        let begun = Instant::now();
        loop {
            match self.one_pose(steps).await {
                Err(Failure::Tangled(_)) if begun.elapsed() < OTHER_POSES => {
                    tokio::time::sleep(POSE_PAUSE).await;
                }
                made => return made.map_err(Into::into),
            }
        }
    }

    async fn one_pose(&self, steps: &Steps) -> Result<Picture, Failure> {
        let begun = Instant::now();
        let policy = LossPolicy {
            tries: LOST_LINES,
            is_lost: |why| matches!(end(why), Failure::Line(_)),
            cut: Some("the drape ended without a frame"),
        };
        let client = SimulationClient::new(self.cloth.clone(), MAX_GARMENT_BYTES, policy);
        let before = self.recent().await?;
        // The exposure of the start is kept now: it is half a second old when the meshes are divided.
        let (started, after) = tokio::join!(client.start(self.start()), async {
            tokio::time::sleep(ARRIVAL).await;
            self.recent().await
        });
        let started = started.map_err(|s| refusal(&s))?;
        let id = started.simulation_id.clone();
        let simulation = Simulation { client, id };
        let id = required(started.exposure, "start_simulation_response.exposure")?;
        let mut job = exposed(&id, &[after?, before])?;
        let positions = drape(&simulation, &started, steps).await?;
        drop(simulation);
        job.placed = Some(Arc::new(placed(&started, &positions, begun)?));
        job.formats = vec![Format {
            shape: None,
            encoding: self.encoding,
        }];
        Ok(self.draw(job).await?)
    }

    /// Exposures and bodies of the last half second.
    async fn recent(&self) -> Result<JoinBuffer, Status> {
        let gone = || not_found("try-on", &self.try_on_id);
        let (answer, recent) = oneshot::channel();
        let command = Command::Recent(answer);
        let sent = self.handle.commands.send(command).await;
        sent.map_err(|_| gone())?;
        recent.await.map_err(|_| gone())
    }

    fn start(&self) -> Request<StartSimulationRequest> {
        let session = SessionStart {
            session_id: self.try_on_id.clone(),
            vertices: self.vertices,
            motion_seconds: 0.0,
        };
        let mut start = Request::new(StartSimulationRequest {
            start: Some(Start::Session(session)),
            ..Default::default()
        });
        start.set_timeout(START_DEADLINE);
        start
    }

    async fn draw(&self, job: Job) -> Result<Picture, Status> {
        let card = self.card.clone();
        let draw = move || {
            let mut drawn = None;
            let outcome = Engine::new(card).draw(&job, |picture| drawn = Some(picture));
            outcome.map(|()| drawn.map(|p| (job.exposure.id, p)))
        };
        let drawn = self.pool.run(draw).await;
        let fault = |why: String| unavailable("compositor", &why);
        let drawn = drawn.map_err(|e| fault(e.to_string()))?.map_err(fault)?;
        let (id, p) = drawn.ok_or_else(|| unavailable("compositor", "no picture"))?;
        let mut picture = Picture {
            frame: Some(id),
            state: TryOnState::Live.into(),
            codec: PictureCodec::from(p.format.encoding).into(),
            width: p.width,
            height: p.height,
            image: p.bytes,
            latency_ms: unix_ns().saturating_sub(id.received_unix_ns) as f32 * 1e-6,
            stages: p.stages,
            cloth_detail: ClothDetail::Full.into(),
            ..Picture::default()
        };
        off_person::describe(&mut picture, p.off_person.as_ref());
        Ok(picture)
    }
}

fn message(content: Content) -> TakeFinePictureResponse {
    TakeFinePictureResponse {
        content: Some(content),
    }
}

/// The exposure of that id with its body, not yet drawn.
fn exposed(id: &FrameId, recent: &[JoinBuffer]) -> Result<Job, Status> {
    let exposure = recent.iter().find_map(|b| b.find(id));
    let (_, exposure) =
        exposure.ok_or_else(|| unavailable("compositor", "the exposure is no longer kept"))?;
    Ok(Job {
        exposure,
        placed: None,
        body: recent.iter().find_map(|b| b.find_body(id)),
        formats: Vec::new(),
        fit: None,
    })
}

/// Vertices of a drape at rest (m, world), followed also over a line that breaks.
async fn drape(
    simulation: &Simulation,
    started: &StartSimulationResponse,
    steps: &Steps,
) -> Result<Vec<P3>, Failure> {
    let mut order = FrameOrder::new(started.vertex_count as usize, 0);
    order.expect(1);
    let mut draped = Vec::new();
    let receive = |m: &FollowSimulationResponse, frame: Option<FineFrame>| {
        match frame {
            Some(frame) => draped = frame.positions,
            None => m.drape.into_iter().for_each(|step| {
                steps.send_replace(step);
            }),
        }
        Ok(())
    };
    let followed = simulation
        .client
        .follow(&simulation.id, &mut order, receive);
    match followed.await {
        Ok(()) => Ok(draped),
        Err(FollowError::Service(why)) => Err(end(&why)),
        Err(FollowError::Receiver(why)) => Err(why),
    }
}

fn placed(
    started: &StartSimulationResponse,
    positions: &[P3],
    begun: Instant,
) -> Result<Placed, WireError> {
    let field = "start_simulation_response.world_from_camera";
    let world = required(started.world_from_camera.as_ref(), field)?;
    let garments = garments_from_wire(started)?;
    Ok(Placed {
        garments: simulation::placed(garments, positions)?,
        world_from_camera: rigid_from_wire(world, field)?,
        stages: vec![stage("cloth.drape", begun)],
        revision: 0,
        detail: ClothDetail::Full,
    })
}

/// Reason of cloth not to start; a session that it doesn't know wears nothing yet.
fn refusal(s: &Status) -> Status {
    match s.code() {
        Code::NotFound => Status::failed_precondition("no garments are live yet"),
        _ => from_upstream("cloth", s),
    }
}

/// Reason for no picture of a pose.
#[derive(Debug)]
enum Failure {
    /// The garments pass through themselves or the body too much to start from.
    Tangled(Status),
    /// Cloth does not answer.
    Line(Status),
    /// Anything that another try does not change.
    Other(Status),
}

impl From<Status> for Failure {
    fn from(s: Status) -> Self {
        Self::Other(s)
    }
}

impl From<WireError> for Failure {
    fn from(e: WireError) -> Self {
        Self::Other(e.into())
    }
}

impl From<Failure> for Status {
    fn from(f: Failure) -> Self {
        match f {
            Failure::Tangled(s) | Failure::Line(s) | Failure::Other(s) => s,
        }
    }
}

/// End of a drape without a result. A simulation is unknown once its body is.
fn end(s: &Status) -> Failure {
    let gone = || Status::aborted("the person left before the drape came to its end");
    match s.code() {
        Code::FailedPrecondition => Failure::Tangled(s.clone()),
        Code::NotFound => Failure::Other(gone()),
        Code::Aborted => Failure::Other(s.clone()),
        Code::PermissionDenied | Code::Unauthenticated => Failure::Other(from_upstream("cloth", s)),
        _ => Failure::Line(from_upstream("cloth", s)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon::geometry::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};
    use tryon_kit::frames::Exposure;

    fn exposure(sequence: u64) -> Arc<Exposure> {
        let k = Intrinsics::KINECT_V1.resized(16, 16);
        let id = FrameId {
            sequence,
            ..FrameId::default()
        };
        let rgbd = RgbdFrame {
            sequence,
            time_ns: sequence,
            depth: DepthImage::empty(16, 16),
            color: None,
        };
        Arc::new(Exposure {
            id,
            calibration: Arc::new(Calibration::registered(k)),
            rgbd,
            stages: vec![],
        })
    }

    #[test]
    fn numbers_of_vertices_are_checked() {
        assert_eq!(vertices(0), Ok(VERTICES));
        assert_eq!(vertices(1), Ok(1));
        assert_eq!(vertices(MAX_VERTICES), Ok(MAX_VERTICES));
        let e = vertices(MAX_VERTICES + 1).expect_err("too many");
        assert!(e.to_string().contains("take_fine_picture_request.vertices"));
    }

    #[test]
    fn the_exposure_of_the_start_is_found_in_either_buffer() {
        let (mut before, mut after) = (JoinBuffer::default(), JoinBuffer::default());
        before.push_frame(exposure(1));
        after.push_frame(exposure(2));
        let buffers = [after, before];
        for sequence in [1, 2] {
            let id = exposure(sequence).id;
            let job = exposed(&id, &buffers).map_err(|s| s.code());
            assert_eq!(job.map(|j| j.exposure.id.sequence), Ok(sequence));
        }
        let gone = exposed(&exposure(3).id, &buffers).map(|_| ());
        assert_eq!(gone.expect_err("gone").code(), Code::Unavailable);
    }

    #[test]
    fn refusals_and_ends_of_cloth_keep_their_meaning() {
        let tangled = Status::failed_precondition("garments pass through themselves");
        assert_eq!(refusal(&tangled).code(), Code::FailedPrecondition);
        let unknown = Status::not_found("session");
        assert_eq!(refusal(&unknown).code(), Code::FailedPrecondition);
        assert!(matches!(end(&unknown), Failure::Other(s) if s.code() == Code::Aborted));
        assert!(matches!(end(&tangled), Failure::Tangled(s) if s.code() == tangled.code()));
        let unsolved = Status::aborted("unsolved");
        assert!(matches!(end(&unsolved), Failure::Other(s) if s.code() == Code::Aborted));
        let broken = Status::internal("panicked");
        assert_eq!(refusal(&broken).code(), Code::Unavailable);
        assert!(matches!(end(&broken), Failure::Line(s) if s.code() == Code::Unavailable));
    }
}
