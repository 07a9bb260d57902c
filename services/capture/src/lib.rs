//! Capture service: cameras and recordings onto the bus.
//!
//! One task owns one camera (`camera`). Its frames are read on a thread of their own (`reader`) while somebody holds a lease
//! of consent (`consent`), and published on the bus, which keeps only the newest. The rpcs (`service`) start, stop and report.
//!
//! # Ideas
//!
//! - Consent: leases and their key [`mod@consent`], their renewal `services/kit/src/consent.rs`.
//! - Consent to record: [`mod@service`].
//! - Frames of another program: [`mod@push`].
//! - Cameras of ROS 2 over zenoh: [`mod@ros2`].
//! - Pace of a source: [`mod@pace`].
//! - Silence of a camera, and its return: [`mod@live`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod camera;
mod check;
mod consent;
mod live;
#[cfg(test)]
mod live_tests;
mod pace;
mod pattern;
mod push;
mod reader;
mod recorder;
mod ros2;
mod service;
mod source;

pub use check::{check, check_process};
pub use push::PUSH;
pub use source::{OpenSource, SourceError, is_live, is_recording, open, open_with};

use std::sync::Arc;
use tryon_kit::config::Config;
use tryon_kit::server::{self, Context, Running, Service, StartError};
use tryon_proto::v1::capture_service_server::{CaptureServiceServer, SERVICE_NAME};

/// Most bytes of a request: a frame of 1024 × 1024 depths with 2048 × 1536 colours or a JPEG.
const MAX_REQUEST_BYTES: usize = 16 << 20;

/// Starts the service; cameras marked `autostart` begin to publish.
///
/// # Errors
/// When a file of the configuration cannot be used, or an address cannot be bound. A camera whose source fails later is
/// listed as failed.
pub async fn start(config: &Config, ctx: Context) -> Result<Running, StartError> {
    let c = &config.capture;
    let checked = config.clone();
    let checked = ctx.pool.run(move || check(&checked)).await;
    checked.map_err(|e| StartError::Broken {
        service: "capture",
        why: e.to_string(),
    })??;
    let capture = Arc::new(service::Capture::new(c, &ctx));
    let (mut routes, health) = server::routes(SERVICE_NAME)?;
    routes.add_service(
        CaptureServiceServer::from_arc(capture.clone())
            .max_decoding_message_size(MAX_REQUEST_BYTES),
    );
    let service = Service {
        name: "capture",
        grpc_name: SERVICE_NAME,
        address: c.address,
        admin: c.admin,
        routes: routes.routes(),
        around: None,
        is_public: false,
        health,
    };
    let running = server::start(service, &ctx).await?;
    // After the port is open: consent is renewed while sources are being opened.
    for camera in c
        .cameras
        .iter()
        .filter(|camera| camera.autostart && !push::is_push(&camera.source))
    {
        capture.autostart(&camera.name).await;
    }
    Ok(running)
}
