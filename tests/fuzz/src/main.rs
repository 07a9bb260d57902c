//! Runs fuzz campaigns: `cargo run -p tryon-fuzz -- --seconds 60 [TARGET…]`.

use anyhow::{Context, Result};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;
use tryon_fuzz::supervise::{Plan, say};
use tryon_fuzz::targets::{TARGETS, Target};
use tryon_fuzz::{campaign, supervise};

/// Mutates inputs of decoders and reports those that panic, hold too much memory, abort or never end.
#[derive(Debug, Parser)]
#[command(version)]
struct Args {
    /// Targets; all without any. `--list` names them.
    targets: Vec<String>,
    /// Time of each target (s).
    #[arg(long, env = "TRYON_FUZZ_SECONDS", default_value_t = 60.0)]
    seconds: f64,
    /// Targets at a time.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Names the targets and ends.
    #[arg(long)]
    list: bool,
    /// Runs this one target in this process, for the supervisor.
    #[arg(long, hide = true, requires = "current")]
    campaign: Option<String>,
    /// File that holds the input under way.
    #[arg(long, hide = true)]
    current: Option<PathBuf>,
}

fn find(name: &str) -> Result<&'static Target> {
    let target = TARGETS.iter().find(|t| t.name == name);
    target.with_context(|| format!("no target `{name}`; --list names them"))
}

fn main() -> Result<ExitCode> {
    let args = Args::parse();
    let time = Duration::try_from_secs_f64(args.seconds).context("--seconds")?;
    if args.list {
        for t in TARGETS {
            say(&format!("{:<16} {}", t.name, t.decoder));
        }
        return Ok(ExitCode::SUCCESS);
    }
    if let (Some(name), Some(current)) = (&args.campaign, &args.current) {
        campaign::run(find(name)?, time, current)?;
        return Ok(ExitCode::SUCCESS);
    }
    let targets = if args.targets.is_empty() {
        TARGETS.iter().collect()
    } else {
        let found = args.targets.iter().map(|n| find(n));
        found.collect::<Result<Vec<_>>>()?
    };
    let plan = Plan {
        time,
        jobs: args.jobs,
    };
    let findings = supervise::run(&targets, plan)?;
    say(&format!("{} targets, {findings} findings", targets.len()));
    Ok(ExitCode::from(u8::from(findings > 0)))
}
