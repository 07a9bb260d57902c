//! A client of the compositor: what a kiosk does, without a screen.

use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::time::{Duration, Instant};
use tryon::formats::image::{decode_jpeg, write_png_rgb};
use tryon_kit::client::{channel, request};
use tryon_kit::telemetry;
use tryon_proto::v1;
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;

/// Seconds between the pictures that are kept.
const KEEP_EVERY: f64 = 0.5;
/// Silence after which the compositor counts as gone; it promises two messages a second.
const SILENCE: Duration = Duration::from_secs(5);
/// A picture at 1080p with quality 80 takes 400 kB.
const MAX_PICTURE_BYTES: usize = 16 << 20;

/// One picture that arrived.
#[derive(Debug)]
pub(crate) struct Seen {
    /// Seconds since the try-on was opened.
    pub(crate) at: f64,
    /// Number of the exposure.
    pub(crate) sequence: u64,
    /// The garments are on the person of this very exposure.
    pub(crate) live: bool,
    /// Milliseconds from capture to encoded picture.
    pub(crate) latency_ms: f64,
    /// Milliseconds by stage.
    pub(crate) stages: Vec<(String, f64)>,
}

/// What came in while watching.
#[derive(Debug, Default)]
pub(crate) struct Received {
    /// Pictures in order.
    pub(crate) pictures: Vec<Seen>,
    /// Messages by state.
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
    address: SocketAddr,
    garments: &[String],
    time: Duration,
    out: &Path,
) -> Result<Received> {
    let channel = channel(&format!("http://{address}")).map_err(anyhow::Error::msg)?;
    let mut client =
        CompositorServiceClient::new(channel).max_decoding_message_size(MAX_PICTURE_BYTES);
    let choices = garments
        .iter()
        .map(|g| v1::GarmentChoice {
            garment: g.clone(),
            ..Default::default()
        })
        .collect();
    let open = v1::OpenTryOnRequest {
        garments: choices,
        ..Default::default()
    };
    let id = client
        .open_try_on(request(open))
        .await
        .context("opening a try-on")?
        .into_inner()
        .try_on_id;
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
            v1::stream_frames_response::Event::Status(s) => {
                *received
                    .states
                    .entry(s.state().as_str_name().to_owned())
                    .or_default() += 1;
            }
            v1::stream_frames_response::Event::Picture(p) => {
                *received
                    .states
                    .entry(p.state().as_str_name().to_owned())
                    .or_default() += 1;
                let live = p.state() == v1::TryOnState::Live && p.outfit_revision > 0;
                if at >= next_kept {
                    next_kept = at + KEEP_EVERY;
                    let picture = decode_jpeg(&p.image)?;
                    write_png_rgb(
                        &out.join(format!("frame_{:04}.png", received.kept)),
                        &picture,
                    )?;
                    received.kept += 1;
                }
                received.pictures.push(Seen {
                    at,
                    sequence: p.frame.as_ref().map_or(0, |f| f.sequence),
                    live,
                    latency_ms: f64::from(p.latency_ms),
                    stages: p
                        .stages
                        .iter()
                        .map(|s| (s.stage.clone(), f64::from(s.ms)))
                        .collect(),
                });
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

/// Counters and gauges of this process: the lines of the metrics page that are no histogram.
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
