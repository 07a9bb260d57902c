//! `tryon up`: the services of one box from a configuration file.

use crate::args::UpArgs;
use crate::onebox::OneBox;
use crate::say::say;
use anyhow::{Context, Result};
use std::process::ExitCode;
use std::sync::Arc;
use tryon_kit::bus::{self, Ends, ZenohBus};
use tryon_kit::compute::Pool;
use tryon_kit::config::Config;
use tryon_kit::drain;
use tryon_kit::frames::FrameBus;
use tryon_kit::identity::Identity;
use tryon_kit::process::{EXIT_USAGE, INSECURE, exit_code};
use tryon_kit::server::StartError;
use tryon_kit::telemetry;

/// Runs the command. Its exit codes are those of the services' programs. `log` is a filter that wins over that of `[log]`.
///
/// # Errors
/// A fault of the system.
pub(crate) fn run(args: &UpArgs, log: Option<String>) -> Result<ExitCode> {
    let mut set = args.set.clone();
    set.extend(args.insecure.then(|| INSECURE.to_owned()));
    let config = match configured(args, &set, log) {
        Ok(c) => c,
        Err(e) => {
            eprintln!("tryon up: {e}");
            return Ok(ExitCode::from(EXIT_USAGE));
        }
    };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the runtime")?;
    let end = runtime.block_on(async {
        if args.check {
            OneBox::check(&config)?;
            say(format_args!("{}", toml_of(&config)?));
            Ok(())
        } else {
            serve(config).await
        }
    });
    match end {
        Ok(()) => Ok(ExitCode::SUCCESS),
        Err(e) => match e.downcast_ref::<StartError>() {
            Some(fault) => {
                eprintln!("tryon up: {fault}");
                Ok(exit_code(fault))
            }
            None => Err(e),
        },
    }
}

/// Reads the configuration, and logs as it says; `log` wins over its filter.
fn configured(args: &UpArgs, set: &[String], log: Option<String>) -> Result<Config, String> {
    let mut config = Config::load(args.config.as_deref(), set).map_err(|e| e.to_string())?;
    let key = if log.is_some() { "--log" } else { "log.level" };
    config.log.level = log.unwrap_or(config.log.level);
    telemetry::init_logs(&config.log).map_err(|why| format!("{key}: {why}"))?;
    Ok(config)
}

/// Serves until a signal.
async fn serve(config: Config) -> Result<()> {
    bus::check(&config.bus)?;
    // The bus listens for camera nodes and `tryon replay` in other processes.
    let pool = Pool::new(1).context("the bus's threads")?;
    let identity = Identity::of(&config, "capture", false)?;
    let ends = Ends::listening(&config.bus, identity.as_ref());
    let bus = ZenohBus::join(&ends, pool).await;
    let bus: Arc<dyn FrameBus> = bus.map_err(StartError::from)?;
    let services = OneBox::start(config, Some(bus)).await?;
    for (name, grpc, admin) in &services.addresses {
        say(format_args!("{name}: grpc {grpc} admin {admin}"));
    }
    for (camera, token) in &services.feeders {
        say(format_args!("camera {camera}: fed with token {token}"));
    }
    if let Some(page) = services.page() {
        say(format_args!("mirror: {page}"));
    }
    let signal = drain::signal().await.context("signals")?;
    say(format_args!("{signal}: draining"));
    services.stop().await;
    say(format_args!("ended"));
    Ok(())
}

fn toml_of(config: &Config) -> Result<String> {
    Ok(toml::to_string_pretty(config)?)
}
