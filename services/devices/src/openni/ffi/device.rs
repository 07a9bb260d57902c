//! Cameras of OpenNI.

use super::{
    Functions, Handle, MAX_STR, OK, OniStream, Refusal, VideoMode, functions, refusal, text,
};
use crate::DeviceError;
use std::ffi::{CString, c_char, c_int};

/// `ONI_DEVICE_PROPERTY_SERIAL_NUMBER`: a string.
const SERIAL_NUMBER: c_int = 3;
/// `ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION`, and `ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR`.
const IMAGE_REGISTRATION: c_int = 5;
const DEPTH_TO_COLOR: c_int = 1;

/// An open camera.
pub(in super::super) struct OniDevice {
    functions: Functions,
    handle: Handle,
}

// SAFETY: OpenNI locks its devices and streams; the owner is used by one thread at a time.
unsafe impl Send for OniDevice {}

impl OniDevice {
    /// Opens the camera at a place.
    ///
    /// # Errors
    /// Without the library, or the library's reason.
    pub(in super::super) fn open(uri: &str) -> Result<Self, DeviceError> {
        let functions = functions()?;
        let fault = |why| DeviceError::driver(format!("openni:{uri}"), "oniDeviceOpen", why);
        let name = CString::new(uri).map_err(|e| fault(e.to_string()))?;
        let mut handle: Handle = std::ptr::null_mut();
        // SAFETY: the place is a C string; the library writes the handle.
        let status = unsafe { (functions.oniDeviceOpen)(name.as_ptr(), &raw mut handle) };
        if status != OK || handle.is_null() {
            return Err(fault(refusal(&functions, status)));
        }
        Ok(Self { functions, handle })
    }

    /// Serial number, if the camera states one.
    pub(in super::super) fn serial(&self) -> Option<String> {
        let (mut field, mut size) = ([0 as c_char; MAX_STR], MAX_STR as c_int);
        // SAFETY: the field has the stated size, of which the library writes at most that much.
        let status = unsafe {
            (self.functions.oniDeviceGetProperty)(
                self.handle,
                SERIAL_NUMBER,
                field.as_mut_ptr().cast(),
                &raw mut size,
            )
        };
        let serial = text(&field);
        (status == OK && !serial.is_empty()).then_some(serial)
    }

    /// Modes of a sensor; none if the camera lacks it.
    pub(in super::super) fn modes(&self, sensor: c_int) -> Vec<VideoMode> {
        // SAFETY: the answer is the device's own table, or null; it lives as long as the device.
        unsafe {
            let info = (self.functions.oniDeviceGetSensorInfo)(self.handle, sensor);
            if info.is_null() || (*info).modes.is_null() {
                return vec![];
            }
            let count = usize::try_from((*info).count).unwrap_or(0);
            std::slice::from_raw_parts((*info).modes, count).to_vec()
        }
    }

    /// Has depth drawn into the colour camera's image; false if the camera cannot.
    pub(in super::super) fn register_depth(&self) -> bool {
        let (f, mode) = (&self.functions, DEPTH_TO_COLOR);
        // SAFETY: the device is open; the property is an int, which the library copies.
        unsafe {
            (f.oniDeviceIsImageRegistrationModeSupported)(self.handle, mode) != 0
                && (f.oniDeviceSetProperty)(
                    self.handle,
                    IMAGE_REGISTRATION,
                    (&raw const mode).cast(),
                    size_of::<c_int>() as c_int,
                ) == OK
        }
    }

    /// Has both sensors exposed at the same time, where the camera can.
    pub(in super::super) fn synchronize(&self) -> bool {
        // SAFETY: the device is open.
        unsafe { (self.functions.oniDeviceEnableDepthColorSync)(self.handle) == OK }
    }

    /// Makes a stream of a sensor, in the mode if the camera lets it be chosen, and not mirrored.
    ///
    /// # Errors
    /// The refused call.
    pub(in super::super) fn stream(
        &self,
        sensor: c_int,
        mode: VideoMode,
    ) -> Result<OniStream, Refusal> {
        let f = self.functions;
        let mut handle: Handle = std::ptr::null_mut();
        // SAFETY: the device is open; the library writes the handle.
        let status = unsafe { (f.oniDeviceCreateStream)(self.handle, sensor, &raw mut handle) };
        if status != OK || handle.is_null() {
            return Err(("oniDeviceCreateStream", refusal(&f, status)));
        }
        Ok(OniStream::new(f, handle, mode))
    }
}

impl Drop for OniDevice {
    fn drop(&mut self) {
        // SAFETY: the device is open, and its streams are destroyed: their owner has them before the device.
        unsafe { (self.functions.oniDeviceClose)(self.handle) };
    }
}
