//! `tryon record`: a source to MCAP or a folder.

use crate::args::RecordArgs;
use crate::input;
use crate::say::say;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;
use tryon::formats::{McapWriter, RgbdFolderWriter};
use tryon::geometry::camera::{Calibration, RgbdFrame};
use tryon_kit::auth::Auth;
use tryon_kit::bus::{Ends, ZenohBus};
use tryon_kit::client::channel;
use tryon_kit::compute::Pool;
use tryon_kit::config::Config;
use tryon_kit::consent::{self, Cameras, Lease};
use tryon_kit::frames::{CameraKey, FrameBus};
use tryon_kit::identity::Identity;
use tryon_kit::sessions::random_id;
use tryon_kit::tls::Tls;

/// Silence of a camera on the bus after which the recording fails.
const SILENCE: Duration = Duration::from_secs(5);

/// Destination of the frames.
pub(crate) enum Sink {
    /// An MCAP file.
    Mcap(Box<McapWriter>),
    /// An RGBD folder.
    Folder(Box<RgbdFolderWriter>),
}

impl Sink {
    /// A file ending in `.mcap`, or a folder.
    ///
    /// # Errors
    /// When it cannot be created.
    pub(crate) fn create(path: &Path, calibration: &Calibration) -> Result<Self> {
        if path.extension().is_some_and(|e| e == "mcap") {
            return Ok(Self::Mcap(Box::new(McapWriter::create(path, calibration)?)));
        }
        Ok(Self::Folder(Box::new(RgbdFolderWriter::create(
            path,
            calibration,
        )?)))
    }
    /// An `.mcap` file that continues the first `frames` frames of `part`.
    ///
    /// # Errors
    /// When it cannot be created, or `part` is no MCAP file.
    pub(crate) fn resume_mcap(
        path: &Path,
        part: &Path,
        calibration: &Calibration,
        frames: usize,
    ) -> Result<Self> {
        let writer = McapWriter::resume(path, part, calibration, frames)?;
        Ok(Self::Mcap(Box::new(writer)))
    }
    /// A folder, continued after its first `frames` frames.
    ///
    /// # Errors
    /// When its lists cannot be read or written.
    pub(crate) fn resume_folder(path: &Path, frames: usize) -> Result<Self> {
        Ok(Self::Folder(Box::new(RgbdFolderWriter::resume(
            path, frames,
        )?)))
    }
    /// Frames written.
    pub(crate) fn frames(&self) -> usize {
        match self {
            Self::Mcap(w) => w.frames(),
            Self::Folder(w) => w.frames(),
        }
    }
    /// Adds a frame.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn write(&mut self, frame: &RgbdFrame) -> Result<()> {
        match self {
            Self::Mcap(w) => w.write(frame)?,
            Self::Folder(w) => w.write(frame)?,
        }
        Ok(())
    }
    /// Ends the recording.
    ///
    /// # Errors
    /// When its end cannot be written; what was written before stays readable.
    pub(crate) fn finish(self) -> Result<()> {
        if let Self::Mcap(w) = self {
            w.finish()?;
        }
        Ok(())
    }
}

/// Runs the command.
///
/// # Errors
/// A source that cannot be opened, a missing consent, or a file that cannot be written.
pub(crate) fn run(args: &RecordArgs) -> Result<ExitCode> {
    let frames = match args.source.strip_prefix("bus:") {
        Some(camera) => from_bus(args, camera)?,
        None => from_source(args)?,
    };
    say(format_args!("{frames} frames in {}", args.out.display()));
    Ok(ExitCode::SUCCESS)
}

fn from_source(args: &RecordArgs) -> Result<u64> {
    let mut source = tryon_capture_service::open(&args.source)?;
    let mut sink = Sink::create(&args.out, source.calibration())?;
    let bar = input::progress(source.len().map(|n| n as u64), "recording");
    let mut first = None;
    while let Some(frame) = source.next_frame()? {
        let start = *first.get_or_insert(frame.time_ns);
        if frame.time_ns.saturating_sub(start) as f64 * 1e-9 >= args.seconds {
            break;
        }
        sink.write(&frame)?;
        bar.inc(1);
    }
    sink.finish()?;
    bar.finish_and_clear();
    Ok(bar.position())
}

/// Records a live camera, with the consent of the people in view.
fn from_bus(args: &RecordArgs, camera: &str) -> Result<u64> {
    if !args.consent {
        bail!(
            "a live camera shows people: record it only when they agreed, and say so with --consent"
        );
    }
    let key = camera
        .split_once('/')
        .and_then(|(store, camera)| CameraKey::new(store, camera));
    let key = key
        .with_context(|| format!("--source bus:{camera}: STORE/CAMERA of [a-z0-9_-] is needed"))?;
    let config = Config::load(args.config.as_deref(), &[])?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the runtime")?;
    runtime.block_on(async {
        let pool = Pool::new(1).context("threads")?;
        let identity = Identity::of(&config, "recorder", false)?;
        let ends = Ends::connecting(&config.bus, identity.as_ref());
        let bus = ZenohBus::join(&ends, pool).await?;
        let bus: Arc<dyn FrameBus> = bus;
        let mut frames = bus.subscribe(&key).await?;
        let tls = Tls::inside(&config, identity.as_ref())?;
        let channel = channel(&config.compositor.capture, &tls).map_err(anyhow::Error::msg)?;
        let lease = Lease {
            camera: key.clone(),
            holder: random_id(),
        };
        let ((recording, is_recording), (keys, _)) = (watch::channel(true), watch::channel(None));
        let auth = Auth::open(&config, None)?;
        let cameras = Cameras::new(auth.credentials().present(channel));
        let consent = consent::keep(cameras, lease, bus.clone(), is_recording, keys);
        let consent = tokio::spawn(consent);
        let bar = input::progress(None, "recording");
        let end = tokio::time::Instant::now() + Duration::from_secs_f64(args.seconds);
        let mut sink: Option<Sink> = None;
        while tokio::time::Instant::now() < end {
            let next = tokio::time::timeout(SILENCE, frames.next()).await;
            let Some(exposure) = next.with_context(|| format!("camera {camera} is silent"))? else {
                break;
            };
            // Disk work stays off the async workers.
            tokio::task::block_in_place(|| {
                if sink.is_none() {
                    sink = Some(Sink::create(&args.out, &exposure.calibration)?);
                }
                sink.as_mut().map_or(Ok(()), |s| s.write(&exposure.rgbd))
            })?;
            bar.inc(1);
        }
        drop(recording);
        consent.await.context("the lease of consent")??;
        bar.finish_and_clear();
        if let Some(sink) = sink {
            sink.finish()?;
        }
        Ok(bar.position())
    })
}
