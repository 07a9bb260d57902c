//! A service as a process: parse, validate (exit 64), build, announce addresses, serve, drain, report the end.

use crate::auth::Auth;
use crate::bus::ZenohBus;
use crate::compute::Pool;
use crate::config::Config;
use crate::drain::{self, Drained};
use crate::frame_trace;
use crate::server::{Context, Running, StartError};
use crate::supervisor;
use crate::tls::Tls;
use clap::Parser;
use std::future::Future;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// Exit status of a command line or configuration that cannot be used (sysexits.h, EX_USAGE).
pub const EXIT_USAGE: u8 = 64;
/// `--insecure` as a key.
pub const INSECURE: &str = "process.insecure=true";
/// Exit status of a service that could not start or broke (EX_SOFTWARE).
pub const EXIT_BROKEN: u8 = 70;

/// Command line of every service.
#[derive(Debug, Parser)]
#[command(version, about)]
pub struct Args {
    /// The configuration of the box (TOML); deploy/tryon.toml shows every key with its default.
    #[arg(long, env = "TRYON_CONFIG", value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Sets one key, such as `--set tracking.address=127.0.0.1:0`; wins over file and environment.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Lets addresses beyond loopback be bound without TLS and tokens: anybody who reaches them sees the person.
    #[arg(long)]
    pub insecure: bool,
    /// Checks the configuration and ends.
    #[arg(long)]
    pub check: bool,
}

/// End of the bus that a process is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusRole {
    /// Listens: capture.
    Listen,
    /// Connects: everyone else.
    Connect,
}

/// Writes a line to standard output for supervisors and tests.
fn say(line: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

fn complain(name: &str, why: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{name}: {why}");
}

/// Runs one service to its end.
pub fn run<F, Fut>(name: &'static str, role: BusRole, args: Args, start: F) -> ExitCode
where
    F: FnOnce(Config, Context) -> Fut,
    Fut: Future<Output = Result<Running, StartError>>,
{
    let mut set = args.set;
    set.extend(args.insecure.then(|| INSECURE.to_owned()));
    let config = Config::load(args.config.as_deref(), &set).map_err(|e| e.to_string());
    let config = match config.and_then(|c| crate::telemetry::init_logs(&c.log).map(|()| c)) {
        Ok(c) => c,
        Err(why) => {
            complain(name, &why);
            return ExitCode::from(EXIT_USAGE);
        }
    };
    if args.check {
        say(&format!("{name}: the configuration is fine"));
        return ExitCode::SUCCESS;
    }
    let grace = Duration::from_millis(config.process.grace_ms);
    let runtime = match tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
    {
        Ok(r) => r,
        Err(e) => {
            complain(name, &e.to_string());
            return ExitCode::from(EXIT_BROKEN);
        }
    };
    let end = runtime.block_on(serve(name, role, config, start, grace));
    // Tasks that outlive the deadline are cut.
    runtime.shutdown_timeout(Duration::from_millis(100));
    match end {
        Ok(Drained::Clean) => {
            say(&format!("{name}: ended cleanly"));
            ExitCode::SUCCESS
        }
        Ok(Drained::DeadlineHit) => {
            say(&format!(
                "{name}: ended at the deadline of {grace:?} with streams open"
            ));
            ExitCode::SUCCESS
        }
        Err(e) => {
            complain(name, &e.to_string());
            ExitCode::from(
                if matches!(
                    e,
                    StartError::Config { .. } | StartError::Auth(_) | StartError::Tls(_)
                ) {
                    EXIT_USAGE
                } else {
                    EXIT_BROKEN
                },
            )
        }
    }
}

async fn serve<F, Fut>(
    name: &'static str,
    role: BusRole,
    config: Config,
    start: F,
    grace: Duration,
) -> Result<Drained, StartError>
where
    F: FnOnce(Config, Context) -> Fut,
    Fut: Future<Output = Result<Running, StartError>>,
{
    let broken = |e: std::io::Error| StartError::Broken {
        service: name,
        why: e.to_string(),
    };
    let auth = Auth::open(&config, None)?;
    let pool = Pool::new(config.process.compute_threads).map_err(broken)?;
    let (listen, connect) = match role {
        BusRole::Listen => (&config.bus.listen[..], &[][..]),
        BusRole::Connect => (&[][..], &config.bus.connect[..]),
    };
    let bus = ZenohBus::open_with(&config.bus.config, listen, connect, pool.clone()).await?;
    let shutdown = CancellationToken::new();
    let ctx = Context {
        bus: bus.clone(),
        pool: pool.clone(),
        shutdown: shutdown.clone(),
        grace,
        auth,
        tls: Tls::open(&config.tls)?,
    };
    crate::telemetry::show_zeros(name);
    let unusable = |why| StartError::Config {
        key: "telemetry.otlp".into(),
        why,
    };
    let traces = frame_trace::start(name, &config.telemetry).map_err(unusable)?;
    let running = start(config, ctx).await?;
    say(&format!(
        "{name}: grpc {} admin {}",
        running.address, running.admin
    ));
    let watchdog = supervisor::ready(&pool, running.admin);
    let watch = tokio::spawn(async move {
        if let Ok(which) = drain::signal().await {
            tracing::info!(signal = which, "draining");
            supervisor::stopping();
        }
        shutdown.cancel();
    });
    let end = running.ended().await;
    watch.abort();
    if let Some(watchdog) = watchdog {
        watchdog.abort();
    }
    if let Some(traces) = traces {
        traces.end().await;
    }
    // The bus closes within a deadline of its own.
    let _ = tokio::time::timeout(Duration::from_millis(500), bus.close()).await;
    end
}
