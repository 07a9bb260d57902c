//! The eye for colour on a thread of its own: no frame waits for it.

use crate::color_eye::{COLOR_INTERVAL, ColorEye, ColorEyeError};
use crate::sighting::ColorSighting;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use tryon_geometry::camera::{Calibration, RgbdFrame};
use tryon_landmarks::Landmarker;

/// A [`ColorEye`] that looks at every fourth frame, or less often where it is slower. Its thread ends with it.
pub struct BackgroundEye {
    frames: SyncSender<RgbdFrame>,
    seen: Receiver<Result<Option<ColorSighting>, ColorEyeError>>,
    is_looking: bool,
    /// Frames since the last one that it was given.
    since: u64,
}

impl BackgroundEye {
    /// Starts the thread; the eye's tables are made there.
    ///
    /// # Errors
    /// Of the operating system, which refuses a thread.
    pub fn start(landmarker: Landmarker, calibration: Calibration) -> std::io::Result<Self> {
        let (frames, inbox) = sync_channel::<RgbdFrame>(1);
        let (outbox, seen) = sync_channel(1);
        let look = move || {
            let mut eye = ColorEye::new(landmarker, calibration);
            while let Ok(frame) = inbox.recv() {
                if outbox.send(eye.look(&frame)).is_err() {
                    break;
                }
            }
        };
        std::thread::Builder::new()
            .name("color eye".into())
            .spawn(look)?;
        Ok(Self {
            frames,
            seen,
            is_looking: false,
            since: COLOR_INTERVAL,
        })
    }

    /// Takes what was seen since the last call and gives the eye this frame if it is free and one is due. A frame with
    /// colour is copied.
    ///
    /// # Errors
    /// [`ColorEyeError`] of the last look.
    pub fn exchange(&mut self, frame: &RgbdFrame) -> Result<Option<ColorSighting>, ColorEyeError> {
        let seen = match self.seen.try_recv() {
            Ok(seen) => {
                self.is_looking = false;
                seen
            }
            // A thread that is gone sees nothing any more.
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => Ok(None),
        };
        self.since = self.since.saturating_add(1);
        let is_due = !self.is_looking && self.since >= COLOR_INTERVAL && frame.color.is_some();
        if is_due && self.frames.try_send(frame.clone()).is_ok() {
            (self.is_looking, self.since) = (true, 0);
        }
        seen
    }
}
