//! Subscription to the garments of a session of the cloth service, through losses and restarts.

use crate::engine::Placed;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;
use tokio_stream::StreamExt;
use tonic::{Code, Status};
use tonic_types::{ErrorDetails, FieldViolation, StatusExt};
use tryon_kit::auth::Connection;
use tryon_kit::client::{pauses, request};
use tryon_kit::queue::latest;
use tryon_proto::convert::frame::stages_from_wire;
use tryon_proto::convert::garment::GarmentReader;
use tryon_proto::convert::geometry::rigid_from_wire;
use tryon_proto::convert::required;
use tryon_proto::v1::cloth_service_client::ClothServiceClient;
use tryon_proto::v1::{
    ClothStatus, DressRequest, GarmentChoice, GarmentFit, GarmentFrame, KnownSizes,
    StreamGarmentsRequest,
};

/// Largest garment message, bytes. Outfits of the library take a few hundred kB.
pub(crate) const MAX_GARMENT_BYTES: usize = 16 * 1024 * 1024;

/// Longest pause between attempts: cloth is to be followed as soon as it answers again.
const LONGEST_PAUSE: Duration = Duration::from_millis(200);

/// Outfit that the user chose; `revision` as this service counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Wanted {
    pub(crate) revision: u64,
    pub(crate) choices: Vec<GarmentChoice>,
    /// Sizes that cloth chose for them, remembered for a cloth service that has lost them.
    pub(crate) sizes: Option<KnownSizes>,
}

impl Wanted {
    /// Forgets the sizes; false, as nothing new is wanted.
    pub(crate) fn forget(&mut self) -> bool {
        self.sizes = None;
        false
    }

    /// Remembers the sizes of `fits`, of garments of this outfit on `subject`, unless they may still change.
    pub(crate) fn remember(&mut self, subject: u64, fits: &[GarmentFit]) {
        let of = |c: &GarmentChoice| {
            let fit = fits.iter().find(|f| f.garment == c.garment)?;
            (!fit.provisional).then(|| fit.size.clone())
        };
        let sizes: Option<Vec<String>> = self.choices.iter().map(of).collect();
        let known = sizes
            .filter(|_| subject != 0)
            .map(|sizes| KnownSizes { subject, sizes });
        let own = self.sizes.take().filter(|k| k.subject == subject);
        self.sizes = known.or(own);
    }
}

/// Message of the subscription.
pub(crate) enum News {
    /// Garments for an exposure; `frame` without its bulk.
    Placed(Box<GarmentFrame>, Arc<Placed>),
    /// No garments, with the reason.
    Status(Box<GarmentFrame>),
    /// Cloth does not answer.
    Gone(String),
}

pub(crate) fn client(channel: Connection) -> ClothServiceClient<Connection> {
    ClothServiceClient::new(channel).max_decoding_message_size(MAX_GARMENT_BYTES)
}

/// Requests an outfit from cloth; cloth's own revision of it.
pub(crate) async fn dress(
    client: &mut ClothServiceClient<Connection>,
    session: &str,
    choices: &[GarmentChoice],
    known_sizes: Option<KnownSizes>,
) -> Result<u64, Status> {
    let message = DressRequest {
        session_id: session.into(),
        garments: choices.to_vec(),
        known_sizes,
    };
    Ok(client
        .dress(request(message))
        .await?
        .into_inner()
        .outfit_revision)
}

/// Requests the wanted outfit, without its sizes where cloth no longer offers them.
async fn dress_as_wanted(
    client: &mut ClothServiceClient<Connection>,
    session: &str,
    wanted: &Wanted,
) -> Result<u64, Status> {
    let dressed = dress(client, session, &wanted.choices, wanted.sizes.clone()).await;
    match dressed {
        Err(s) if s.code() == Code::InvalidArgument && wanted.sizes.is_some() => {
            dress(client, session, &wanted.choices, None).await
        }
        dressed => dressed,
    }
}

/// Fault of a request to cloth, with the field path of the request that caused it.
pub(crate) fn renamed(s: &Status, message: &str) -> Status {
    let details = s.get_error_details();
    let Some(bad) = details.bad_request() else {
        return s.clone();
    };
    let rename = |text: &str| text.replacen("dress_request", message, 1);
    let violations: Vec<FieldViolation> = bad
        .field_violations
        .iter()
        .map(|v| FieldViolation::new(rename(&v.field), v.description.clone()))
        .collect();
    Status::with_error_details(
        s.code(),
        rename(s.message()),
        ErrorDetails::with_bad_request(violations),
    )
}

/// Follows the garments of `session` until the receiver of `news` is gone, and dresses it as wanted.
pub(crate) async fn follow(
    channel: Connection,
    session: String,
    mut wanted: watch::Receiver<Wanted>,
    news: latest::Sender<News>,
) {
    let mut client = client(channel);
    let soon = || pauses().map(|p| p.min(LONGEST_PAUSE));
    let mut wait = soon();
    while !news.is_closed() {
        let mut any = false;
        let why = match one_stream(&mut client, &session, &mut wanted, &news, &mut any).await {
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
    client: &mut ClothServiceClient<Connection>,
    session: &str,
    wanted: &mut watch::Receiver<Wanted>,
    news: &latest::Sender<News>,
    any: &mut bool,
) -> Result<(), String> {
    let text = |s: Status| s.message().to_owned();
    // Pairs of cloth's revision, which restarts with cloth, and ours.
    let mut ours: Vec<(u64, u64)> = Vec::new();
    let w = wanted.borrow_and_update().clone();
    ours.push((
        dress_as_wanted(client, session, &w).await.map_err(text)?,
        w.revision,
    ));
    let call = client
        .stream_garments(StreamGarmentsRequest {
            session_id: session.into(),
        })
        .await;
    let mut frames = call.map_err(text)?.into_inner();
    let mut reader = GarmentReader::default();
    loop {
        let message = tokio::select! {
            m = frames.next() => m,
            changed = wanted.changed() => {
                if changed.is_err() {
                    return Ok(());
                }
                let w = wanted.borrow_and_update().clone();
                let theirs = dress_as_wanted(client, session, &w).await.map_err(text)?;
                ours.retain(|(t, _)| *t != theirs);
                ours.push((theirs, w.revision));
                continue;
            }
        };
        let Some(message) = message else {
            return Ok(());
        };
        let frame = required(
            message.map_err(text)?.frame,
            "stream_garments_response.frame",
        );
        let frame = frame.map_err(|e| e.to_string())?;
        *any = true;
        let revision = ours
            .iter()
            .find(|(t, _)| *t == frame.outfit_revision)
            .map_or(0, |(_, o)| *o);
        if !news.send(read(&mut reader, frame, revision).map_err(|e| e.to_string())?) {
            return Ok(());
        }
    }
}

fn read(
    reader: &mut GarmentReader,
    mut frame: GarmentFrame,
    revision: u64,
) -> Result<News, tryon_proto::convert::WireError> {
    let garments = reader.read(&frame)?;
    frame.garments.clear();
    if frame.status() != ClothStatus::Live || frame.frame.is_none() {
        return Ok(News::Status(Box::new(frame)));
    }
    let world = required(
        frame.world_from_camera.as_ref(),
        "garment_frame.world_from_camera",
    )?;
    let placed = Placed {
        garments,
        world_from_camera: rigid_from_wire(world, "garment_frame.world_from_camera")?,
        stages: stages_from_wire(&frame.stages, "garment_frame.stages")?,
        revision,
        detail: frame.cloth_detail(),
    };
    Ok(News::Placed(Box::new(frame), Arc::new(placed)))
}
