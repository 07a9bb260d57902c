//! `tryon fine`: a live session's garments on finer meshes, simulated by a running cloth service.

mod files;
mod outfit;
mod progress;
mod report;
mod service;

use crate::args::FineSessionArgs;
use crate::input;
use crate::interrupt::{INTERRUPTED, Interrupt};
use crate::say::say;
use anyhow::{Context, Result, ensure};
use files::FineFiles;
use progress::FineProgress;
use report::FineReport;
use service::FineService;
use std::borrow::Cow;
use std::process::ExitCode;
use tryon_kit::config::Config;
use tryon_kit::simulations::FrameOrder;
use tryon_proto::convert::simulation::garments_from_wire;
use tryon_proto::v1::start_simulation_request::Start;
use tryon_proto::v1::{SessionStart, StartSimulationRequest, StartSimulationResponse};

/// Runs the command.
///
/// # Errors
/// A configuration at fault, a refusal of the service, an error of the simulation, a connection that stays lost, or files that
/// cannot be read or written. Frames that arrived before stay.
pub(crate) fn run(args: &FineSessionArgs) -> Result<ExitCode> {
    let config = Config::load(args.config.as_deref(), &[])?;
    input::create_dir(&args.out)?;
    let interrupt = Interrupt::watch()?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the runtime")?;
    runtime.block_on(simulate(args, &config, &interrupt))
}

/// Starts a simulation or continues one, and receives it.
async fn simulate(
    args: &FineSessionArgs,
    config: &Config,
    interrupt: &Interrupt,
) -> Result<ExitCode> {
    let service = FineService::connect(config)?;
    let earlier = args.simulation.as_deref();
    // Read before the start: a simulation continues once.
    let earlier = earlier.map(|id| FineFiles::open(&args.out, id).map(|files| (id, files)));
    let earlier = earlier.transpose()?;
    let started = service.start(start(args)).await?;

    let received = receive(args, &service, &started, earlier, interrupt).await;
    let id = &started.simulation_id;
    if received.is_err() {
        service.abandon(id).await;
    }
    let received = received.with_context(|| format!("simulation {id}"))?;
    let (frames, out) = (received.frames, args.out.display());
    let outfit = if frames > 0 { ", outfit.glb" } else { "" };
    say(format_args!(
        "{frames} frames of {} vertices: positions.npy{outfit} and report.json in {out}",
        started.vertex_count
    ));
    if received.is_whole {
        return Ok(ExitCode::SUCCESS);
    }
    say(format_args!(
        "cancelled; within ten minutes, while the session knows the body, this continues it:\n{}",
        continuation(args, id)
    ));
    Ok(ExitCode::from(INTERRUPTED))
}

/// Request of the arguments.
fn start(args: &FineSessionArgs) -> StartSimulationRequest {
    let start = match (&args.simulation, &args.session) {
        (Some(id), _) => Some(Start::SimulationId(id.clone())),
        (None, session) => session.as_ref().map(|id| {
            Start::Session(SessionStart {
                session_id: id.clone(),
                vertices: args.vertices,
                motion_seconds: args.seconds,
            })
        }),
    };
    StartSimulationRequest {
        start,
        ..Default::default()
    }
}

/// Outcome of a simulation that did not fail.
struct Received {
    /// Frames in the files.
    frames: usize,
    /// False after a cancel.
    is_whole: bool,
}

/// Receives a simulation into the files: new ones, or those of the cancelled one that it continues, whose id comes with them.
/// The frames before an error are in the files too.
async fn receive(
    args: &FineSessionArgs,
    service: &FineService,
    started: &StartSimulationResponse,
    earlier: Option<(&str, FineFiles)>,
    interrupt: &Interrupt,
) -> Result<Received> {
    let garments = garments_from_wire(started)?;
    let (cancelled, mut files) = match earlier {
        Some((id, files)) => {
            let files = files.continued(&started.simulation_id, &garments)?;
            (Some(id), files)
        }
        None => {
            let report = FineReport::new(started, &garments)?;
            (None, FineFiles::create(&args.out, report)?)
        }
    };
    let mut order = FrameOrder::new(files.vertices(), files.len() as u32);
    let followed = follow(service, started, cancelled, &mut order, &mut files);
    let followed = or_cancel(service, &started.simulation_id, followed, interrupt).await;

    let finished = files.finish(&garments);
    followed?;
    finished?;
    Ok(Received {
        frames: files.len(),
        is_whole: order.is_whole(),
    })
}

/// Follows a simulation, after the frames of the cancelled one before it that are missing.
async fn follow(
    service: &FineService,
    started: &StartSimulationResponse,
    cancelled: Option<&str>,
    order: &mut FrameOrder,
    files: &mut FineFiles,
) -> Result<()> {
    let mut progress = FineProgress::new();
    let first = started.first_frame;
    if let Some(id) = cancelled.filter(|_| order.next() < first) {
        service.follow(id, order, files, &mut progress).await?;
    }
    let next = order.next();
    ensure!(
        next == first,
        "it goes on with frame {first}, but {next} frames came before"
    );
    order.expect(started.frame_count);
    let id = &started.simulation_id;
    service.follow(id, order, files, &mut progress).await
}

/// Waits for the end of `followed`; after Ctrl-C cancels the simulation, which ends it.
async fn or_cancel(
    service: &FineService,
    id: &str,
    followed: impl Future<Output = Result<()>>,
    interrupt: &Interrupt,
) -> Result<()> {
    let cancelled = async {
        interrupt.asked().await;
        service.cancel(id).await
    };
    tokio::pin!(followed);
    tokio::select! {
        ended = &mut followed => return ended,
        cancelled = cancelled => cancelled?,
    }
    followed.await
}

/// Command that continues a cancelled simulation.
fn continuation(args: &FineSessionArgs, id: &str) -> String {
    let out = args.out.to_string_lossy();
    let mut words = vec!["tryon", "fine", "--simulation", id, "--out", &out];
    let config = args.config.as_ref().map(|c| c.to_string_lossy());
    if let Some(config) = &config {
        words.extend(["--config", config]);
    }
    let words: Vec<_> = words.into_iter().map(shell_word).collect();
    words.join(" ")
}

/// One word of a POSIX shell.
fn shell_word(text: &str) -> Cow<'_, str> {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(format!("'{}'", text.replace('\'', r"'\''")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_that_continues_is_one_of_a_shell() {
        let args = FineSessionArgs {
            session: Some("mine".into()),
            simulation: None,
            out: "out/the dress".into(),
            vertices: 2000,
            seconds: 1.0,
            config: Some("a'b.toml".into()),
        };
        let command = continuation(&args, "0af3");
        let expected = r"tryon fine --simulation 0af3 --out 'out/the dress' --config 'a'\''b.toml'";
        assert_eq!(command, expected);
    }
}
