//! `tryon doctor`: capabilities of this machine and expected faults.

use crate::args::DoctorArgs;
use crate::{cameras, findings};
use anyhow::Result;
use std::net::TcpListener;
use std::path::Path;
use std::process::ExitCode;
use tryon::inspection::{Finding, Rating};

/// Runs the command. Exit code 1 when something will fail.
///
/// # Errors
/// Only when the report cannot be printed.
pub(crate) fn run(args: &DoctorArgs) -> Result<ExitCode> {
    let mut all = vec![cores(), memory(), body(), adapter(), port(8080)];
    all.extend(cameras::findings(&tryon_devices::list()));
    all.push(shared_data());
    if args.json {
        findings::print_json(&all)?;
    } else {
        findings::print(&all);
    }
    Ok(findings::exit_code(&all))
}

fn cores() -> Finding {
    let n = std::thread::available_parallelism().map_or(1, usize::from);
    let verdict = if n >= 2 { Rating::Good } else { Rating::Note };
    Finding {
        what: "cores",
        verdict,
        detail: format!("{n}; the chain is built for two"),
    }
}

fn memory() -> Finding {
    const WANTED_MIB: u64 = 1024;
    let available = std::fs::read_to_string("/proc/meminfo").ok().and_then(|t| {
        let line = t
            .lines()
            .find(|l| l.starts_with("MemAvailable:"))?
            .to_owned();
        line.split_whitespace()
            .nth(1)?
            .parse::<u64>()
            .ok()
            .map(|kib| kib / 1024)
    });
    match available {
        Some(mib) if mib >= WANTED_MIB => Finding {
            what: "memory",
            verdict: Rating::Good,
            detail: format!("{mib} MiB available"),
        },
        Some(mib) => Finding {
            what: "memory",
            verdict: Rating::Note,
            detail: format!(
                "{mib} MiB available; the chain of one box is measured against 500 MiB, leave it {WANTED_MIB}"
            ),
        },
        None => Finding {
            what: "memory",
            verdict: Rating::Note,
            detail: "this system does not tell".into(),
        },
    }
}

fn body() -> Finding {
    let t = tryon::body::embedded::template();
    let detail = format!(
        "embedded body: {} vertices, {} joints",
        t.mesh().vertices().len(),
        t.skeleton().len()
    );
    Finding {
        what: "body",
        verdict: Rating::Good,
        detail,
    }
}

fn adapter() -> Finding {
    match tryon::view::gpu::adapters() {
        list if list.is_empty() => Finding {
            what: "graphics",
            verdict: Rating::Note,
            detail: "no wgpu adapter: pictures are drawn on the CPU, which needs nothing else"
                .into(),
        },
        list => {
            let names = list.iter().map(|a| {
                let kind = if a.software {
                    "software: pictures are drawn on the CPU"
                } else {
                    "hardware"
                };
                format!("{} ({}, {kind})", a.name, a.backend)
            });
            Finding {
                what: "graphics",
                verdict: Rating::Good,
                detail: names.collect::<Vec<_>>().join("; "),
            }
        }
    }
}

fn port(number: u16) -> Finding {
    match TcpListener::bind(("127.0.0.1", number)) {
        Ok(_) => Finding {
            what: "port",
            verdict: Rating::Good,
            detail: format!("{number} is free for the mirror page"),
        },
        Err(e) => Finding {
            what: "port",
            verdict: Rating::Note,
            detail: format!(
                "{number}: {e}; start the demo with --listen 127.0.0.1:0 or another port"
            ),
        },
    }
}

fn shared_data() -> Finding {
    let root = std::env::var("TRYON_SHARED").unwrap_or_else(|_| "../shared".into());
    let found = Path::new(&root).join("data").join("README.md").exists();
    let detail = if found {
        format!("{root}/data: tests on real recordings run")
    } else {
        format!("{root}/data is missing: tests on real recordings are skipped (set TRYON_SHARED)")
    };
    Finding {
        what: "shared data",
        verdict: if found { Rating::Good } else { Rating::Note },
        detail,
    }
}
