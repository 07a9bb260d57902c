//! Remote procedures of the tracking service: check the request, find the session, answer.

use crate::engine::PreparedModel;
use crate::session::{self, Command, Handle, Setup};
use futures::Stream;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio_stream::StreamExt;
use tokio_stream::wrappers::WatchStream;
use tonic::{Code, Request, Response, Status};
use tryon_body::Template;
use tryon_kit::auth::Grant;
use tryon_kit::config::TrackingConfig;
use tryon_kit::server::Context;
use tryon_kit::sessions::{Opened, Sessions, brief, random_id};
use tryon_kit::status::{exhausted, not_found, unavailable};
use tryon_landmarks::Landmarker;
use tryon_proto::convert::{body, request};
use tryon_proto::v1::tracking_service_server::TrackingService;
use tryon_proto::v1::*;
use tryon_tracking::KnownBody;

/// Directory of sessions and the dependencies of new ones.
pub(crate) struct Tracking {
    sessions: Sessions<Handle>,
    ctx: Context,
    template: Arc<Template>,
    model: PreparedModel,
    wire_template: BodyTemplate,
    idle: Duration,
}

impl Tracking {
    pub(crate) fn new(
        config: &TrackingConfig,
        ctx: &Context,
        template: Arc<Template>,
        landmarker: Option<Landmarker>,
    ) -> Self {
        Self {
            sessions: Sessions::new(config.max_sessions),
            ctx: ctx.clone(),
            wire_template: body::template_to_wire(&template),
            model: PreparedModel::new(template.clone(), landmarker),
            template,
            idle: Duration::from_secs(config.idle_s),
        }
    }
    /// Makes the tracker's model on the compute pool; the first frame waits for it.
    pub(crate) fn prepare(&self) {
        let (model, pool) = (self.model.clone(), self.ctx.pool.clone());
        let make = move || {
            model.make();
        };
        tokio::spawn(async move { pool.run(make).await });
    }

    /// The body that the caller remembers.
    async fn known_body(&self, r: &OpenSessionRequest) -> Result<Option<Arc<KnownBody>>, Status> {
        let Some(wire) = r.known_body.clone() else {
            return Ok(None);
        };
        let template = self.template.clone();
        let read = move || body::known_body_from_wire(&wire, &template, "open_session_request");
        let read = self.ctx.pool.run(read).await;
        let known = read.map_err(|e| unavailable("tracking", &e.to_string()))?;
        Ok(Some(Arc::new(known?)))
    }

    /// Session of that id, if the request's token reaches it.
    fn find<T>(&self, r: &Request<T>, id: &str) -> Result<Arc<Handle>, Status> {
        let grant = Grant::of(r)?;
        grant.check_session(id)?;
        let found = self.sessions.get(id);
        let handle = found.ok_or_else(|| not_found("session", id))?;
        grant.check_camera(&handle.key)?;
        Ok(handle)
    }
}

#[tonic::async_trait]
impl TrackingService for Tracking {
    async fn open_session(
        &self,
        r: Request<OpenSessionRequest>,
    ) -> Result<Response<OpenSessionResponse>, Status> {
        let grant = Grant::of(&r)?;
        let r = r.get_ref();
        let id = if r.session_id.is_empty() {
            random_id()
        } else {
            request::session_id("open_session_request.session_id", &r.session_id)?
        };
        grant.check_session(&id)?;
        let key = request::camera_key("open_session_request", &r.store, &r.camera)?;
        grant.check_camera(&key)?;
        let known = self.known_body(r).await?;
        if let Some(frame_key) = &r.frame_key {
            self.ctx.bus.learn(&key, frame_key);
        }
        let setup = || Setup {
            id: id.clone(),
            key: key.clone(),
            ctx: self.ctx.clone(),
            model: self.model.clone(),
            idle: self.idle,
            known: known.clone(),
            directory: self.sessions.clone(),
        };
        if self
            .sessions
            .get(&id)
            .is_some_and(|h| h.commands.is_closed())
        {
            self.sessions.remove(&id);
        }
        let created = match self.sessions.open(&id, || session::spawn(setup())) {
            Opened::Created(_) => {
                tracing::info!(session = brief(&id), camera = %key, "opened");
                metrics::gauge!("tryon_tracking_sessions").set(self.sessions.len() as f64);
                true
            }
            Opened::Found(h) if h.key != key => {
                return Err(Status::failed_precondition(format!(
                    "session `{id}` is open with camera {}",
                    h.key
                )));
            }
            Opened::Found(h) => {
                let _ = h.commands.try_send(Command::Touch);
                if let Some(known) = known {
                    // A session that cannot keep up measures anew.
                    let _ = h.commands.try_send(Command::Know(known));
                }
                false
            }
            Opened::Full => return Err(exhausted("sessions", self.sessions.limit())),
        };
        Ok(Response::new(OpenSessionResponse {
            session_id: id,
            created,
            template_name: self.template.name().into(),
        }))
    }

    async fn close_session(
        &self,
        r: Request<CloseSessionRequest>,
    ) -> Result<Response<CloseSessionResponse>, Status> {
        let id = &r.get_ref().session_id;
        match self.find(&r, id) {
            Ok(h) => {
                self.sessions.remove_if(id, |open| std::ptr::eq(open, &*h));
                h.closing.cancel();
            }
            // An unknown id is no error.
            Err(s) if s.code() == Code::NotFound => {}
            Err(s) => return Err(s),
        }
        Ok(Response::new(CloseSessionResponse {}))
    }

    async fn reset_session(
        &self,
        r: Request<ResetSessionRequest>,
    ) -> Result<Response<ResetSessionResponse>, Status> {
        let id = &r.get_ref().session_id;
        self.find(&r, id)?
            .commands
            .send(Command::Reset)
            .await
            .map_err(|_| not_found("session", id))?;
        Ok(Response::new(ResetSessionResponse {}))
    }

    async fn get_body_template(
        &self,
        r: Request<GetBodyTemplateRequest>,
    ) -> Result<Response<GetBodyTemplateResponse>, Status> {
        let name = &r.get_ref().template_name;
        if !name.is_empty() && name != self.template.name() {
            return Err(not_found("template", name));
        }
        Ok(Response::new(GetBodyTemplateResponse {
            template: Some(self.wire_template.clone()),
        }))
    }

    type StreamBodyStatesStream =
        Pin<Box<dyn Stream<Item = Result<StreamBodyStatesResponse, Status>> + Send>>;

    async fn stream_body_states(
        &self,
        r: Request<StreamBodyStatesRequest>,
    ) -> Result<Response<Self::StreamBodyStatesStream>, Status> {
        let handle = self.find(&r, &r.get_ref().session_id)?;
        let mut sent = 0;
        // The stream ends when the session's task, which holds the sender, ends.
        let states = WatchStream::new(handle.states.clone()).map(move |state| {
            let mut state = BodyState::clone(&state);
            if state.shape_version == sent {
                state.shape = None;
            } else if state.shape.is_some() {
                sent = state.shape_version;
            }
            Ok(StreamBodyStatesResponse { state: Some(state) })
        });
        Ok(Response::new(Box::pin(states)))
    }
}
