//! A service as a process: parse, validate (exit 64), build, announce addresses, serve, drain, report the end.

use crate::auth::{Auth, Issuer};
use crate::bus::{self, Ends, ZenohBus};
use crate::compute::Pool;
use crate::config::Config;
use crate::core_dump;
use crate::drain::{self, Drained};
use crate::flow::Stalls;
use crate::frame_trace;
use crate::identity::Identity;
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
    /// Checks the configuration and the files that it names, and ends.
    #[arg(long)]
    pub check: bool,
}

/// End of the bus that a process is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusRole {
    /// Listens: capture.
    Listen,
    /// Connects: who takes frames.
    Connect,
    /// Has no business there: cloth.
    Apart,
}

/// Opens the files that a service's part of the configuration names.
///
/// # Errors
/// Names the first key at fault.
pub type Check = fn(&Config) -> Result<(), StartError>;

/// A service as its program runs it.
#[derive(Debug, Clone, Copy)]
pub struct Program {
    /// Its name, as in the configuration.
    pub name: &'static str,
    /// Its end of the bus.
    pub role: BusRole,
    /// Check of its files. Its start makes the same.
    pub check: Check,
}

/// Exit status of a process that could not start or broke: [`EXIT_USAGE`] where the configuration is at fault.
pub fn exit_code(e: &StartError) -> ExitCode {
    ExitCode::from(match e {
        StartError::Config { .. } | StartError::Auth(_) | StartError::Tls(_) => EXIT_USAGE,
        StartError::Bind { .. } | StartError::Bus(_) | StartError::Broken { .. } => EXIT_BROKEN,
    })
}

/// Files of the configuration that every process opens, read; tasks of the runtime follow them.
pub struct CommonFiles {
    /// Files of `[auth]`.
    pub auth: Auth,
    /// Files of `[tls]`.
    pub tls: Tls,
    /// Identity of the store's services to each other, where they have one.
    pub identity: Option<Identity>,
    /// Encryption of their connections: of `identity`, or that of `tls`.
    pub inside: Tls,
}

impl CommonFiles {
    /// Opens the files of `[auth]`, `[tls]` and `[identity]` for the process `name`, and checks `[bus]`. `own` as for
    /// [`Auth::open`]: of a process that holds all services.
    ///
    /// # Errors
    /// Names the key whose file cannot be used.
    pub fn open(config: &Config, name: &str, own: Option<&Issuer>) -> Result<Self, StartError> {
        let (auth, tls) = (Auth::open(config, own)?, Tls::open(&config.tls)?);
        bus::check(&config.bus)?;
        let identity = Identity::of(config, name, own.is_some())?;
        let inside = match &identity {
            Some(identity) => Tls::of_store(identity)?,
            None => tls.clone(),
        };
        if !inside.is_on() {
            tracing::warn!(
                "whoever is on the network between services can see people: \
                 there is no identity.authority, or identity.off = true"
            );
        }
        Ok(Self {
            auth,
            tls,
            identity,
            inside,
        })
    }
}

/// Writes a line to standard output for supervisors and tests.
fn say(line: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

fn complain(name: &str, why: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{name}: {why}");
}

/// Runs one service to its end.
pub fn run<F, Fut>(program: Program, args: Args, start: F) -> ExitCode
where
    F: FnOnce(Config, Context) -> Fut,
    Fut: Future<Output = Result<Running, StartError>>,
{
    core_dump::forbid();
    let name = program.name;
    let mut set = args.set;
    set.extend(args.insecure.then(|| INSECURE.to_owned()));
    let config = Config::load(args.config.as_deref(), &set).map_err(|e| e.to_string());
    let logged = |c: Config| match crate::telemetry::init_logs(&c.log) {
        Ok(()) => Ok(c),
        Err(why) => Err(format!("log.level: {why}")),
    };
    let config = match config.and_then(logged) {
        Ok(c) => c,
        Err(why) => {
            complain(name, &why);
            return ExitCode::from(EXIT_USAGE);
        }
    };
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
    let end = runtime.block_on(async {
        if args.check {
            check(&program, &config).map(|()| "the configuration is fine".to_owned())
        } else {
            let end = serve(program, config, start, grace).await;
            end.map(|drained| farewell(drained, grace))
        }
    });
    // Tasks that outlive the deadline are cut.
    runtime.shutdown_timeout(Duration::from_millis(100));
    match end {
        Ok(last) => {
            say(&format!("{name}: {last}"));
            ExitCode::SUCCESS
        }
        Err(e) => {
            complain(name, &e.to_string());
            exit_code(&e)
        }
    }
}

/// Opens all files that the process would.
fn check(program: &Program, config: &Config) -> Result<(), StartError> {
    CommonFiles::open(config, program.name, None)?;
    (program.check)(config)
}

/// Last line of a process that ended.
fn farewell(drained: Drained, grace: Duration) -> String {
    match drained {
        Drained::Clean => "ended cleanly".into(),
        Drained::DeadlineHit => format!("ended at the deadline of {grace:?} with streams open"),
    }
}

async fn serve<F, Fut>(
    program: Program,
    config: Config,
    start: F,
    grace: Duration,
) -> Result<Drained, StartError>
where
    F: FnOnce(Config, Context) -> Fut,
    Fut: Future<Output = Result<Running, StartError>>,
{
    let name = program.name;
    let broken = |e: std::io::Error| StartError::Broken {
        service: name,
        why: e.to_string(),
    };
    let files = CommonFiles::open(&config, name, None)?;
    let pool = Pool::new(config.process.compute_threads).map_err(broken)?;
    let (bus, identity) = (&config.bus, files.identity.as_ref());
    let ends = match program.role {
        BusRole::Listen => Ends::listening(bus, identity),
        BusRole::Connect => Ends::connecting(bus, identity),
        BusRole::Apart => Ends {
            connect: &[],
            ..Ends::connecting(bus, identity)
        },
    };
    let bus = ZenohBus::join(&ends, pool.clone()).await?;
    let shutdown = CancellationToken::new();
    let ctx = Context {
        stalls: Stalls::default(),
        bus: bus.clone(),
        pool: pool.clone(),
        shutdown: shutdown.clone(),
        grace,
        auth: files.auth,
        tls: files.tls,
        inside: files.inside,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::AuthError;
    use crate::frames::BusError;

    #[test]
    fn only_faults_of_the_configuration_are_its_own_exit_code() {
        let why = || "why".to_owned();
        let config = StartError::Config {
            key: "key".into(),
            why: why(),
        };
        let auth = StartError::Auth(AuthError {
            key: "auth.keys",
            why: why(),
        });
        for fault in [config, auth] {
            assert_eq!(exit_code(&fault), ExitCode::from(EXIT_USAGE), "{fault}");
        }
        let bus = StartError::Bus(BusError(why()));
        assert_eq!(exit_code(&bus), ExitCode::from(EXIT_BROKEN));
    }
}
