//! The page in a real browser, against the real services in this process: `tests/web/mirror.mjs` is the user.

#![allow(
    clippy::print_stdout,
    reason = "a skipped test must be loud, and the script says what it saw"
)]

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Result, anyhow, bail, ensure};
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;
use tryon_kit::auth::Auth;
use tryon_kit::compute::Pool;
use tryon_kit::config::Config;
use tryon_kit::flow::Stalls;
use tryon_kit::frames::LocalBus;
use tryon_kit::server::{Context, Running};
use tryon_kit::tls::Tls;

/// Longest run of the browser: all steps with two restarts take a minute on two idle cores; a hung browser is ended
/// here.
const DEADLINE: Duration = Duration::from_secs(400);

fn web() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../web")
}

fn chromium() -> PathBuf {
    std::env::var_os("CHROMIUM").map_or_else(|| PathBuf::from("/usr/bin/chromium"), PathBuf::from)
}

/// Reports a program or package that this machine lacks; a failure with `TRYON_REQUIRE_ALL=1`.
fn missing(what: &str, browser: bool) -> bool {
    let node = Command::new("node")
        .arg("--version")
        .output()
        .is_ok_and(|o| o.status.success());
    let lacks = [
        (!node, "node is not installed"),
        (
            browser && !chromium().exists(),
            "chromium is not installed (or $CHROMIUM is not a file)",
        ),
        (
            browser && !web().join("node_modules/playwright-core").exists(),
            "`npm ci` has not run in tests/web",
        ),
    ];
    let Some((_, why)) = lacks.into_iter().find(|(lacking, _)| *lacking) else {
        return false;
    };
    assert!(
        std::env::var_os("TRYON_REQUIRE_ALL").is_none_or(|v| v != "1"),
        "{what}: {why}"
    );
    println!("SKIPPED: {what}: {why}");
    true
}

#[test]
fn modules_of_the_page_and_names_in_deploy() -> Result<()> {
    if missing("the page's unit tests", false) {
        return Ok(());
    }
    let out = Command::new("node")
        .arg("--test")
        .current_dir(web())
        .output()?;
    let said = String::from_utf8_lossy(&out.stdout);
    ensure!(out.status.success(), "node --test in tests/web:\n{said}");
    Ok(())
}

/// All services in one process, each of which can be ended and restarted at its address.
struct Chain {
    runtime: Runtime,
    bus: Arc<LocalBus>,
    pool: Arc<Pool>,
    config: Config,
    running: Vec<(&'static str, CancellationToken, Running)>,
}

impl Chain {
    fn start() -> Result<Self> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .enable_all()
            .build()?;
        let pool = Pool::new(0)?;
        let anywhere = ([127, 0, 0, 1], 0).into();
        let mut config = Config::default();
        // A debug build on busy cores is slow; other tests judge lateness.
        config.compositor.garments_late_ms = 3000;
        config.capture.address = anywhere;
        config.tracking.address = anywhere;
        config.cloth.address = anywhere;
        config.compositor.address = anywhere;
        config.capture.admin = anywhere;
        config.tracking.admin = anywhere;
        config.cloth.admin = anywhere;
        config.compositor.admin = anywhere;
        let mut chain = Self {
            runtime,
            bus: LocalBus::new(pool.clone()),
            pool,
            config,
            running: Vec::new(),
        };
        for name in ["capture", "tracking", "cloth", "compositor"] {
            chain.start_one(name)?;
        }
        Ok(chain)
    }

    fn start_one(&mut self, name: &'static str) -> Result<()> {
        let shutdown = CancellationToken::new();
        let ctx = Context {
            stalls: Stalls::default(),
            bus: self.bus.clone(),
            pool: self.pool.clone(),
            shutdown: shutdown.clone(),
            grace: Duration::from_millis(200),
            auth: Auth::off(),
            tls: Tls::off(),
            inside: Tls::off(),
        };
        let config = &self.config;
        let running = self.runtime.block_on(async {
            match name {
                "capture" => tryon_capture_service::start(config, ctx).await,
                "tracking" => tryon_tracking_service::start(config, ctx).await,
                "cloth" => tryon_cloth_service::start(config, ctx).await,
                _ => tryon_compositor_service::start(config, ctx).await,
            }
        })?;
        let (at, url) = (running.address, format!("http://{}", running.address));
        match name {
            "capture" => {
                self.config.capture.address = at;
                self.config.compositor.capture = url;
            }
            "tracking" => {
                self.config.tracking.address = at;
                self.config.cloth.tracking.clone_from(&url);
                self.config.compositor.tracking = url;
            }
            "cloth" => {
                self.config.cloth.address = at;
                self.config.compositor.cloth = url;
            }
            _ => self.config.compositor.address = at,
        }
        self.running.push((name, shutdown, running));
        Ok(())
    }

    fn end_one(&mut self, name: &str) -> Result<()> {
        let at = self
            .running
            .iter()
            .position(|(n, ..)| *n == name)
            .ok_or_else(|| anyhow!("{name} does not run"))?;
        let (_, shutdown, running) = self.running.remove(at);
        shutdown.cancel();
        self.runtime.block_on(running.ended())?;
        Ok(())
    }
}

/// Services in the order in which they are ended: one behind the compositor, then the compositor itself.
const BROKEN: [&str; 2] = ["cloth", "compositor"];

#[test]
fn a_shopper_in_chromium() -> Result<()> {
    if missing("the page in a browser", true) {
        return Ok(());
    }
    let mut chain = Chain::start()?;
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("browser");
    let mut script = Command::new("node")
        .arg("mirror.mjs")
        .arg(format!("http://{}/", chain.config.compositor.address))
        .args([
            "--stdio",
            "--rounds",
            &BROKEN.len().to_string(),
            "--timeout",
            "90",
            "--out",
        ])
        .arg(&out)
        .arg("--chromium")
        .arg(chromium())
        .current_dir(web())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let (Some(mut answer), Some(output)) = (script.stdin.take(), script.stdout.take()) else {
        bail!("the script has no pipes");
    };
    // Ends the script when it hangs; its output then ends too, and with it the loop below.
    let id = script.id().to_string();
    let (finished, expired) = std::sync::mpsc::channel::<()>();
    let guard = std::thread::spawn(move || {
        if expired.recv_timeout(DEADLINE) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
            let _ = Command::new("kill").arg(&id).status();
        }
    });
    let mut said = String::new();
    let mut round = 0;
    for line in BufReader::new(output).lines() {
        let line = line?;
        match line.as_str() {
            "BREAK" => chain.end_one(BROKEN[round])?,
            "MEND" => {
                chain.start_one(BROKEN[round])?;
                round += 1;
            }
            _ => {
                println!("{line}");
                said.push_str(&line);
                said.push('\n');
                continue;
            }
        }
        writeln!(answer, "done")?;
    }
    drop(finished);
    let _ = guard.join();
    let status = script.wait()?;
    ensure!(
        status.success() && round == BROKEN.len(),
        "pictures of the failure: {}\n{said}",
        out.display()
    );
    Ok(())
}
