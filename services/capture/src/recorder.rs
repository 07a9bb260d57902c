//! Recording to a file on a thread of its own, which the camera does not wait for.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use tonic::Status;
use tryon::camera::Calibration;
use tryon::formats::McapWriter;
use tryon_kit::frames::Exposure;

/// Frames that wait for the disk: half a second at 30 a second, 20 MB of shared images.
const WAITING: usize = 16;

/// A finished recording.
pub(crate) struct Recording {
    pub(crate) file: String,
    pub(crate) frames: u64,
    pub(crate) dropped: u64,
}

struct Active {
    name: String,
    frames: SyncSender<Arc<Exposure>>,
    dropped: Arc<AtomicU64>,
    writer: std::thread::JoinHandle<Result<u64, String>>,
}

/// Recording of one camera, if one is under way. Clones share it.
#[derive(Clone, Default)]
pub(crate) struct Recorder(Arc<Mutex<Option<Active>>>);

impl Recorder {
    fn with<R>(&self, f: impl FnOnce(&mut Option<Active>) -> R) -> R {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Begins a file.
    pub(crate) async fn begin(
        &self,
        path: PathBuf,
        calibration: Calibration,
    ) -> Result<(), Status> {
        if self.with(|a| a.is_some()) {
            return Err(Status::failed_precondition("a recording is under way"));
        }
        let name = path
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        let (frames, inbox) = sync_channel(WAITING);
        let thread = std::thread::Builder::new().name("recorder".into());
        let writer = thread.spawn(move || write(&path, &calibration, &inbox));
        let writer = writer.map_err(|e| Status::internal(format!("recorder: {e}")))?;
        self.with(|a| {
            *a = Some(Active {
                name,
                frames,
                dropped: Arc::default(),
                writer,
            })
        });
        Ok(())
    }

    /// Queues a frame, or counts it as dropped: the camera never waits.
    pub(crate) fn offer(&self, exposure: &Arc<Exposure>) {
        self.with(|a| {
            if let Some(a) = a
                && a.frames.try_send(exposure.clone()).is_err()
            {
                a.dropped.fetch_add(1, Ordering::Relaxed);
            }
        });
    }

    /// Finishes the file.
    pub(crate) async fn end(&self) -> Result<Recording, Status> {
        let Some(a) = self.with(Option::take) else {
            return Err(Status::failed_precondition("nothing is being recorded"));
        };
        let Active {
            name,
            frames,
            dropped,
            writer,
        } = a;
        drop(frames);
        let done = tokio::task::spawn_blocking(move || writer.join()).await;
        let fault = |why: String| Status::data_loss(format!("{name}: {why}"));
        let frames = match done {
            Ok(Ok(Ok(n))) => n,
            Ok(Ok(Err(why))) => return Err(fault(why)),
            _ => return Err(fault("the writer panicked".into())),
        };
        Ok(Recording {
            file: name,
            frames,
            dropped: dropped.load(Ordering::Relaxed),
        })
    }
}

fn write(
    path: &Path,
    calibration: &Calibration,
    inbox: &Receiver<Arc<Exposure>>,
) -> Result<u64, String> {
    let mut file = McapWriter::create(path, calibration).map_err(|e| e.to_string())?;
    for e in inbox {
        file.write(&e.rgbd).map_err(|e| e.to_string())?;
    }
    let frames = file.frames() as u64;
    file.finish().map_err(|e| e.to_string())?;
    Ok(frames)
}
