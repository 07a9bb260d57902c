//! C interface of OpenNI 2.2 (OniCAPI.h), as safe owners of its devices and streams.
#![allow(unsafe_code)] // C functions: each call has its reason

mod device;
mod stream;

pub(super) use device::OniDevice;
pub(super) use stream::{Image, OniStream, wait};

use crate::library::{functions, load};
use crate::{DeviceError, Family};
use libloading::Library;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::{Mutex, PoisonError};

/// `ONI_SENSOR_COLOR` and `ONI_SENSOR_DEPTH`.
pub(super) const SENSOR_COLOR: c_int = 2;
pub(super) const SENSOR_DEPTH: c_int = 3;
/// `ONI_API_VERSION` of 2.2.
const API_VERSION: c_int = 2002;
/// `ONI_STATUS_OK`.
const OK: c_int = 0;
/// `ONI_MAX_STR`.
const MAX_STR: usize = 256;

/// `OniVideoMode`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct VideoMode {
    pub(super) pixel_format: c_int,
    pub(super) width: c_int,
    pub(super) height: c_int,
    pub(super) fps: c_int,
}

/// `OniSensorInfo`.
#[repr(C)]
struct SensorInfo {
    sensor_type: c_int,
    count: c_int,
    modes: *const VideoMode,
}

/// `OniDeviceInfo`.
#[repr(C)]
struct DeviceInfo {
    uri: [c_char; MAX_STR],
    vendor: [c_char; MAX_STR],
    name: [c_char; MAX_STR],
    usb_vendor: u16,
    usb_product: u16,
}

/// `OniFrame`.
#[repr(C)]
struct OniFrame {
    data_size: c_int,
    data: *const c_void,
    sensor_type: c_int,
    timestamp: u64,
    index: c_int,
    width: c_int,
    height: c_int,
    mode: VideoMode,
    cropping: c_int,
    crop_x: c_int,
    crop_y: c_int,
    stride: c_int,
}

/// Opaque `OniDeviceHandle` and `OniStreamHandle`.
type Handle = *mut c_void;

functions! {
    /// Functions of OniCAPI.h.
    Functions {
        oniInitialize(c_int) -> c_int;
        oniGetExtendedError() -> *const c_char;
        oniGetDeviceList(*mut *mut DeviceInfo, *mut c_int) -> c_int;
        oniReleaseDeviceList(*mut DeviceInfo) -> c_int;
        oniDeviceOpen(*const c_char, *mut Handle) -> c_int;
        oniDeviceClose(Handle) -> c_int;
        oniDeviceGetSensorInfo(Handle, c_int) -> *const SensorInfo;
        oniDeviceCreateStream(Handle, c_int, *mut Handle) -> c_int;
        oniDeviceEnableDepthColorSync(Handle) -> c_int;
        oniDeviceGetProperty(Handle, c_int, *mut c_void, *mut c_int) -> c_int;
        oniDeviceSetProperty(Handle, c_int, *const c_void, c_int) -> c_int;
        oniDeviceIsImageRegistrationModeSupported(Handle, c_int) -> c_int;
        oniStreamDestroy(Handle);
        oniStreamStart(Handle) -> c_int;
        oniStreamStop(Handle);
        oniStreamReadFrame(Handle, *mut *mut OniFrame) -> c_int;
        oniStreamSetProperty(Handle, c_int, *const c_void, c_int) -> c_int;
        oniStreamGetProperty(Handle, c_int, *mut c_void, *mut c_int) -> c_int;
        oniWaitForAnyStream(*mut Handle, c_int, *mut c_int, c_int) -> c_int;
        oniFrameRelease(*mut OniFrame);
    }
}

/// The library, initialised. It stays so until the process ends: its drivers watch for cameras on threads of their own.
struct Runtime {
    functions: Functions,
    _library: Library,
}

static RUNTIME: Mutex<Option<Runtime>> = Mutex::new(None);

/// Functions of the initialised library.
fn functions() -> Result<Functions, DeviceError> {
    let mut runtime = RUNTIME.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(runtime) = &*runtime {
        return Ok(runtime.functions);
    }
    let library = load(Family::Openni)?;
    // SAFETY: signatures are those of OniCAPI.h 2.2.0.33, and the library is kept for good.
    let functions = unsafe { Functions::resolve(&library) };
    let functions = functions.map_err(|e| DeviceError::missing(Family::Openni, e.to_string()))?;
    // SAFETY: called once, under the lock.
    let status = unsafe { (functions.oniInitialize)(API_VERSION) };
    if status != OK {
        let why = refusal(&functions, status);
        return Err(DeviceError::driver(Family::Openni, "oniInitialize", why));
    }
    *runtime = Some(Runtime {
        functions,
        _library: library,
    });
    Ok(functions)
}

/// Last error of the library on this thread, in a line.
fn refusal(f: &Functions, status: c_int) -> String {
    // SAFETY: the library answers with a C string of its own, or null.
    let text = unsafe {
        let text = (f.oniGetExtendedError)();
        if text.is_null() {
            String::new()
        } else {
            CStr::from_ptr(text).to_string_lossy().into_owned()
        }
    };
    let words: Vec<&str> = text.split_whitespace().collect();
    format!("OpenNI answers {status}: {}", words.join(" "))
}

/// A refused call.
pub(super) type Refusal = (&'static str, String);

/// Place and model of a camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Info {
    pub(super) uri: String,
    pub(super) vendor: String,
    pub(super) name: String,
}

/// Text of a field of characters.
fn text(field: &[c_char; MAX_STR]) -> String {
    let bytes: Vec<u8> = field
        .iter()
        .map(|c| c.cast_unsigned())
        .take_while(|c| *c != 0)
        .collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Cameras that are plugged in.
///
/// # Errors
/// Without the library, or when it refuses.
pub(super) fn list() -> Result<Vec<Info>, DeviceError> {
    let f = functions()?;
    let (mut first, mut count) = (std::ptr::null_mut(), 0);
    // SAFETY: the library writes the array that it allocates, and its length.
    let status = unsafe { (f.oniGetDeviceList)(&raw mut first, &raw mut count) };
    if status != OK {
        let why = refusal(&f, status);
        return Err(DeviceError::driver(Family::Openni, "oniGetDeviceList", why));
    }
    let length = usize::try_from(count).unwrap_or(0);
    if first.is_null() || length == 0 {
        return Ok(vec![]);
    }
    // SAFETY: the array has that many entries until it is released.
    let infos = unsafe { std::slice::from_raw_parts(first, length) };
    let infos = infos.iter().map(|i| Info {
        uri: text(&i.uri),
        vendor: text(&i.vendor),
        name: text(&i.name),
    });
    let infos = infos.collect();
    // SAFETY: the array is the library's and not used any more.
    unsafe { (f.oniReleaseDeviceList)(first) };
    Ok(infos)
}
