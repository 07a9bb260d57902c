//! Streams of OpenNI's cameras.

use super::{Functions, Handle, OK, OniFrame, Refusal, VideoMode, refusal};
use std::ffi::c_int;
use std::time::Duration;

/// `ONI_STATUS_TIME_OUT`.
const TIME_OUT: c_int = 102;
/// `ONI_STREAM_PROPERTY_HORIZONTAL_FOV`, `…_VERTICAL_FOV`, `…_VIDEO_MODE` and `…_MIRRORING`.
const HORIZONTAL_FOV: c_int = 1;
const VERTICAL_FOV: c_int = 2;
const VIDEO_MODE: c_int = 3;
const MIRRORING: c_int = 7;

/// A stream of an open camera. It must not outlive its device.
pub(in super::super) struct OniStream {
    functions: Functions,
    handle: Handle,
}

// SAFETY: as for the device.
unsafe impl Send for OniStream {}

impl OniStream {
    /// Owner of a stream that the library made; sets its mode, and mirroring off, where the camera has them.
    pub(super) fn new(functions: Functions, handle: Handle, mode: VideoMode) -> Self {
        let stream = Self { functions, handle };
        stream.set(VIDEO_MODE, &mode);
        stream.set::<c_int>(MIRRORING, &0);
        stream
    }

    /// Sets a property; false if the camera does not have it or refuses.
    fn set<T: Copy>(&self, property: c_int, value: &T) -> bool {
        let size = size_of::<T>() as c_int;
        // SAFETY: the stream exists; the library copies `size` bytes of the value.
        let status = unsafe {
            let value = (value as *const T).cast();
            (self.functions.oniStreamSetProperty)(self.handle, property, value, size)
        };
        status == OK
    }

    /// Value of a property of plain numbers, if the camera has it.
    fn get<T: Copy + Default>(&self, property: c_int) -> Option<T> {
        let (mut value, mut size) = (T::default(), size_of::<T>() as c_int);
        // SAFETY: the library writes at most `size` bytes, any of which are a valid `T`: ints and floats.
        let status = unsafe {
            let value = (&raw mut value).cast();
            (self.functions.oniStreamGetProperty)(self.handle, property, value, &raw mut size)
        };
        (status == OK).then_some(value)
    }

    /// The mode that is set.
    pub(in super::super) fn mode(&self) -> Option<VideoMode> {
        self.get(VIDEO_MODE)
    }

    /// Horizontal and vertical field of view, radians, if the camera states them.
    pub(in super::super) fn field_of_view(&self) -> Option<[f64; 2]> {
        let get = |property| self.get::<f32>(property).map(f64::from);
        Some([get(HORIZONTAL_FOV)?, get(VERTICAL_FOV)?])
    }

    /// Starts the images.
    ///
    /// # Errors
    /// The refused call.
    pub(in super::super) fn start(&self) -> Result<(), Refusal> {
        // SAFETY: the stream exists.
        let status = unsafe { (self.functions.oniStreamStart)(self.handle) };
        if status == OK {
            return Ok(());
        }
        Err(("oniStreamStart", refusal(&self.functions, status)))
    }

    /// Stops the images. A stopped stream stays so.
    pub(in super::super) fn stop(&self) {
        // SAFETY: the stream exists.
        unsafe { (self.functions.oniStreamStop)(self.handle) };
    }

    /// Reads the image that waits: its time, and its rows without padding.
    fn read(&self) -> Result<Image, Refusal> {
        let mut frame: *mut OniFrame = std::ptr::null_mut();
        // SAFETY: the stream exists; the library writes a frame that is ours until we release it.
        let status = unsafe { (self.functions.oniStreamReadFrame)(self.handle, &raw mut frame) };
        if status != OK || frame.is_null() {
            return Err(("oniStreamReadFrame", refusal(&self.functions, status)));
        }
        // SAFETY: the frame and the `data_size` bytes of its data are valid until it is released, after the copy.
        let image = unsafe {
            let of = &*frame;
            let size = usize::try_from(of.data_size).unwrap_or(0);
            let bytes: &[u8] = if of.data.is_null() {
                &[]
            } else {
                std::slice::from_raw_parts(of.data.cast(), size)
            };
            let image = Image {
                time_us: of.timestamp,
                width: of.width,
                height: of.height,
                stride: of.stride,
                bytes: bytes.to_vec(),
            };
            (self.functions.oniFrameRelease)(frame);
            image
        };
        Ok(image)
    }
}

impl Drop for OniStream {
    fn drop(&mut self) {
        // SAFETY: the stream exists, and nothing uses it any more.
        unsafe { (self.functions.oniStreamDestroy)(self.handle) };
    }
}

/// An image of a stream.
pub(in super::super) struct Image {
    /// Capture time, microseconds of the camera's clock.
    pub(in super::super) time_us: u64,
    pub(in super::super) width: c_int,
    pub(in super::super) height: c_int,
    /// Bytes from row to row.
    pub(in super::super) stride: c_int,
    pub(in super::super) bytes: Vec<u8>,
}

/// Waits for an image of any of the streams: its stream's index and the image, or none in time.
///
/// # Errors
/// The refused call: the camera has gone.
pub(in super::super) fn wait(
    streams: &[OniStream],
    wait: Duration,
) -> Result<Option<(usize, Image)>, Refusal> {
    let Some(f) = streams.first().map(|s| s.functions) else {
        return Ok(None);
    };
    let mut handles: Vec<Handle> = streams.iter().map(|s| s.handle).collect();
    let (count, mut index) = (handles.len() as c_int, 0);
    let wait = c_int::try_from(wait.as_millis()).unwrap_or(c_int::MAX);
    // SAFETY: the streams exist; the library reads `count` handles and writes the index.
    let status =
        unsafe { (f.oniWaitForAnyStream)(handles.as_mut_ptr(), count, &raw mut index, wait) };
    if status == TIME_OUT {
        return Ok(None);
    }
    let index = usize::try_from(index).ok().filter(|_| status == OK);
    let Some((index, stream)) = index.and_then(|i| Some((i, streams.get(i)?))) else {
        return Err(("oniWaitForAnyStream", refusal(&f, status)));
    };
    stream.read().map(|image| Some((index, image)))
}
