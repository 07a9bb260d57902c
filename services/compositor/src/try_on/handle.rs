//! Access to a try-on's task and the dependencies of that task.

use crate::card::Card;
use crate::encoding::Encoding;
use crate::join_buffer::JoinBuffer;
use crate::photos::Photos;
use crate::upstream::Wanted;
use crate::viewer::Viewer;
use std::sync::Arc;
use tokio::sync::{Semaphore, mpsc, oneshot, watch};
use tokio_util::sync::CancellationToken;
use tonic::Status;
use tryon_kit::config::CompositorConfig;
use tryon_kit::consent::Cameras;
use tryon_kit::frames::CameraKey;
use tryon_kit::server::Context;
use tryon_kit::sessions::Sessions;
use tryon_proto::v1::{GarmentChoice, Picture, TryOnEnd};

/// Access to a try-on from the rpcs.
pub(crate) struct Handle {
    pub(crate) key: CameraKey,
    pub(crate) commands: mpsc::Sender<Command>,
    pub(crate) wanted: watch::Sender<Wanted>,
    /// The place of the fine picture in work.
    pub(crate) fine: Arc<Semaphore>,
    /// Cancelled once the try-on has ended and everything behind it was told.
    pub(crate) over: CancellationToken,
}

/// Receiver of a snapshot.
pub(crate) type Answer = oneshot::Sender<Result<Picture, Status>>;

/// Command to a try-on.
pub(crate) enum Command {
    /// Adds a viewer, unless there are too many or too many formats.
    View(Viewer, oneshot::Sender<Result<(), Status>>),
    /// Acknowledges a picture of that stream and number.
    Acknowledge(u64, u64),
    /// Draws the newest picture once.
    Snapshot(Encoding, Answer),
    /// Hands out the newest exposures and bodies.
    Recent(oneshot::Sender<JoinBuffer>),
    /// Keeps the try-on open.
    Touch,
    /// Draws garments in the colours of their fit, or in their own.
    ShowFit(bool),
    /// Ends the try-on for that reason.
    Close(TryOnEnd),
}

/// Dependencies of a try-on's task.
pub(crate) struct Setup {
    pub(crate) id: String,
    pub(crate) key: CameraKey,
    pub(crate) choices: Vec<GarmentChoice>,
    pub(crate) ctx: Context,
    pub(crate) config: CompositorConfig,
    pub(crate) card: Card,
    pub(crate) cameras: Cameras,
    pub(crate) photos: Photos,
    pub(crate) directory: Sessions<Handle>,
}
