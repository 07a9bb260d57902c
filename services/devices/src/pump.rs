//! Thread of a camera: polls its driver, pairs its images, keeps the newest.

use super::driver::{Driver, Formats};
use super::newest::Newest;
use super::pairing::Pairing;
use super::{DeviceError, Stream};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

/// Longest time from opening to the first depth: a Kinect's projector warms up for a second or two.
const START: Duration = Duration::from_secs(5);
/// Shortest silence after which a camera counts as gone: fifteen images at 30 Hz.
const SILENCE: Duration = Duration::from_millis(500);
/// Periods of silence after which a slower camera counts as gone.
const SILENT_PERIODS: f64 = 4.0;
/// Periods after which a pair is too old to be given.
const STALE_PERIODS: f64 = 2.0;
/// Longest wait for cameras to close. A driver that hangs keeps its thread, which owns all that it touches.
const MAX_CLOSING: Duration = Duration::from_secs(1);

/// Disconnected once a camera is closed.
type Closed = Receiver<()>;

/// Cameras that are being closed.
static CLOSING: Mutex<Vec<Closed>> = Mutex::new(Vec::new());

/// A camera whose images are collected. Dropping it closes the camera, soon and without waiting.
pub(crate) struct Pump {
    pub(crate) newest: Arc<Newest>,
    closed: Option<Closed>,
}

/// Waits for the cameras that are being closed, so that they can be opened again; not for those whose driver hangs.
pub(crate) fn settle() {
    let closing = std::mem::take(&mut *CLOSING.lock().unwrap_or_else(PoisonError::into_inner));
    let end = Instant::now() + MAX_CLOSING;
    for closed in closing {
        if let Err(RecvTimeoutError::Timeout) =
            closed.recv_timeout(end.saturating_duration_since(Instant::now()))
        {
            tracing::warn!("a camera's driver hangs: its thread is abandoned");
        }
    }
}

impl Pump {
    /// Starts the thread.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(crate) fn start(
        name: &str,
        driver: Box<dyn Driver>,
        formats: &Formats,
    ) -> Result<Self, DeviceError> {
        let period = Duration::from_secs_f64(1.0 / formats.depth.rate.max(1.0));
        let newest = Arc::new(Newest::new(period.mul_f64(STALE_PERIODS)));
        let (open, closed) = channel();
        let task = Task {
            name: name.to_owned(),
            driver,
            pairing: Pairing::new(formats),
            newest: newest.clone(),
            silence: SILENCE.max(period.mul_f64(SILENT_PERIODS)),
            _open: open,
        };
        let thread = Builder::new().name("camera".into()).spawn(|| task.run());
        thread.map_err(|e| DeviceError::driver(name, "thread", e.to_string()))?;
        let closed = Some(closed);
        Ok(Self { newest, closed })
    }
}

impl Drop for Pump {
    fn drop(&mut self) {
        self.newest.close();
        let mut closing = CLOSING.lock().unwrap_or_else(PoisonError::into_inner);
        closing.extend(self.closed.take());
    }
}

/// All that the thread owns. The last field is dropped last.
struct Task {
    name: String,
    driver: Box<dyn Driver>,
    pairing: Pairing,
    newest: Arc<Newest>,
    /// Silence after which the camera counts as gone.
    silence: Duration,
    _open: Sender<()>,
}

impl Task {
    fn run(mut self) {
        let (mut last, mut patience) = (Instant::now(), START.max(self.silence));
        while !self.newest.is_closed() {
            let mut has_depth = false;
            let polled = self.driver.poll(&mut |image| {
                has_depth |= image.stream == Stream::Depth;
                self.pairing.push(image, &mut |pair| self.newest.put(pair));
            });
            if has_depth {
                (last, patience) = (Instant::now(), self.silence);
            }
            if polled.is_ok() && last.elapsed() < patience {
                continue;
            }
            let silent = || DeviceError::silent(&self.name, Stream::Depth, patience);
            self.newest.fail(polled.err().unwrap_or_else(silent));
            break;
        }
        tracing::info!(
            camera = self.name,
            dropped = self.newest.dropped(),
            unpaired = self.pairing.unpaired,
            "closing the camera"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::{Encoding, SensorImage, StreamFormat};
    use std::sync::atomic::{AtomicBool, Ordering};

    const DEPTH: Formats = Formats {
        depth: StreamFormat {
            encoding: Encoding::Depth16,
            width: 1,
            height: 1,
            rate: 30.0,
        },
        color: None,
    };

    /// Gives `images` images, then falls silent or fails; says when it is dropped.
    struct Fake {
        images: u64,
        fails: bool,
        is_dropped: Arc<AtomicBool>,
    }

    impl Driver for Fake {
        fn poll(&mut self, sink: &mut dyn FnMut(SensorImage)) -> Result<(), DeviceError> {
            std::thread::park_timeout(Duration::from_millis(5));
            if self.images == 0 {
                return if self.fails {
                    Err(DeviceError::driver("v4l2:1", "depth", "no such device"))
                } else {
                    Ok(())
                };
            }
            self.images -= 1;
            sink(SensorImage {
                stream: Stream::Depth,
                time_ns: self.images,
                bytes: vec![],
            });
            Ok(())
        }
    }

    impl Drop for Fake {
        fn drop(&mut self) {
            self.is_dropped.store(true, Ordering::SeqCst);
        }
    }

    fn start(images: u64, fails: bool) -> (Pump, Arc<AtomicBool>) {
        let is_dropped = Arc::new(AtomicBool::new(false));
        let fake = Fake {
            images,
            fails,
            is_dropped: is_dropped.clone(),
        };
        let pump = Pump::start("v4l2:1", Box::new(fake), &DEPTH).expect("a thread");
        (pump, is_dropped)
    }

    #[test]
    fn a_fault_and_a_silence_end_the_frames() {
        for (fails, why) in [(true, "no such device"), (false, "no image for 0.5 s")] {
            let (pump, _) = start(20, fails);
            let mut frames = 0;
            let fault = loop {
                match pump.newest.take() {
                    Ok(_) => frames += 1,
                    Err(fault) => break fault.to_string(),
                }
            };
            assert!(frames > 0 && fault.contains(why), "{frames} {fault}");
        }
    }

    #[test]
    fn a_dropped_camera_is_closed_before_another_is_opened() {
        let (pump, is_dropped) = start(u64::MAX, false);
        pump.newest.take().expect("an image");
        drop(pump);
        settle();
        assert!(is_dropped.load(Ordering::SeqCst));
    }

    /// Never comes back from its second poll.
    struct Hung(bool);

    impl Driver for Hung {
        fn poll(&mut self, sink: &mut dyn FnMut(SensorImage)) -> Result<(), DeviceError> {
            while std::mem::replace(&mut self.0, true) {
                std::thread::park();
            }
            sink(SensorImage {
                stream: Stream::Depth,
                time_ns: 0,
                bytes: vec![],
            });
            Ok(())
        }
    }

    #[test]
    fn a_driver_that_hangs_is_abandoned() {
        let pump = Pump::start("v4l2:1", Box::new(Hung(false)), &DEPTH).expect("a thread");
        pump.newest.take().expect("an image");
        drop(pump);
        // Both return.
        settle();
        settle();
    }
}
