//! Subscription to the body states of a tracking session, through losses and restarts; for cloth and compositor.

use crate::auth::Connection;
use crate::client::{pauses, request};
use crate::compute::Pool;
use crate::consent::Keys;
use crate::frames::CameraKey;
use crate::queue::latest;
use std::sync::Arc;
use tokio_stream::StreamExt;
use tryon::body::{BodyShape, Template};
use tryon_proto::convert::{body, required};
use tryon_proto::v1::tracking_service_client::TrackingServiceClient;
use tryon_proto::v1::{
    BodyState, GetBodyTemplateRequest, OpenSessionRequest, StreamBodyStatesRequest,
};

/// Largest template message, bytes: one of 13,000 vertices with ten shape directions takes 2 MB.
const MAX_TEMPLATE_BYTES: usize = 16 * 1024 * 1024;

/// Message of the subscription.
pub enum News {
    /// A state and its shape, if there is one.
    Body {
        /// State without its shape.
        state: Box<BodyState>,
        /// Shape of `state.shape_version`.
        shape: Option<Arc<BodyShape>>,
        /// Template that state and shape refer to.
        template: Arc<Template>,
    },
    /// Tracking does not answer, or does not know the session.
    Gone(String),
}

/// Camera to open a session with.
pub struct Opening {
    /// Bus keys of the camera.
    pub camera: CameraKey,
    /// Key of its frames, handed over whenever it changes.
    pub keys: Keys,
}

/// Session of the subscription.
struct FollowedSession {
    id: String,
    /// Given by those who open the session, before each stream.
    opening: Option<Opening>,
}

impl FollowedSession {
    /// Opens the session if it has a camera.
    async fn open(
        &mut self,
        client: &mut TrackingServiceClient<Connection>,
    ) -> Result<(), tonic::Status> {
        if let Some(Opening { camera, keys }) = &mut self.opening {
            let message = OpenSessionRequest {
                session_id: self.id.clone(),
                store: camera.store().into(),
                camera: camera.camera().into(),
                frame_key: keys.borrow_and_update().clone(),
            };
            client.open_session(request(message)).await?;
        }
        Ok(())
    }

    /// Waits for a key that the session was not opened with.
    async fn key_changed(&mut self) {
        if let Some(Opening { keys, .. }) = &mut self.opening
            && keys.changed().await.is_ok()
        {
            return;
        }
        std::future::pending().await
    }
}

/// Follows `session` until the receiver of `news` is gone. With `opening`, each stream opens the session first.
///
/// The newest state wins. Shapes are never lost: they are joined to states before the queue drops any.
pub async fn follow(
    channel: Connection,
    session: String,
    opening: Option<Opening>,
    pool: Arc<Pool>,
    news: latest::Sender<News>,
) {
    let mut client =
        TrackingServiceClient::new(channel).max_decoding_message_size(MAX_TEMPLATE_BYTES);
    let mut session = FollowedSession {
        id: session,
        opening,
    };
    let mut wait = pauses();
    while !news.is_closed() {
        let mut any = false;
        let why = match one_stream(&mut client, &mut session, &pool, &news, &mut any).await {
            Ok(()) => "the session was closed".into(),
            Err(why) => why,
        };
        if any {
            wait = pauses();
        }
        news.send(News::Gone(why));
        if let Some(pause) = wait.next() {
            tokio::time::sleep(pause).await;
        }
    }
}

async fn one_stream(
    client: &mut TrackingServiceClient<Connection>,
    session: &mut FollowedSession,
    pool: &Pool,
    news: &latest::Sender<News>,
    any: &mut bool,
) -> Result<(), String> {
    let said = |s: tonic::Status| s.message().to_owned();
    session.open(client).await.map_err(said)?;
    let template = client
        .get_body_template(request(GetBodyTemplateRequest::default()))
        .await;
    let template = template.map_err(said)?.into_inner().template;
    let unpack = move || {
        let wire = required(template, "get_body_template_response.template")?;
        body::template_from_wire(&wire)
    };
    let template = pool
        .run(unpack)
        .await
        .map_err(|e| e.to_string())?
        .map_err(|e| e.to_string())?;
    let template = Arc::new(template);
    let call = client
        .stream_body_states(StreamBodyStatesRequest {
            session_id: session.id.clone(),
        })
        .await;
    let mut states = call.map_err(said)?.into_inner();
    let (mut shape, mut version) = (None, 0);
    loop {
        let message = tokio::select! {
            message = states.next() => message,
            () = session.key_changed() => {
                session.open(client).await.map_err(said)?;
                continue;
            }
        };
        let Some(message) = message else {
            return Ok(());
        };
        let state = required(
            message.map_err(said)?.state,
            "stream_body_states_response.state",
        );
        let mut state = state.map_err(|e| e.to_string())?;
        if state.shape_version == 0 {
            // Tracking has forgotten the body.
            shape = None;
        }
        if let Some(s) = state.shape.take() {
            shape = Some(Arc::new(
                body::shape_from_wire(&s, &template).map_err(|e| e.to_string())?,
            ));
            version = state.shape_version;
        }
        *any = true;
        let shape = shape.clone().filter(|_| version == state.shape_version);
        if !news.send(News::Body {
            state: Box::new(state),
            shape,
            template: template.clone(),
        }) {
            return Ok(());
        }
    }
}
