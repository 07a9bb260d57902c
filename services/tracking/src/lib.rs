//! Tracking service: body states from the frames of a camera.
//!
//! One task owns one session (`session`): it receives the newest frame, steps the tracker on the compute pool and
//! publishes the state in a watch that any number of streams read.

mod engine;
mod service;
mod session;

use std::sync::Arc;
use tryon_body::Template;
use tryon_kit::config::Config;
use tryon_kit::server::{self, Context, Running, Service, StartError};
use tryon_landmarks::Landmarker;
use tryon_proto::v1::tracking_service_server::{SERVICE_NAME, TrackingServiceServer};

/// Largest request, bytes: a known body of the largest template takes 132 kB.
const MAX_REQUEST_BYTES: usize = 192 * 1024;

/// Reads the configured body.
fn template(config: &Config) -> Result<Arc<Template>, StartError> {
    engine::load_template(&config.tracking.body).map_err(|why| StartError::Config {
        key: "tracking.body".into(),
        why,
    })
}

/// Loads the configured networks of the eye for colour; `None` for an empty path.
fn landmarker(config: &Config) -> Result<Option<Landmarker>, StartError> {
    let file = &config.tracking.color_model;
    if file.as_os_str().is_empty() {
        return Ok(None);
    }
    let opened = Landmarker::open(file).map_err(|why| StartError::Config {
        key: "tracking.color_model".into(),
        why: why.to_string(),
    });
    opened.map(Some)
}

/// Checks the files that `[tracking]` names.
///
/// # Errors
/// When the configured body or colour model cannot be read.
pub fn check(config: &Config) -> Result<(), StartError> {
    template(config)?;
    landmarker(config).map(drop)
}

/// Starts the service.
///
/// # Errors
/// When an address cannot be bound, or the configured body or colour model cannot be read.
pub async fn start(config: &Config, ctx: Context) -> Result<Running, StartError> {
    let c = &config.tracking;
    let own = config.clone();
    let read = move || -> Result<_, StartError> { Ok((template(&own)?, landmarker(&own)?)) };
    let read = ctx.pool.run(read).await;
    let (template, landmarker) = read.map_err(|e| StartError::Broken {
        service: "tracking",
        why: e.to_string(),
    })??;
    if landmarker.is_none() {
        tracing::info!("people are tracked by depth alone: tracking.color_model names no model");
    }
    let service = service::Tracking::new(c, &ctx, template, landmarker);
    service.prepare();
    let (mut routes, health) = server::routes(SERVICE_NAME)?;
    routes.add_service(
        TrackingServiceServer::new(service).max_decoding_message_size(MAX_REQUEST_BYTES),
    );
    let service = Service {
        name: "tracking",
        grpc_name: SERVICE_NAME,
        address: c.address,
        admin: c.admin,
        routes: routes.routes(),
        around: None,
        is_public: false,
        health,
    };
    server::start(service, &ctx).await
}
