//! Recording to a file on a thread of its own, which the camera does not wait for.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use tonic::Status;
use tryon_formats::{FormatError, McapWriter};
use tryon_geometry::camera::Calibration;
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
    writer: std::thread::JoinHandle<Result<u64, FormatError>>,
}

/// Recording of one camera, if one is under way. Clones share it.
#[derive(Clone, Default)]
pub(crate) struct Recorder(Arc<Mutex<Option<Active>>>);

impl Recorder {
    fn with<R>(&self, f: impl FnOnce(&mut Option<Active>) -> R) -> R {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Begins a file.
    ///
    /// # Errors
    /// A recording under way, or a file that cannot be made: RESOURCE_EXHAUSTED on a full disk.
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
        let create = move || McapWriter::create(&path, &calibration);
        let created = tokio::task::spawn_blocking(create).await;
        let file = created
            .map_err(|e| Status::internal(format!("recorder: {e}")))?
            .map_err(|e| status(&name, &e))?;
        let (frames, inbox) = sync_channel(WAITING);
        let thread = std::thread::Builder::new().name("recorder".into());
        let writer = thread.spawn(move || write(file, &inbox));
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

    /// Queues a frame, or counts it as dropped: the camera never waits. False once the writer has failed, such as on a
    /// full disk; [`Self::end`] tells why.
    pub(crate) fn offer(&self, exposure: &Arc<Exposure>) -> bool {
        self.with(|a| {
            let Some(a) = a else { return true };
            match a.frames.try_send(exposure.clone()) {
                Ok(()) => true,
                Err(e) => {
                    a.dropped.fetch_add(1, Ordering::Relaxed);
                    matches!(e, TrySendError::Full(_))
                }
            }
        })
    }

    /// Finishes the file.
    ///
    /// # Errors
    /// No recording, or one that could not be written to its end: RESOURCE_EXHAUSTED on a full disk, else DATA_LOSS. The
    /// file stays, and is read up to its last whole frame.
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
        let frames = match done {
            Ok(Ok(Ok(n))) => n,
            Ok(Ok(Err(e))) => return Err(status(&name, &e)),
            _ => return Err(Status::data_loss(format!("{name}: the writer panicked"))),
        };
        Ok(Recording {
            file: name,
            frames,
            dropped: dropped.load(Ordering::Relaxed),
        })
    }
}

/// Status of a recording that cannot go on; names the file, not its folder.
fn status(name: &str, e: &FormatError) -> Status {
    use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    match e {
        FormatError::Io { why, .. } => {
            let text = format!("{name}: {why}");
            match why.kind() {
                StorageFull | QuotaExceeded | FileTooLarge => Status::resource_exhausted(text),
                _ => Status::data_loss(text),
            }
        }
        FormatError::Field { field, why, .. } => {
            Status::data_loss(format!("{name}: `{field}`: {why}"))
        }
    }
}

fn write(mut file: McapWriter, inbox: &Receiver<Arc<Exposure>>) -> Result<u64, FormatError> {
    for e in inbox {
        file.write(&e.rgbd)?;
    }
    let frames = file.frames() as u64;
    file.finish()?;
    Ok(frames)
}
