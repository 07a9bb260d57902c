//! Supervisor: one process for each campaign, so that aborts, exhausted stacks and endless inputs are findings too.

use crate::bundle::Bundle;
use crate::campaign::EXIT_ENDLESS;
use crate::corpus;
use crate::targets::Target;
use anyhow::{Context, Result};
use prost::Message;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Address space of a campaign (KiB): a decoder that wants more aborts, and is found.
const ADDRESS_SPACE_KIB: u64 = 8 << 20;

/// Mark of a line that reports a finding, between the target's name and the fault.
pub(crate) const FINDING: &str = ": finding ";

/// Writes a line to standard output.
#[expect(clippy::print_stdout)]
pub fn say(line: &str) {
    println!("{line}");
}

/// Plan of a run.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Time of each target.
    pub time: Duration,
    /// Campaigns at a time.
    pub jobs: usize,
}

/// Runs campaigns against all `targets` and returns the number of findings.
///
/// # Errors
/// A process that cannot be started.
pub fn run(targets: &[&'static Target], plan: Plan) -> Result<usize> {
    let (next, findings) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let fault = Mutex::new(None);
    std::thread::scope(|scope| {
        for _ in 0..plan.jobs.max(1) {
            scope.spawn(|| {
                while let Some(target) = targets.get(next.fetch_add(1, Ordering::Relaxed)) {
                    match supervise(target, plan) {
                        Ok(n) => drop(findings.fetch_add(n, Ordering::Relaxed)),
                        Err(e) => drop(fault.lock().map(|mut f| f.replace(e))),
                    }
                }
            });
        }
    });
    match fault.into_inner() {
        Ok(Some(e)) => Err(e),
        _ => Ok(findings.into_inner()),
    }
}

/// Campaigns against one target until its time is over; a crash ends one of them.
fn supervise(target: &'static Target, plan: Plan) -> Result<usize> {
    let folder = tempfile::tempdir()?;
    let current = folder.path().join("current");
    let start = Instant::now();
    let (mut crashes, mut findings) = (0, 0);
    loop {
        let left = plan.time.saturating_sub(start.elapsed());
        let output = campaign(target, left, &current)?;
        let text = String::from_utf8_lossy(&output.stdout);
        text.lines().for_each(say);
        findings += text.matches(FINDING).count();
        if output.status.success() {
            return Ok(findings);
        }
        (crashes, findings) = (crashes + 1, findings + 1);
        report_crash(target, &output, &current)?;
        if crashes >= 3 || left.is_zero() {
            return Ok(findings);
        }
    }
}

fn campaign(target: &Target, time: Duration, current: &Path) -> Result<Output> {
    let program = std::env::current_exe().context("the path of this program")?;
    let limited = format!("ulimit -v {ADDRESS_SPACE_KIB}; exec \"$0\" \"$@\"");
    Command::new("sh")
        .args(["-c", &limited])
        .arg(program)
        .args(["--campaign", target.name])
        .args(["--seconds", &time.as_secs_f64().to_string()])
        .arg("--current")
        .arg(current)
        .stdin(Stdio::null())
        .output()
        .context("a campaign's process")
}

/// Saves the input that ended the process.
fn report_crash(target: &Target, output: &Output, current: &Path) -> Result<()> {
    let kind = match output.status.code() {
        Some(EXIT_ENDLESS) => "endless",
        _ => "crash",
    };
    let errors = String::from_utf8_lossy(&output.stderr);
    let tail: Vec<&str> = errors.lines().rev().take(3).collect();
    let bytes = std::fs::read(current).unwrap_or_default();
    let saved = match Bundle::decode(&bytes[..]) {
        Ok(input) if !input.0.is_empty() => corpus::save(target.name, kind, &input)?
            .display()
            .to_string(),
        _ => "(its input is unknown)".into(),
    };
    let status = output.status;
    say(&format!(
        "{}{FINDING}{kind} ({status}) in {saved}: {}",
        target.name,
        tail.join(" | ")
    ));
    Ok(())
}
