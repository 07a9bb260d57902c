//! Remote procedures of the cloth service: check the request, find the session, answer.

use crate::chosen_sizes::ChosenSizes;
use crate::engine::Update;
use crate::fine_task;
use crate::library::Library;
use crate::progress::Frames;
use crate::scene_task::SceneTask;
use crate::session::{self, Command, Handle, Message, Setup, reader};
use crate::simulation::Simulations;
use futures::Stream;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::oneshot;
use tonic::{Request, Response, Status};
use tryon_kit::auth::{Connection, Grant};
use tryon_kit::config::ClothConfig;
use tryon_kit::server::Context;
use tryon_kit::sessions::{Opened, Sessions, brief};
use tryon_kit::status::{exhausted, not_found};
use tryon_proto::convert::garment::GarmentWriter;
use tryon_proto::convert::{WireError, request};
use tryon_proto::v1::cloth_service_server::ClothService;
use tryon_proto::v1::start_simulation_request::Start;
use tryon_proto::v1::*;

/// Directory of sessions and the dependencies of new ones.
pub(crate) struct Cloth {
    sessions: Sessions<Handle>,
    simulations: Simulations,
    ctx: Context,
    tracking: Connection,
    idle: Duration,
    adapts_detail: bool,
    library: Arc<Library>,
}

impl Cloth {
    pub(crate) fn new(
        config: &ClothConfig,
        ctx: &Context,
        tracking: Connection,
        library: Library,
    ) -> Self {
        Self {
            sessions: Sessions::new(config.max_sessions),
            simulations: Simulations::new(config.max_simulations),
            ctx: ctx.clone(),
            tracking,
            idle: Duration::from_secs(config.idle_s),
            adapts_detail: config.adapts_detail,
            library: Arc::new(library),
        }
    }

    /// Sends a command to a session.
    async fn command(&self, session: &str, command: Command) -> Result<(), Status> {
        let handle = self.sessions.get(session);
        let handle: Arc<Handle> = handle.ok_or_else(|| not_found("session", session))?;
        let sent = handle.commands.send(command).await;
        sent.map_err(|_| not_found("session", session))
    }

    /// Starts the simulation of the garments that a session wears now.
    async fn start_fine(&self, start: &SessionStart) -> Result<StartSimulationResponse, Status> {
        let place = self.simulations.place()?;
        let id = &start.session_id;
        let (answer, snapshot) = oneshot::channel();
        let command = Command::Snapshot {
            motion_seconds: start.motion_seconds,
            answer,
        };
        self.command(id, command).await?;
        let snapshot = snapshot.await.map_err(|_| not_found("session", id))??;
        self.simulations.start_fine(place, start, snapshot).await
    }

    /// Refuses a request whose token does not reach a simulation: that of a session belongs to it, others to the store.
    fn permit_simulation<T>(&self, r: &Request<T>, simulation: &str) -> Result<(), Status> {
        match self.simulations.session(simulation)? {
            Some(session) => permit(r, &session),
            None => Grant::of(r)?.check_whole_store(),
        }
    }
}

/// Refuses a request whose token does not reach the session it names, whose camera this service does not know.
fn permit<T>(r: &Request<T>, session: &str) -> Result<(), Status> {
    Grant::of(r)?.check_session_of_any_camera(session)
}

#[tonic::async_trait]
impl ClothService for Cloth {
    async fn list_garments(
        &self,
        _: Request<ListGarmentsRequest>,
    ) -> Result<Response<ListGarmentsResponse>, Status> {
        Ok(Response::new(ListGarmentsResponse {
            garments: self.library.garments(),
        }))
    }

    async fn dress(&self, r: Request<DressRequest>) -> Result<Response<DressResponse>, Status> {
        permit(&r, &r.get_ref().session_id)?;
        let r = r.get_ref();
        let id = request::session_id("dress_request.session_id", &r.session_id)?;
        let choices = request::choices("dress_request", &r.garments)?;
        self.library.check(&choices)?;
        let sizes = ChosenSizes::from_wire(r.known_sizes.as_ref(), &choices, &self.library)?;
        if self
            .sessions
            .get(&id)
            .is_some_and(|h| h.commands.is_closed())
        {
            self.sessions.remove(&id);
        }
        let setup = || Setup {
            id: id.clone(),
            ctx: self.ctx.clone(),
            tracking: self.tracking.clone(),
            idle: self.idle,
            adapts_detail: self.adapts_detail,
            sizes: sizes.clone(),
            library: self.library.clone(),
            directory: self.sessions.clone(),
        };
        let handle = match self.sessions.open(&id, || session::spawn(setup())) {
            Opened::Found(h) => h,
            Opened::Created(h) => {
                tracing::info!(session = brief(&id), "opened");
                metrics::gauge!("tryon_cloth_sessions").set(self.sessions.len() as f64);
                h
            }
            Opened::Full => return Err(exhausted("sessions", self.sessions.limit())),
        };
        handle.outfit.send_if_modified(|o| {
            let changed = o.revision == 0 || o.choices != choices;
            if changed {
                o.revision += 1;
                o.choices = choices;
            }
            changed
        });
        let outfit_revision = handle.outfit.borrow().revision;
        Ok(Response::new(DressResponse { outfit_revision }))
    }

    async fn undress(
        &self,
        r: Request<UndressRequest>,
    ) -> Result<Response<UndressResponse>, Status> {
        permit(&r, &r.get_ref().session_id)?;
        if let Some(h) = self.sessions.remove(&r.get_ref().session_id) {
            let _ = h.commands.send(Command::Close).await;
        }
        Ok(Response::new(UndressResponse {}))
    }

    type StreamGarmentsStream =
        Pin<Box<dyn Stream<Item = Result<StreamGarmentsResponse, Status>> + Send>>;

    async fn stream_garments(
        &self,
        r: Request<StreamGarmentsRequest>,
    ) -> Result<Response<Self::StreamGarmentsStream>, Status> {
        let id = &r.get_ref().session_id;
        permit(&r, id)?;
        let (tx, rx) = reader();
        self.command(id, Command::Read(tx)).await?;
        // Encoded behind the queue: position deltas refer to the last message that this reader received.
        let start = Some((rx, GarmentWriter::default()));
        let frames = futures::stream::unfold(start, |at| async move {
            let (mut rx, mut writer) = at?;
            let Message {
                update:
                    Update {
                        mut frame,
                        positions,
                    },
                keyframe,
            } = rx.recv().await?;
            if !positions.is_empty()
                && let Err(e) = writer.write(&mut frame, keyframe.as_deref(), &positions)
            {
                return Some((Err(Status::internal(e.to_string())), None));
            }
            Some((
                Ok(StreamGarmentsResponse { frame: Some(frame) }),
                Some((rx, writer)),
            ))
        });
        Ok(Response::new(Box::pin(frames)))
    }

    async fn start_simulation(
        &self,
        r: Request<StartSimulationRequest>,
    ) -> Result<Response<StartSimulationResponse>, Status> {
        let message = r.get_ref();
        let started = match &message.start {
            Some(Start::Session(start)) => {
                permit(&r, &start.session_id)?;
                fine_task::check(message, start)?;
                self.start_fine(start).await
            }
            Some(Start::SimulationId(id)) => {
                self.permit_simulation(&r, id)?;
                fine_task::check_solver(message)?;
                self.simulations.resume(id)
            }
            Some(Start::SceneJson(text)) => {
                Grant::of(&r)?.check_whole_store()?;
                self.simulations.start_scene(SceneTask::new(text, message)?)
            }
            None => Err(WireError::new("start_simulation_request.start", "is missing").into()),
        };
        started.map(Response::new)
    }

    type FollowSimulationStream = Frames;

    async fn follow_simulation(
        &self,
        r: Request<FollowSimulationRequest>,
    ) -> Result<Response<Self::FollowSimulationStream>, Status> {
        self.permit_simulation(&r, &r.get_ref().simulation_id)?;
        let r = r.get_ref();
        self.simulations
            .follow(&r.simulation_id, r.first_frame)
            .map(Response::new)
    }

    async fn cancel_simulation(
        &self,
        r: Request<CancelSimulationRequest>,
    ) -> Result<Response<CancelSimulationResponse>, Status> {
        let id = &r.get_ref().simulation_id;
        self.permit_simulation(&r, id)?;
        self.simulations.cancel(id).await.map(Response::new)
    }
}
