//! C interface of libfreenect 0.5 (libfreenect.h), as safe owners of its context and camera.
#![allow(unsafe_code)] // C functions: each call has its reason

mod camera;

pub(super) use camera::Camera;

use crate::library::{functions, load};
use crate::{DeviceError, Family, Stream};
use libloading::Library;
use std::ffi::{CStr, CString, c_char, c_int, c_long, c_void};

/// `FREENECT_RESOLUTION_MEDIUM`: 640×480.
pub(super) const MEDIUM: c_int = 1;
/// `FREENECT_VIDEO_RGB`.
pub(super) const VIDEO_RGB: i32 = 0;
/// `FREENECT_DEPTH_11BIT`: raw disparity.
pub(super) const DEPTH_11BIT: i32 = 0;
/// `FREENECT_DEPTH_REGISTERED`: millimetres in the colour camera's image.
pub(super) const DEPTH_REGISTERED: i32 = 4;
/// `FREENECT_DEVICE_CAMERA`: without motor and microphones, which newer models refuse.
const SUBDEVICE_CAMERA: c_int = 2;
/// `FREENECT_LOG_ERROR`.
const LOG_ERROR: c_int = 1;

/// `freenect_frame_mode`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FrameMode {
    reserved: u32,
    pub(super) resolution: c_int,
    /// `freenect_video_format` or `freenect_depth_format`.
    pub(super) format: i32,
    /// Bytes of an image.
    pub(super) bytes: i32,
    pub(super) width: i16,
    pub(super) height: i16,
    data_bits_per_pixel: i8,
    padding_bits_per_pixel: i8,
    /// Images a second.
    pub(super) framerate: i8,
    pub(super) is_valid: i8,
}

/// `struct freenect_device_attributes`.
#[repr(C)]
struct Attributes {
    next: *mut Attributes,
    camera_serial: *const c_char,
}

/// `struct timeval`.
#[repr(C)]
struct Timeval {
    seconds: c_long,
    microseconds: c_long,
}

/// A refused call and the library's answer.
pub(super) type Refusal = (&'static str, c_int);

/// Opaque `freenect_context` and `freenect_device`.
type Handle = *mut c_void;
/// `freenect_depth_cb` and `freenect_video_cb`.
type Callback = extern "C" fn(Handle, *mut c_void, u32);

functions! {
    /// Functions of libfreenect.h.
    Functions {
        freenect_init(*mut Handle, *mut c_void) -> c_int;
        freenect_shutdown(Handle) -> c_int;
        freenect_set_log_level(Handle, c_int);
        freenect_select_subdevices(Handle, c_int);
        freenect_num_devices(Handle) -> c_int;
        freenect_process_events_timeout(Handle, *mut Timeval) -> c_int;
        freenect_open_device_by_camera_serial(Handle, *mut Handle, *const c_char) -> c_int;
        freenect_close_device(Handle) -> c_int;
        freenect_set_depth_callback(Handle, Callback);
        freenect_set_video_callback(Handle, Callback);
        freenect_get_depth_mode_count() -> c_int;
        freenect_get_depth_mode(c_int) -> FrameMode;
        freenect_get_video_mode_count() -> c_int;
        freenect_get_video_mode(c_int) -> FrameMode;
        freenect_set_depth_mode(Handle, FrameMode) -> c_int;
        freenect_set_video_mode(Handle, FrameMode) -> c_int;
        freenect_start_depth(Handle) -> c_int;
        freenect_start_video(Handle) -> c_int;
        freenect_stop_depth(Handle) -> c_int;
        freenect_stop_video(Handle) -> c_int;
    }
}

functions! {
    /// Functions that the library's replay (fakenect) lacks.
    ListFunctions {
        freenect_list_device_attributes(Handle, *mut *mut Attributes) -> c_int;
        freenect_free_device_attributes(*mut Attributes);
    }
}

/// A fault of the library as a whole.
fn fault(field: &'static str, code: c_int) -> DeviceError {
    DeviceError::driver(
        Family::Freenect,
        field,
        format!("libfreenect answers {code}"),
    )
}

/// The library with its USB context. The library is unloaded after the context is closed.
pub(super) struct Context {
    functions: Functions,
    list: Option<ListFunctions>,
    context: Handle,
    _library: Library,
}

// SAFETY: libfreenect and libusb have no thread of their own for a context; it is used by one thread at a time.
unsafe impl Send for Context {}

impl Context {
    /// Loads the library and searches the USB.
    ///
    /// # Errors
    /// Without the library, or when it refuses.
    pub(super) fn open() -> Result<Self, DeviceError> {
        let library = load(Family::Freenect)?;
        // SAFETY: signatures are those of libfreenect.h 0.5.3, and `_library` outlives the tables.
        let (functions, list) = unsafe {
            (
                Functions::resolve(&library),
                ListFunctions::resolve(&library),
            )
        };
        let functions =
            functions.map_err(|e| DeviceError::missing(Family::Freenect, e.to_string()))?;
        let mut context: Handle = std::ptr::null_mut();
        // SAFETY: the library writes the handle; a null USB context makes it open its own.
        let code = unsafe { (functions.freenect_init)(&raw mut context, std::ptr::null_mut()) };
        if code < 0 {
            return Err(fault("freenect_init", code));
        }
        // SAFETY: the context is initialised.
        unsafe {
            (functions.freenect_set_log_level)(context, LOG_ERROR);
            (functions.freenect_select_subdevices)(context, SUBDEVICE_CAMERA);
        }
        Ok(Self {
            functions,
            list: list.ok(),
            context,
            _library: library,
        })
    }

    /// Serial numbers of the cameras; `None` if the library states only their count.
    ///
    /// # Errors
    /// When the USB cannot be searched.
    pub(super) fn serials(&self) -> Result<Option<Vec<String>>, DeviceError> {
        let Some(list) = &self.list else {
            return Ok(None);
        };
        let (mut first, mut out) = (std::ptr::null_mut(), Vec::new());
        // SAFETY: the library writes the head of a list that it allocates, or null.
        let code = unsafe { (list.freenect_list_device_attributes)(self.context, &raw mut first) };
        let mut next = first;
        while !next.is_null() {
            // SAFETY: not null, and the list lives until it is freed below; serial numbers are C strings or null.
            unsafe {
                if !(*next).camera_serial.is_null() {
                    let serial = CStr::from_ptr((*next).camera_serial);
                    out.push(serial.to_string_lossy().into_owned());
                }
                next = (*next).next;
            }
        }
        // SAFETY: the list is the library's, or null, and not used any more.
        unsafe { (list.freenect_free_device_attributes)(first) };
        if code < 0 {
            return Err(fault("freenect_list_device_attributes", code));
        }
        Ok(Some(out))
    }

    /// Number of cameras.
    ///
    /// # Errors
    /// When the USB cannot be searched.
    pub(super) fn count(&self) -> Result<usize, DeviceError> {
        // SAFETY: the context is initialised.
        let count = unsafe { (self.functions.freenect_num_devices)(self.context) };
        usize::try_from(count).map_err(|_| fault("freenect_num_devices", count))
    }

    /// Valid modes of a stream.
    pub(super) fn modes(&self, stream: Stream) -> Vec<FrameMode> {
        let f = &self.functions;
        let (count, mode) = match stream {
            Stream::Depth => (f.freenect_get_depth_mode_count, f.freenect_get_depth_mode),
            Stream::Color => (f.freenect_get_video_mode_count, f.freenect_get_video_mode),
        };
        // SAFETY: the functions read constant tables; indices are within the count.
        let modes = unsafe { (0..count()).map(|i| mode(i)) };
        modes.filter(|m| m.is_valid != 0).collect()
    }

    /// Starts depth and colour of a camera.
    ///
    /// # Errors
    /// Names the call that the library refuses.
    pub(super) fn start(
        self,
        serial: &str,
        depth: FrameMode,
        color: FrameMode,
    ) -> Result<Camera, Refusal> {
        let name = CString::new(serial).map_err(|_| ("serial", 0))?;
        let (f, mut device): (_, Handle) = (self.functions, std::ptr::null_mut());
        // SAFETY: the context is initialised, the name is a C string, and the library writes the handle.
        let code = unsafe {
            (f.freenect_open_device_by_camera_serial)(self.context, &raw mut device, name.as_ptr())
        };
        if code < 0 || device.is_null() {
            return Err(("freenect_open_device", code));
        }
        Camera::start(self, device, depth, color)
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: the context is initialised, and no camera of it is left: `Camera` owns its context.
        unsafe { (self.functions.freenect_shutdown)(self.context) };
    }
}
