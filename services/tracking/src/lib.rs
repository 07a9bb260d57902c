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

/// Checks the files that `[tracking]` names.
///
/// # Errors
/// When the configured body cannot be read.
pub fn check(config: &Config) -> Result<(), StartError> {
    template(config).map(drop)
}

/// Starts the service.
///
/// # Errors
/// When an address cannot be bound or the configured body cannot be read.
pub async fn start(config: &Config, ctx: Context) -> Result<Running, StartError> {
    let c = &config.tracking;
    let own = config.clone();
    let template = ctx.pool.run(move || template(&own)).await;
    let template = template.map_err(|e| StartError::Broken {
        service: "tracking",
        why: e.to_string(),
    })??;
    let service = service::Tracking::new(c, &ctx, template);
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
