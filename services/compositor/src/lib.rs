//! Compositor: pictures for kiosks and pages, which connect to this service only.
//!
//! One task owns one try-on (`try_on`): it opens the sessions behind it and joins frames, bodies and garments by epoch
//! and sequence (`join_buffer`). It renders on the compute pool (`engine`, on a `card` where there is one), queues pictures
//! for every viewer (`viewer`), draws fine pictures on request (`fine_picture`) and keeps photos for phones (`photos`). The states of a try-on are the table of `tryon::session`. gRPC, gRPC-web and the page
//! share one port.
//!
//! # Ideas
//!
//! - Frames that wait for their garments: [`mod@join_buffer`].
//! - Card shared and lost: [`mod@card`].
//! - Viewers and their acknowledgements: [`mod@viewer`].
//! - Formats to draw: [`mod@formats`].
//! - Admission: [`mod@admission`].
//! - Empty rooms: [`mod@empty_scene`].
//! - Photos for phones: [`mod@photos`].
//! - Fine pictures: [`mod@fine_picture`].
//! - The task of one try-on: [`mod@try_on::task`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod admission;
mod card;
mod empty_scene;
mod encoding;
mod engine;
mod fine_picture;
mod formats;
mod join_buffer;
mod life;
mod looks;
mod off_person;
pub mod page;
#[cfg(test)]
mod painted;
mod photos;
mod service;
mod try_on;
mod upstream;
mod viewer;

use axum::Router;
use axum::body::Body;
use axum::middleware::{Next, from_fn};
use http::{Request, Response};
use std::io::ErrorKind;
use tonic_web::GrpcWebLayer;
use tryon_kit::config::Config;
use tryon_kit::hosts::Hosts;
use tryon_kit::identity::check_url;
use tryon_kit::server::{self, Context, Running, Service, StartError};
use tryon_proto::v1::compositor_service_server::{CompositorServiceServer, SERVICE_NAME};

/// Refuses requests to foreign hosts and from foreign pages.
async fn own_pages_only(hosts: Hosts, request: Request<Body>, next: Next) -> Response<Body> {
    let Some(status) = hosts.refusal(&request) else {
        return next.run(request).await;
    };
    let mut answer = Response::new(Body::empty());
    *answer.status_mut() = status;
    answer
}

/// Checks the URLs of the services behind, and the folder of enrolment codes, which may be missing until the first code is
/// drawn.
///
/// # Errors
/// When a URL is not one of theirs, or the folder cannot be listed.
pub fn check(config: &Config) -> Result<(), StartError> {
    let c = &config.compositor;
    for (key, url) in [
        ("compositor.tracking", &c.tracking),
        ("compositor.cloth", &c.cloth),
        ("compositor.capture", &c.capture),
    ] {
        check_url(config, key, url)?;
    }
    let folder = &config.auth.enrolments;
    match std::fs::read_dir(folder) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(StartError::Config {
            key: "auth.enrolments".into(),
            why: format!("{}: {e}", folder.display()),
        }),
        _ => Ok(()),
    }
}

/// Starts the service. The services behind it need not run yet.
///
/// # Errors
/// When a file of the configuration cannot be used, an address cannot be bound, or a URL is none.
pub async fn start(config: &Config, ctx: Context) -> Result<Running, StartError> {
    check(config)?;
    let c = &config.compositor;
    let photos = photos::Photos::default();
    let service = service::Compositor::new(c, &ctx, photos.clone())?;
    let (mut routes, health) = server::routes(SERVICE_NAME)?;
    tryon_kit::behind::follow(health.clone(), &ctx, service.behind());
    routes.add_service(
        CompositorServiceServer::new(service).max_decoding_message_size(server::MAX_REQUEST_BYTES),
    );
    let mut names = c.hosts.clone();
    let public = c.public.parse::<http::Uri>().ok();
    names.extend(public.and_then(|u| u.host().map(str::to_owned)));
    let hosts = Hosts::new(&names, &c.origins);
    let around = move |grpc: Router| {
        let grpc = grpc.layer(GrpcWebLayer::new()).reset_fallback();
        let own = from_fn(move |r, next| own_pages_only(hosts.clone(), r, next));
        let open = page::router().merge(photos::router(photos));
        grpc.merge(open).layer(own)
    };
    let service = Service {
        name: "compositor",
        grpc_name: SERVICE_NAME,
        address: c.address,
        admin: c.admin,
        routes: routes.routes(),
        around: Some(Box::new(around)),
        is_public: true,
        health,
    };
    server::start(service, &ctx).await
}
