//! Latency that a pushed frame adds to one of a source in the box: from before it is encoded for the wire until it is a frame
//! of the reader, which stamps it then as it stamps every source's.
//!
//! `cargo bench -p tryon-capture-service --bench push`

#![allow(clippy::print_stdout)] // the table

use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tryon_kit::auth::Auth;
use tryon_kit::compute::Pool;
use tryon_kit::config::Config;
use tryon_kit::flow::Stalls;
use tryon_kit::frames::{CameraKey, FrameBus, LocalBus};
use tryon_kit::server::{Context, Running};
use tryon_kit::tls::Tls;
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::publish_frames_request::Content;
use tryon_proto::v1::*;

const SIZE: [u32; 2] = [640, 480];
const FRAMES: u64 = 200;
const PERIOD: Duration = Duration::from_millis(33);

type Fault = Box<dyn Error>;

fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |d| d.as_nanos() as u64)
}

async fn service() -> Result<(Running, Arc<LocalBus>, CancellationToken), Fault> {
    let set = [
        "capture.address=127.0.0.1:0".to_owned(),
        "capture.admin=127.0.0.1:0".to_owned(),
        "capture.cameras=[{name=\"front\",source=\"push\"}]".to_owned(),
    ];
    let config = Config::load(None, &set)?;
    let (pool, shutdown) = (Pool::new(2)?, CancellationToken::new());
    let bus = LocalBus::new(pool.clone());
    let context = Context {
        stalls: Stalls::default(),
        bus: bus.clone(),
        pool,
        shutdown: shutdown.clone(),
        grace: Duration::ZERO,
        auth: Auth::open(&config, None)?,
        tls: Tls::open(&config.tls)?,
        inside: Tls::inside(&config, None)?,
    };
    let running = tryon_capture_service::start(&config, context).await?;
    Ok((running, bus, shutdown))
}

fn described(distortion: &[f64]) -> CameraDescription {
    let [width, height] = SIZE;
    let lens = Lens {
        intrinsics: Some(Intrinsics {
            width,
            height,
            fx: 600.0,
            fy: 600.0,
            cx: 319.5,
            cy: 239.5,
        }),
        distortion: distortion.to_vec(),
    };
    CameraDescription {
        camera: "front".into(),
        depth: Some(lens.clone()),
        color: Some(lens),
        depth_unit: 1e-3,
        ..Default::default()
    }
}

fn frame(number: u64) -> CameraFrame {
    let pixels = SIZE[0] * SIZE[1];
    let depth = (0..pixels).flat_map(|i| (1000 + (i % 640) as u16).to_le_bytes());
    CameraFrame {
        number,
        depth: depth.collect::<Vec<u8>>().into(),
        color: vec![127; 3 * pixels as usize].into(),
        color_encoding: ColorEncoding::Rgb8.into(),
        ..CameraFrame::default()
    }
}

/// Latencies of frames at their pace, ms, sorted.
async fn latencies(
    client: &mut CaptureServiceClient<tonic::transport::Channel>,
    bus: &LocalBus,
    distortion: &[f64],
) -> Result<Vec<f64>, Fault> {
    let key = CameraKey::new("store", "front").ok_or("a key")?;
    let mut frames = bus.subscribe(&key).await?;
    let (requests, stream) = mpsc::channel(8);
    let content = Some(Content::Description(described(distortion)));
    requests.send(PublishFramesRequest { content }).await?;
    let mut answers = client
        .publish_frames(ReceiverStream::new(stream))
        .await?
        .into_inner();
    let mut all = Vec::new();
    for number in 1..=FRAMES {
        client
            .hold_consent(HoldConsentRequest {
                camera: "front".into(),
                try_on_id: "somebody".into(),
                seconds: 5.0,
                ..Default::default()
            })
            .await?;
        let mut frame = frame(number);
        frame.capture_time_ns = now_ns();
        let sent = frame.capture_time_ns;
        let content = Some(Content::Frame(frame));
        requests.send(PublishFramesRequest { content }).await?;
        answers.message().await?.ok_or("an answer")?;
        let exposure = frames.next().await.ok_or("a frame")?;
        all.push(exposure.id.received_unix_ns.saturating_sub(sent) as f64 / 1e6);
        tokio::time::sleep(PERIOD).await;
    }
    all.sort_by(f64::total_cmp);
    Ok(all)
}

#[tokio::main(worker_threads = 2)]
async fn main() -> Result<(), Fault> {
    let (running, bus, shutdown) = service().await?;
    let url = format!("http://{}", running.address);
    let mut client = CaptureServiceClient::connect(url).await?;
    println!("640×480, depth and RGB8, loopback, {FRAMES} frames at 30 a second: ms");
    for (lens, distortion) in [
        ("pinholes", &[][..]),
        ("distorted lenses", &[0.1, -0.2, 0.001, -0.001, 0.05][..]),
    ] {
        let all = latencies(&mut client, &bus, distortion).await?;
        let at = |share: f64| all[(share * (all.len() - 1) as f64) as usize];
        println!(
            "{lens}: p50 {:.2}, p90 {:.2}, p99 {:.2}",
            at(0.5),
            at(0.9),
            at(0.99)
        );
    }
    shutdown.cancel();
    Ok(())
}
