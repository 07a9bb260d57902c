//! Subscription to the body states of a tracking session, through losses and restarts; for cloth and compositor.

use crate::auth::Connection;
use crate::client::{pauses, request};
use crate::compute::Pool;
use crate::consent::Keys;
use crate::frames::CameraKey;
use crate::queue::latest;
use crate::remembered_body::RememberedBody;
use std::hash::{DefaultHasher, Hasher};
use std::sync::Arc;
use std::time::Duration;
use tokio_stream::StreamExt;
use tonic::Code;
use tryon_body::{BodyShape, Template};
use tryon_proto::Message;
use tryon_proto::convert::{body, required};
use tryon_proto::v1::tracking_service_client::TrackingServiceClient;
use tryon_proto::v1::{
    BodyState, BodyTemplate, GetBodyTemplateRequest, OpenSessionRequest, StreamBodyStatesRequest,
};

/// Largest template message, bytes: one of 13,000 vertices with ten shape directions takes 2 MB.
const MAX_TEMPLATE_BYTES: usize = 16 * 1024 * 1024;

/// Longest pause between attempts: tracking is to be followed as soon as it answers again.
const LONGEST_PAUSE: Duration = Duration::from_millis(200);

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
    /// Body that the opener remembers, handed over with each opening.
    pub known: RememberedBody,
}

/// Session of the subscription.
struct FollowedSession {
    id: String,
    /// Given by those who open the session, before each stream.
    opening: Option<Opening>,
    /// The last template and the digest of its message.
    template: Option<(u64, Arc<Template>)>,
}

/// Digest of a template's message, to tell the same one from another.
fn digest(wire: &BodyTemplate) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(&wire.encode_to_vec());
    hasher.finish()
}

impl FollowedSession {
    /// Opens the session if it has a camera.
    async fn open(
        &mut self,
        client: &mut TrackingServiceClient<Connection>,
    ) -> Result<(), tonic::Status> {
        let Some(Opening {
            camera,
            keys,
            known,
        }) = &mut self.opening
        else {
            return Ok(());
        };
        let message = OpenSessionRequest {
            session_id: self.id.clone(),
            store: camera.store().into(),
            camera: camera.camera().into(),
            frame_key: keys.borrow_and_update().clone(),
            known_body: known.message(),
        };
        let has_body = message.known_body.is_some();
        let opened = client.open_session(request(message)).await;
        let is_refused =
            |s: &tonic::Status| matches!(s.code(), Code::InvalidArgument | Code::OutOfRange);
        if has_body && opened.as_ref().is_err_and(is_refused) {
            // Another template, or another release of tracking: the next try goes without it.
            known.forget();
        }
        opened.map(drop)
    }

    /// Template of tracking; after a restart it is mostly the last one, which is not unpacked again.
    async fn template(
        &mut self,
        client: &mut TrackingServiceClient<Connection>,
        pool: &Pool,
    ) -> Result<Arc<Template>, String> {
        let answer = client.get_body_template(request(GetBodyTemplateRequest::default()));
        let answer = answer.await.map_err(|s| s.message().to_owned())?;
        let wire = required(
            answer.into_inner().template,
            "get_body_template_response.template",
        );
        let wire = wire.map_err(|e| e.to_string())?;
        let last = self.template.take();
        let unpack = move || {
            let digest = digest(&wire);
            if let Some(same) = last.filter(|(last, _)| *last == digest) {
                return Ok(same);
            }
            body::template_from_wire(&wire).map(|t| (digest, Arc::new(t)))
        };
        let unpacked = pool.run(unpack).await.map_err(|e| e.to_string())?;
        let (digest, template) = unpacked.map_err(|e| e.to_string())?;
        self.template = Some((digest, template.clone()));
        Ok(template)
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
        template: None,
    };
    let soon = || pauses().map(|p| p.min(LONGEST_PAUSE));
    let mut wait = soon();
    while !news.is_closed() {
        let mut any = false;
        let why = match one_stream(&mut client, &mut session, &pool, &news, &mut any).await {
            Ok(()) => "the session was closed".into(),
            Err(why) => why,
        };
        if any {
            wait = soon();
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
    let call = client
        .stream_body_states(StreamBodyStatesRequest {
            session_id: session.id.clone(),
        })
        .await;
    let mut states = call.map_err(said)?.into_inner();
    // After the stream, which fails at once for a session that is not open yet.
    let template = session.template(client, pool).await?;
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
