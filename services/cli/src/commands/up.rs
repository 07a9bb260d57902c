//! `tryon up`: the services of one box from a configuration file.

use crate::args::UpArgs;
use crate::onebox::OneBox;
use crate::say::say;
use anyhow::{Context, Result};
use std::process::ExitCode;
use std::sync::Arc;
use tryon_kit::bus::{self, ZenohBus};
use tryon_kit::compute::Pool;
use tryon_kit::config::Config;
use tryon_kit::drain;
use tryon_kit::frames::FrameBus;
use tryon_kit::process::{EXIT_USAGE, INSECURE, exit_code};
use tryon_kit::server::StartError;

/// Runs the command. Its exit codes are those of the services' programs.
///
/// # Errors
/// A fault of the system.
pub(crate) fn run(args: &UpArgs) -> Result<ExitCode> {
    let mut set = args.set.clone();
    set.extend(args.insecure.then(|| INSECURE.to_owned()));
    let config = match Config::load(args.config.as_deref(), &set) {
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

/// Serves until a signal.
async fn serve(config: Config) -> Result<()> {
    bus::check(&config.bus)?;
    // The bus listens for camera nodes and `tryon replay` in other processes.
    let pool = Pool::new(1).context("the bus's threads")?;
    let bus = ZenohBus::open_with(&config.bus.config, &config.bus.listen, &[], pool);
    let bus: Arc<dyn FrameBus> = bus.await.map_err(StartError::from)?;
    let services = OneBox::start(config, Some(bus)).await?;
    for (name, grpc, admin) in &services.addresses {
        say(format_args!("{name}: grpc {grpc} admin {admin}"));
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
