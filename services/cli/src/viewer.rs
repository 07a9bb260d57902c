//! A viewer without a screen: a client of the compositor that counts pictures and keeps some of them.

use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};
use tryon::formats::image::{decode_jpeg, write_png_rgb};
use tryon_kit::auth::Connection;
use tryon_kit::client::request;
use tryon_kit::telemetry;
use tryon_proto::v1;
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;
use tryon_proto::v1::stream_frames_response::Event;

/// Time between the pictures that are kept (s).
const KEEP_EVERY: f64 = 0.5;
/// Silence after which the compositor counts as gone; it sends at least two messages a second.
const SILENCE: Duration = Duration::from_secs(5);
/// Largest picture, bytes: one of 1080p with quality 80 takes 400 kB.
const MAX_PICTURE_BYTES: usize = 16 << 20;

/// One picture that arrived.
#[derive(Debug)]
pub(crate) struct ReceivedPicture {
    /// Time since the try-on was opened (s).
    pub(crate) at: f64,
    /// Number of the exposure.
    pub(crate) sequence: u64,
    /// The garments were computed for this exposure.
    pub(crate) live: bool,
    /// Milliseconds from capture to encoded picture.
    pub(crate) latency_ms: f64,
    /// Milliseconds by stage.
    pub(crate) stages: Vec<(String, f64)>,
}

/// Messages of one try-on.
#[derive(Debug, Default)]
pub(crate) struct Received {
    /// Pictures in order.
    pub(crate) pictures: Vec<ReceivedPicture>,
    /// Number of messages by state.
    pub(crate) states: BTreeMap<String, usize>,
    /// Counters of all services in this process.
    pub(crate) counters: BTreeMap<String, f64>,
    /// Pictures written.
    pub(crate) kept: usize,
}

/// Opens a try-on, watches it for `time`, keeps a picture now and then in `out`, closes it.
///
/// # Errors
/// When the compositor refuses or falls silent, or a picture cannot be read or written.
pub(crate) async fn watch(
    compositor: Connection,
    garments: &[String],
    time: Duration,
    out: &Path,
) -> Result<Received> {
    let mut client =
        CompositorServiceClient::new(compositor).max_decoding_message_size(MAX_PICTURE_BYTES);
    let opened = client.open_try_on(request(open_request(garments))).await;
    let id = opened.context("opening a try-on")?.into_inner().try_on_id;
    let stream = v1::StreamFramesRequest {
        try_on_id: id.clone(),
        ..Default::default()
    };
    let mut stream = client
        .stream_frames(stream)
        .await
        .context("streaming pictures")?
        .into_inner();

    let started = Instant::now();
    let mut received = Received::default();
    let mut next_kept = 0.0;
    while started.elapsed() < time {
        let message = tokio::time::timeout(SILENCE, stream.message())
            .await
            .context("the compositor fell silent")??;
        let Some(event) = message.and_then(|m| m.event) else {
            break;
        };
        let at = started.elapsed().as_secs_f64();
        match event {
            Event::Status(s) => received.count(s.state()),
            Event::Picture(p) => {
                received.count(p.state());
                if at >= next_kept {
                    next_kept = at + KEEP_EVERY;
                    received.keep(&p, out)?;
                }
                received.pictures.push(picture(&p, at));
            }
        }
    }

    drop(stream);
    client
        .close_try_on(request(v1::CloseTryOnRequest { try_on_id: id }))
        .await
        .context("closing the try-on")?;
    received.counters = counters();
    Ok(received)
}

fn open_request(garments: &[String]) -> v1::OpenTryOnRequest {
    let choice = |g: &String| v1::GarmentChoice {
        garment: g.clone(),
        ..Default::default()
    };
    v1::OpenTryOnRequest {
        garments: garments.iter().map(choice).collect(),
        // The command shows a subject of its caller's choice, synthetic or recorded: consent is given.
        consent: Some(v1::Consent { given: true }),
        ..Default::default()
    }
}

fn picture(p: &v1::Picture, at: f64) -> ReceivedPicture {
    let stage = |s: &v1::StageTime| (s.stage.clone(), f64::from(s.ms));
    ReceivedPicture {
        at,
        sequence: p.frame.as_ref().map_or(0, |f| f.sequence),
        live: p.state() == v1::TryOnState::Live && p.outfit_revision > 0,
        latency_ms: f64::from(p.latency_ms),
        stages: p.stages.iter().map(stage).collect(),
    }
}

impl Received {
    fn count(&mut self, state: v1::TryOnState) {
        let name = state.as_str_name().to_owned();
        *self.states.entry(name).or_default() += 1;
    }

    fn keep(&mut self, p: &v1::Picture, out: &Path) -> Result<()> {
        let picture = decode_jpeg(&p.image)?;
        let path = out.join(format!("frame_{:04}.png", self.kept));
        write_png_rgb(&path, &picture)?;
        self.kept += 1;
        Ok(())
    }
}

/// Counters and gauges of this process: the lines of the metrics page that belong to no histogram.
fn counters() -> BTreeMap<String, f64> {
    let Some(handle) = telemetry::metrics() else {
        return BTreeMap::new();
    };
    handle
        .render()
        .lines()
        .filter(|l| !l.starts_with('#') && !l.contains("_ms_"))
        .filter_map(|l| l.rsplit_once(' '))
        .filter_map(|(name, value)| Some((name.to_owned(), value.parse().ok()?)))
        .collect()
}
