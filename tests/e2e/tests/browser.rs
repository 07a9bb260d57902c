//! The page in a real browser, against the real services in this process: `tests/web/mirror.mjs` is the user.

#![allow(
    clippy::print_stdout,
    missing_docs,
    unreachable_pub,
    reason = "a skipped test must be loud, and the script says what it saw"
)]

#[allow(dead_code, reason = "other programs use the rest")]
#[path = "chain/kiosk.rs"]
mod kiosk;

use anyhow::{Result, bail, ensure};
use kiosk::{Kiosk, Part};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use tryon_kit::Config;

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

/// Services in the order in which they are ended: one behind the compositor, then the compositor itself.
const BROKEN: [Part; 2] = [Part::Cloth, Part::Compositor];

#[test]
fn a_shopper_in_chromium() -> Result<()> {
    if missing("the page in a browser", true) {
        return Ok(());
    }
    // A debug build on busy cores is slow; other tests judge lateness.
    let late = |c: &mut Config| c.compositor.garments_late_ms = 3000;
    let mut kiosk = Kiosk::with("synth", 0.0, late);
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("browser");
    let mut script = Command::new("node")
        .arg("mirror.mjs")
        .arg(format!("http://{}/", kiosk.config.compositor.address))
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
            "BREAK" => drop(kiosk.stop(BROKEN[round])),
            "MEND" => {
                kiosk.restart(BROKEN[round]);
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
