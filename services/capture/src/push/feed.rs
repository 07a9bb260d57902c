//! The rpc: frames of a sender to the newest place, answers back.

use super::description::Description;
use super::newest::{Answers, Newest};
use super::source::PushSource;
use crate::camera::Handle;
use crate::source::OpenSource;
use std::path::Path;
use std::sync::Arc;
use tokio::sync::mpsc;
use tonic::{Status, Streaming};
use tryon_formats::Rectified;
use tryon_proto::convert::WireError;
use tryon_proto::v1::publish_frames_request::Content;
use tryon_proto::v1::{
    CameraDescription, CameraFrame, FrameOutcome, PublishFramesRequest, PublishFramesResponse,
};

/// Source of a camera that a program feeds.
pub const PUSH: &str = "push";
/// Answers that wait for a sender to read them.
const MAX_ANSWERS: usize = 64;

/// True for the configured source of a camera that a program feeds.
pub(crate) fn is_push(source: &str) -> bool {
    source == PUSH
}

/// A sender's camera, ready to run.
pub(crate) struct Feed {
    pub(crate) source: OpenSource,
    /// Closed when the camera stops, or another sender comes.
    pub(crate) newest: Arc<Newest>,
    /// Shown for people.
    pub(crate) device: String,
}

/// Frames of one call.
pub(crate) struct Sender {
    description: Description,
    newest: Arc<Newest>,
    answers: Answers,
}

/// First message of a call.
///
/// # Errors
/// INVALID_ARGUMENT when it describes no camera.
pub(crate) async fn first(
    requests: &mut Streaming<PublishFramesRequest>,
) -> Result<CameraDescription, Status> {
    match requests.message().await?.and_then(|m| m.content) {
        Some(Content::Description(d)) => Ok(d),
        _ => Err(fault(
            "description",
            "the first message describes the camera",
        )),
    }
}

fn fault(part: &str, why: &str) -> Status {
    WireError::new(format!("publish_frames_request.{part}"), why).into()
}

/// A call whose camera is described.
pub(crate) struct Call {
    pub(crate) feed: Feed,
    pub(crate) sender: Sender,
    pub(crate) answers: mpsc::Receiver<Result<PublishFramesResponse, Status>>,
}

/// Both ends of a call, and its answers.
///
/// # Errors
/// Names the field of the description at fault.
pub(crate) fn open(described: &CameraDescription) -> Result<Call, WireError> {
    let description = Description::from_wire(described)?;
    let (answers, answered) = mpsc::channel(MAX_ANSWERS);
    let newest = Arc::new(Newest::new(answers.clone()));
    let name = Path::new(PUSH).join(&described.camera);
    let source = PushSource::new(name.clone(), description.clone(), newest.clone());
    let feed = Feed {
        source: Rectified::wrap(&name, Box::new(source)),
        newest: newest.clone(),
        device: description.device.clone(),
    };
    let sender = Sender {
        description,
        newest,
        answers,
    };
    Ok(Call {
        feed,
        sender,
        answers: answered,
    })
}

impl Sender {
    /// Passes frames on until the call ends, a message is at fault, or the camera stops.
    pub(crate) async fn run(self, mut requests: Streaming<PublishFramesRequest>, camera: Handle) {
        let end = tokio::select! {
            end = self.pass(&mut requests, &camera) => end,
            () = self.newest.closed() => Err(Status::aborted("the camera stopped, or another program feeds it")),
        };
        self.newest.close();
        if let Err(status) = end {
            let _ = self.answers.send(Err(status)).await;
        }
    }

    async fn pass(
        &self,
        requests: &mut Streaming<PublishFramesRequest>,
        camera: &Handle,
    ) -> Result<(), Status> {
        while let Some(message) = requests.message().await? {
            match message.content {
                Some(Content::Frame(frame)) => self.take(frame, camera)?,
                Some(Content::Description(_)) => {
                    return Err(fault("description", "a call describes its camera once"));
                }
                None => return Err(fault("content", "is required")),
            }
        }
        Ok(())
    }

    fn take(&self, frame: CameraFrame, camera: &Handle) -> Result<(), Status> {
        self.description.check(&frame)?;
        if camera.is_watched() {
            self.newest.put(frame);
        } else {
            let outcome = FrameOutcome::Unwatched;
            self.newest.answer(frame.number, outcome, String::new());
        }
        Ok(())
    }
}
