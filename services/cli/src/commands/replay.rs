//! `tryon replay`: a recording as if it were a live camera.

use crate::args::ReplayArgs;
use crate::say::say;
use anyhow::{Context, Result};
use std::process::ExitCode;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use tryon::formats::open_recording;
use tryon_kit::auth::Auth;
use tryon_kit::bus::{Ends, ZenohBus};
use tryon_kit::compute::Pool;
use tryon_kit::config::{CameraConfig, Config};
use tryon_kit::drain;
use tryon_kit::flow::Stalls;
use tryon_kit::identity::Identity;
use tryon_kit::server::Context as ServiceContext;
use tryon_kit::tls::Tls;

/// Runs the command: the capture service with this recording as its only camera.
///
/// # Errors
/// A recording or configuration that cannot be used.
pub(crate) fn run(args: &ReplayArgs) -> Result<ExitCode> {
    // Opened once here, so that a faulty recording is an error and not a camera listed as failed.
    drop(open_recording(&args.input)?);
    let mut config = Config::load(args.config.as_deref(), &[])?;
    let source = args
        .input
        .to_str()
        .context("--input: the path is not UTF-8")?
        .to_owned();
    let name = config
        .capture
        .cameras
        .first()
        .map_or_else(|| "front".to_owned(), |c| c.name.clone());
    config.capture.cameras = vec![CameraConfig {
        name: name.clone(),
        source,
        rate: 0.0,
        fast: args.fast,
        looped: args.repeat,
        autostart: true,
        ..CameraConfig::default()
    }];
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the runtime")?;
    runtime.block_on(async {
        let pool = Pool::new(config.process.compute_threads).context("threads")?;
        let identity = Identity::of(&config, "capture", false)?;
        let ends = Ends::listening(&config.bus, identity.as_ref());
        let bus = ZenohBus::join(&ends, pool.clone()).await?;
        let shutdown = CancellationToken::new();
        let grace = Duration::from_millis(config.process.grace_ms);
        let ctx = ServiceContext {
            stalls: Stalls::default(),
            bus: bus.clone(),
            pool,
            shutdown: shutdown.clone(),
            grace,
            auth: Auth::off(),
            tls: Tls::off(),
            inside: Tls::inside(&config, identity.as_ref())?,
        };
        let key = format!("tryon/{}/{name}/rgbd", config.capture.store);
        let service = tryon_capture_service::start(&config, ctx).await?;
        say(format_args!(
            "{} on {key}, bus {}, grpc {}; Ctrl-C ends it",
            args.input.display(),
            config.bus.listen.join(" "),
            service.address
        ));
        let signal = drain::signal().await.context("signals")?;
        say(format_args!("{signal}: draining"));
        shutdown.cancel();
        service.ended().await?;
        bus.close().await;
        Ok(ExitCode::SUCCESS)
    })
}
