//! Cloth service: garments on the bodies that tracking reports.
//!
//! One task owns one session (`session`): it follows the body states, dresses the body when it is calibrated, steps the
//! garments on the compute pool and sends each reader a keyframe and then positions.
//!
//! # Ideas
//!
//! - Keyframe for which reader: [`mod@session`].
//! - Garments on offer: [`mod@library`], those of a folder: [`mod@folder`].
//! - Less detail on a slow machine: [`mod@detail_ladder`].
//! - Simulations on request: [`mod@simulation`], of scenes: [`mod@scene_task`], of a session's garments on finer
//!   meshes: [`mod@fine_task`], [`mod@recording`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod chosen_sizes;
mod detail_ladder;
mod engine;
mod fine_task;
mod folder;
mod library;
mod progress;
mod recording;
mod scene_task;
mod service;
mod session;
mod simulation;

use tryon_kit::config::Config;
use tryon_kit::identity::check_url;
use tryon_kit::server::{self, Context, Running, Service, StartError};
use tryon_proto::v1::cloth_service_server::{ClothServiceServer, SERVICE_NAME};
use tryon_proto::v1::tracking_service_server::SERVICE_NAME as TRACKING;

/// Largest request, bytes: a scene of a simulation, its checkpoint, and their message.
const MAX_REQUEST_BYTES: usize = 5 * 1024 * 1024 + 4096;

/// Checks the files that `[cloth]` names; garments at fault are logged.
///
/// # Errors
/// When the URL of tracking, the folder, the body or a material of garments cannot be used.
pub fn check(config: &Config) -> Result<(), StartError> {
    check_url(config, "cloth.tracking", &config.cloth.tracking)?;
    library::Library::read(&config.cloth).map(drop)
}

/// Starts the service. The tracking service need not run yet.
///
/// # Errors
/// When an address cannot be bound or the tracking URL is none.
pub async fn start(config: &Config, ctx: Context) -> Result<Running, StartError> {
    let c = &config.cloth;
    check_url(config, "cloth.tracking", &c.tracking)?;
    let tracking = tryon_kit::client::channel(&c.tracking, &ctx.inside);
    let tracking = tracking.map_err(|why| StartError::Config {
        key: "cloth.tracking".into(),
        why,
    })?;
    let tracking = ctx.auth.credentials().present(tracking);
    let settings = c.clone();
    let offered = tokio::task::spawn_blocking(move || library::Library::read(&settings)).await;
    let offered = offered.map_err(|e| StartError::Config {
        key: "cloth.garments".into(),
        why: e.to_string(),
    })??;
    let (mut routes, health) = server::routes(SERVICE_NAME)?;
    let behind = vec![(TRACKING, tracking.clone())];
    tryon_kit::behind::follow(health.clone(), &ctx, behind);
    let service = service::Cloth::new(c, &ctx, tracking, offered);
    routes
        .add_service(ClothServiceServer::new(service).max_decoding_message_size(MAX_REQUEST_BYTES));
    let service = Service {
        name: "cloth",
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
