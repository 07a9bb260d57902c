//! A running camera of libfreenect.

use super::{Context, FrameMode, Handle, Refusal, Timeval};
use crate::Stream;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::ffi::{c_int, c_long, c_void};
use std::time::Duration;

/// Images kept of one call of the library.
const MAX_IMAGES: usize = 8;

/// An image of the library: stream, time in ticks of the camera's clock, bytes.
pub(in super::super) type Image = (Stream, u32, Vec<u8>);

/// Images of one poll.
struct Inbox {
    depth_bytes: usize,
    color_bytes: usize,
    images: VecDeque<Image>,
}

impl Inbox {
    fn new(depth: FrameMode, color: FrameMode) -> Self {
        let bytes = |mode: FrameMode| usize::try_from(mode.bytes).unwrap_or(0);
        Self {
            depth_bytes: bytes(depth),
            color_bytes: bytes(color),
            images: VecDeque::new(),
        }
    }
}

thread_local! {
    /// Inbox of the camera that this thread polls: the library calls back from within the poll.
    static POLLED: RefCell<Option<Inbox>> = const { RefCell::new(None) };
}

extern "C" fn on_depth(_: Handle, image: *mut c_void, ticks: u32) {
    receive(Stream::Depth, image, ticks);
}

extern "C" fn on_color(_: Handle, image: *mut c_void, ticks: u32) {
    receive(Stream::Color, image, ticks);
}

/// Copies an image; outside of a poll it is left out.
fn receive(stream: Stream, image: *const c_void, ticks: u32) {
    let copy = |polled: &RefCell<Option<Inbox>>| {
        let Ok(mut polled) = polled.try_borrow_mut() else {
            return;
        };
        let Some(inbox) = polled.as_mut().filter(|_| !image.is_null()) else {
            return;
        };
        let bytes = match stream {
            Stream::Depth => inbox.depth_bytes,
            Stream::Color => inbox.color_bytes,
        };
        // SAFETY: the library's buffer has the bytes of the stream's mode, and is not written during the callback.
        let bytes = unsafe { std::slice::from_raw_parts(image.cast::<u8>(), bytes) };
        if inbox.images.len() == MAX_IMAGES {
            inbox.images.pop_front();
        }
        inbox.images.push_back((stream, ticks, bytes.to_vec()));
    };
    let _ = POLLED.try_with(copy);
}

/// A camera whose streams run.
pub(in super::super) struct Camera {
    device: Handle,
    depth: FrameMode,
    color: FrameMode,
    context: Context,
}

// SAFETY: as for its context.
unsafe impl Send for Camera {}

impl Camera {
    /// Starts both streams of an open device.
    ///
    /// # Errors
    /// The refused call; the device is closed.
    pub(super) fn start(
        context: Context,
        device: Handle,
        depth: FrameMode,
        color: FrameMode,
    ) -> Result<Self, Refusal> {
        let f = context.functions;
        let camera = Self {
            device,
            depth,
            color,
            context,
        };
        // SAFETY: the device is open, the callbacks are functions of this program, and the modes the library's own.
        let steps = unsafe {
            (f.freenect_set_depth_callback)(device, on_depth);
            (f.freenect_set_video_callback)(device, on_color);
            [
                (
                    "freenect_set_depth_mode",
                    (f.freenect_set_depth_mode)(device, depth),
                ),
                (
                    "freenect_set_video_mode",
                    (f.freenect_set_video_mode)(device, color),
                ),
                ("freenect_start_depth", (f.freenect_start_depth)(device)),
                ("freenect_start_video", (f.freenect_start_video)(device)),
            ]
        };
        match steps.into_iter().find(|(_, code)| *code < 0) {
            Some(refused) => Err(refused),
            None => Ok(camera),
        }
    }

    /// Handles events for at most `wait`, and returns the images of it.
    ///
    /// # Errors
    /// The library's answer once the camera has gone.
    pub(in super::super) fn poll(&mut self, wait: Duration) -> Result<VecDeque<Image>, c_int> {
        let mut wait = Timeval {
            seconds: c_long::try_from(wait.as_secs()).unwrap_or(0),
            microseconds: c_long::from(wait.subsec_micros().cast_signed()),
        };
        let (f, context) = (&self.context.functions, self.context.context);
        POLLED.set(Some(Inbox::new(self.depth, self.color)));
        // SAFETY: the context is initialised; the library only reads the time.
        let code = unsafe { (f.freenect_process_events_timeout)(context, &raw mut wait) };
        let images = POLLED.take().map(|inbox| inbox.images);
        if code < 0 {
            return Err(code);
        }
        Ok(images.unwrap_or_default())
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        let f = &self.context.functions;
        // SAFETY: the device is open and of this context, which is closed after it.
        unsafe {
            (f.freenect_stop_depth)(self.device);
            (f.freenect_stop_video)(self.device);
            (f.freenect_close_device)(self.device);
        }
    }
}
