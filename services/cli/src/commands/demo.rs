//! `tryon demo`: the whole chain in one process on a display figure.

use crate::args::DemoArgs;
use crate::onebox::OneBox;
use crate::report::{Summary, peak_memory, write};
use crate::say::say;
use crate::viewer::{self, Received, ReceivedPicture};
use crate::{input, report};
use anyhow::{Context, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use tryon::garment::{Size, library};
use tryon_kit::config::{Config, LogConfig};
use tryon_kit::drain;
use tryon_kit::telemetry;

/// Length of a headless run without --seconds (s).
const HEADLESS_SECONDS: f64 = 10.0;

/// report.json of a headless demo.
#[derive(Debug, Serialize)]
struct Report {
    /// Seconds from the first picture to the last.
    seconds: f64,
    /// Exposures that the camera published in that time, counted by sequence.
    frames_in: u64,
    /// Pictures received.
    frames_out: usize,
    /// Pictures that showed the garments on the person.
    frames_live: usize,
    /// Exposures that became no picture: newest wins at every queue.
    drops: u64,
    /// Pictures a second.
    rate: f64,
    /// Pictures a second while live.
    live_rate: f64,
    /// Seconds from opening the try-on to the first live picture: finding, calibrating, dressing.
    first_live_seconds: Option<f64>,
    /// Seconds from the first picture to the first live one.
    dressed_after_seconds: Option<f64>,
    /// From the reception of the exposure by the capture service to the arrival of the picture, milliseconds.
    latency_ms: Summary,
    /// Latency of live pictures, milliseconds.
    live_latency_ms: Summary,
    /// Milliseconds by stage, live pictures only.
    stages_ms: BTreeMap<String, Summary>,
    /// Skipped work by service and kind, over the whole run.
    skipped: BTreeMap<String, f64>,
    /// Counters of all services.
    counters: BTreeMap<String, f64>,
    /// Number of messages in each state.
    states: BTreeMap<String, usize>,
    garments: Vec<String>,
    peak_memory_bytes: Option<u64>,
}

/// Runs the command.
///
/// # Errors
/// When a service cannot start or a result cannot be written.
pub(crate) fn run(args: &DemoArgs) -> Result<ExitCode> {
    // The names of a folder are those under which the cloth service offers its garments.
    if args.wardrobe.is_none() {
        for name in &args.garments {
            library::pattern(name, Size::default())?;
        }
    }
    // The recorder must be installed before the first counter.
    let _ = telemetry::metrics();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the runtime")?;
    let outcome = runtime.block_on(demo(args));
    runtime.shutdown_timeout(Duration::from_millis(200));
    outcome
}

fn configuration(args: &DemoArgs) -> Result<Config> {
    let any_port = std::net::SocketAddr::from(([127, 0, 0, 1], 0));
    let mut c = Config {
        log: LogConfig {
            level: "warn".into(),
            ..LogConfig::default()
        },
        ..Config::default()
    };
    c.process.insecure = args.insecure;
    (c.capture.address, c.capture.admin) = (any_port, any_port);
    (c.tracking.address, c.tracking.admin) = (any_port, any_port);
    (c.cloth.address, c.cloth.admin) = (any_port, any_port);
    c.cloth.garments = args.wardrobe.clone().unwrap_or_default();
    c.compositor.admin = any_port;
    c.compositor.address = if args.headless { any_port } else { args.listen };
    for camera in &mut c.capture.cameras {
        camera.rate = args.fps;
        if let Some(recording) = &args.input {
            camera.source = recording
                .to_str()
                .context("--input: the path is not UTF-8")?
                .to_owned();
        }
    }
    c.validate()?;
    Ok(c)
}

async fn demo(args: &DemoArgs) -> Result<ExitCode> {
    let services = OneBox::start(configuration(args)?, None).await?;
    if args.headless {
        let seconds = args.seconds.unwrap_or(HEADLESS_SECONDS);
        input::create_dir(&args.out)?;
        say(format_args!(
            "headless: {seconds} s of {} into {}",
            args.garments.join(" and "),
            args.out.display()
        ));
        let received = viewer::watch(
            services.compositor()?,
            &args.garments,
            Duration::from_secs_f64(seconds),
            &args.out,
        )
        .await;
        services.stop().await;
        return summarise(args, &received?);
    }
    let page = services.page().unwrap_or_default();
    say(format_args!(
        "The mirror is open at {page} (Ctrl-C ends it)"
    ));
    let started = Instant::now();
    let limit = args.seconds.map_or(Duration::MAX, Duration::from_secs_f64);
    tokio::select! {
        signal = drain::signal() => say(format_args!("{}: draining", signal.context("signals")?)),
        () = tokio::time::sleep(limit) => say(format_args!("{:.1} s are over: draining", started.elapsed().as_secs_f64())),
    }
    services.stop().await;
    Ok(ExitCode::SUCCESS)
}

/// Start of the counters of skipped work on the metrics page.
const SKIPPED: &str = "tryon_skipped{";

/// Counters of skipped work as `service: kind`.
fn skipped(counters: &BTreeMap<String, f64>) -> BTreeMap<String, f64> {
    let label = |k: &str, name: &str| {
        let after = k.split_once(&format!("{name}=\""))?.1;
        Some(after.split_once('"')?.0.to_owned())
    };
    (counters.iter().filter(|(k, _)| k.starts_with(SKIPPED)))
        .filter_map(|(k, v)| {
            Some((
                format!("{}: {}", label(k, "service")?, label(k, "what")?),
                *v,
            ))
        })
        .collect()
}

fn summarise(args: &DemoArgs, received: &Received) -> Result<ExitCode> {
    let live: Vec<_> = received.pictures.iter().filter(|p| p.live).collect();
    let all_ms: Vec<f64> = received.pictures.iter().map(|p| p.latency_ms).collect();
    let live_ms: Vec<f64> = live.iter().map(|p| p.latency_ms).collect();
    let mut stages = report::Samples::default();
    live.iter()
        .for_each(|p| stages.extend(p.stages.iter().map(|(n, ms)| (n.as_str(), *ms))));
    let span = |v: &[&ReceivedPicture]| match (v.first(), v.last()) {
        (Some(a), Some(b)) => b.at - a.at,
        _ => 0.0,
    };
    let rate = |v: &[&ReceivedPicture]| {
        if span(v) > 0.0 {
            (v.len() - 1) as f64 / span(v)
        } else {
            0.0
        }
    };
    let everything: Vec<_> = received.pictures.iter().collect();
    let frames_in = match (everything.first(), everything.last()) {
        (Some(a), Some(b)) => b.sequence.saturating_sub(a.sequence) + 1,
        _ => 0,
    };
    let r = Report {
        seconds: span(&everything),
        frames_in,
        frames_out: everything.len(),
        frames_live: live.len(),
        drops: frames_in.saturating_sub(everything.len() as u64),
        rate: rate(&everything),
        live_rate: rate(&live),
        first_live_seconds: live.first().map(|p| p.at),
        dressed_after_seconds: live
            .first()
            .zip(everything.first())
            .map(|(l, p)| l.at - p.at),
        latency_ms: Summary::of(&all_ms),
        live_latency_ms: Summary::of(&live_ms),
        stages_ms: stages.summaries(),
        skipped: skipped(&received.counters),
        counters: received
            .counters
            .iter()
            .filter(|(k, _)| !k.starts_with(SKIPPED))
            .map(|(k, v)| (k.clone(), *v))
            .collect(),
        states: received.states.clone(),
        garments: args.garments.clone(),
        peak_memory_bytes: peak_memory(),
    };
    write(&args.out.join("report.json"), &r)?;
    say(format_args!(
        "{} frames in, {} pictures ({} live), {} dropped; live {:.1} a second, latency p50 {:.0} ms p99 {:.0} ms; {:.0} MiB",
        r.frames_in,
        r.frames_out,
        r.frames_live,
        r.drops,
        r.live_rate,
        r.live_latency_ms.p50,
        r.live_latency_ms.p99,
        r.peak_memory_bytes.unwrap_or(0) as f64 / (1024.0 * 1024.0)
    ));
    say(format_args!(
        "{} pictures and report.json in {}",
        received.kept,
        args.out.display()
    ));
    if r.frames_live == 0 {
        eprintln!("tryon: no live picture came; report.json says which states were seen");
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}
