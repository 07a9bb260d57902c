//! `tryon up`: the services of one box from a configuration file.

use crate::args::UpArgs;
use crate::onebox::OneBox;
use crate::say::say;
use anyhow::{Context, Result};
use std::process::ExitCode;
use std::sync::Arc;
use tryon_kit::bus::ZenohBus;
use tryon_kit::compute::Pool;
use tryon_kit::config::Config;
use tryon_kit::drain;
use tryon_kit::frames::FrameBus;
use tryon_kit::process::{EXIT_USAGE, INSECURE};

/// Runs the command.
///
/// # Errors
/// When a service cannot start.
pub(crate) fn run(args: &UpArgs) -> Result<ExitCode> {
    let set: Vec<String> = args
        .insecure
        .then(|| INSECURE.to_owned())
        .into_iter()
        .collect();
    let config = match Config::load(args.config.as_deref(), &set) {
        Ok(c) => c,
        Err(e) => {
            eprintln!("tryon up: {e}");
            return Ok(ExitCode::from(EXIT_USAGE));
        }
    };
    if args.check {
        println!("{}", toml_of(&config)?);
        return Ok(ExitCode::SUCCESS);
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the runtime")?;
    runtime.block_on(async {
        // The bus listens for camera nodes and `tryon replay` in other processes.
        let pool = Pool::new(1).context("the bus's threads")?;
        let bus = ZenohBus::open_with(&config.bus.config, &config.bus.listen, &[], pool);
        let bus: Arc<dyn FrameBus> = bus.await?;
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
        Ok(ExitCode::SUCCESS)
    })
}

fn toml_of(config: &Config) -> Result<String> {
    Ok(toml::to_string_pretty(config)?)
}
