//! Compositor: pictures for kiosks and pages, which connect to this service only.
//!
//! One task owns one try-on (`try_on`): it opens the sessions behind it and joins frames, bodies and garments by epoch
//! and sequence (`join_buffer`). It renders on the compute pool (`engine`, on a `card` where there is one) and queues pictures
//! for every viewer (`viewer`). The states of a try-on are the table of `tryon::session`. gRPC, gRPC-web and the page
//! share one port.

mod card;
mod engine;
mod join_buffer;
mod life;
pub mod page;
mod service;
mod try_on;
mod upstream;
mod viewer;

use tonic::service::Routes;
use tonic_web::GrpcWebLayer;
use tryon_kit::config::Config;
use tryon_kit::server::{self, Context, Running, Service, StartError};
use tryon_proto::v1::compositor_service_server::{CompositorServiceServer, SERVICE_NAME};

/// Starts the service. The services behind it need not run yet.
///
/// # Errors
/// When an address cannot be bound or a URL is none.
pub async fn start(config: &Config, ctx: Context) -> Result<Running, StartError> {
    let c = &config.compositor;
    let service = service::Compositor::new(c, &ctx)?;
    let (mut routes, health) = server::routes()?;
    routes.add_service(
        CompositorServiceServer::new(service).max_decoding_message_size(server::MAX_REQUEST_BYTES),
    );
    let grpc = routes
        .routes()
        .into_axum_router()
        .layer(GrpcWebLayer::new());
    let routes = Routes::from(grpc.reset_fallback().merge(page::router()));
    let service = Service {
        name: "compositor",
        grpc_name: SERVICE_NAME,
        address: c.address,
        admin: c.admin,
        routes,
        http1: true,
        health,
    };
    server::start(service, &ctx).await
}
