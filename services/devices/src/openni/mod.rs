//! PrimeSense, Xtion and Astra cameras by OpenNI 2.

mod ffi;
mod modes;

use super::calibration::{check_sizes, given};
use super::device::{choose, source_name};
use super::driver::{Driver, Formats, Opened, POLL, SensorImage, StreamFormat};
use super::packed::packed_rows;
use super::{Device, DeviceError, DeviceOptions, Family, Stream};
use ffi::{OniDevice, OniStream, Refusal, SENSOR_COLOR, SENSOR_DEPTH};
use modes::{Known, all_modes, best_mode, understood};
use std::time::Duration;
use tryon_formats::CameraFile;
use tryon_geometry::camera::{Calibration, Intrinsics, LensCalibration};

/// Time from the stop of streams to their destruction: OpenNI's dummy driver does not wait for its threads, which see the
/// stop at their next image, 33 ms later.
const SETTLING: Duration = Duration::from_millis(150);

/// Sensor of a stream.
fn sensor(stream: Stream) -> std::ffi::c_int {
    match stream {
        Stream::Depth => SENSOR_DEPTH,
        Stream::Color => SENSOR_COLOR,
    }
}

/// Cameras that are plugged in. One that another program uses is named by its place.
///
/// # Errors
/// Without the library, or when it refuses.
pub(super) fn list() -> Result<Vec<Device>, DeviceError> {
    let describe = |info: ffi::Info| {
        let device = OniDevice::open(&info.uri).ok();
        Device {
            family: Family::Openni,
            serial: device
                .as_ref()
                .and_then(OniDevice::serial)
                .unwrap_or(info.uri),
            name: format!("{} {}", info.vendor, info.name).trim().to_owned(),
            modes: device.as_ref().map(all_modes).unwrap_or_default(),
        }
    };
    Ok(ffi::list()?.into_iter().map(describe).collect())
}

/// Opens the camera with a serial number, one that states none by its place.
fn find(serial: Option<&str>) -> Result<(String, OniDevice), DeviceError> {
    let mut present = Vec::new();
    let mut devices = Vec::new();
    for info in ffi::list()? {
        let device = OniDevice::open(&info.uri);
        let own = device.as_ref().ok().and_then(OniDevice::serial);
        let own = own.unwrap_or(info.uri);
        if serial == Some(own.as_str()) {
            return Ok((own, device?));
        }
        present.push(own);
        devices.push(device);
    }
    match (serial, choose(Family::Openni, serial, &present)) {
        (Some(place), Err(absent)) => {
            let device = OniDevice::open(place).map_err(|_| absent)?;
            Ok((place.to_owned(), device))
        }
        (None, Err(absent)) => Err(absent),
        (_, Ok(only)) => {
            let device = devices.pop().unwrap_or_else(|| OniDevice::open(&only));
            Ok((only, device?))
        }
    }
}

/// Opens a camera by its serial number.
///
/// # Errors
/// Without the library or the camera, when it refuses, or when it states no calibration and none is given.
pub(super) fn open(serial: Option<&str>, options: &DeviceOptions) -> Result<Opened, DeviceError> {
    let (serial, device) = find(serial)?;
    let name = source_name(Family::Openni, &serial);
    let file = given(&name, options)?;
    // A file with two lenses describes images that the camera leaves where they are.
    let is_apart = file.as_ref().is_some_and(|f| f.lenses.color.is_some());
    let is_registered = !is_apart && device.register_depth();
    let fault = |(call, why): Refusal| DeviceError::driver(&name, call, why);
    let depth = prepare(&device, Stream::Depth, file.as_ref()).map_err(fault)?;
    let depth = depth.ok_or_else(|| fault(("depth", "the camera has none".into())))?;
    let color = prepare(&device, Stream::Color, file.as_ref()).map_err(fault)?;
    if color.is_none() {
        tracing::warn!(camera = name, "it has no colour that OpenNI delivers");
    }
    if color.is_some() && !device.synchronize() {
        tracing::info!(
            camera = name,
            "depth and colour are exposed at their own times"
        );
    }
    let lenses = match file {
        Some(file) => file.lenses,
        None => stated_lenses(&name, &depth, color.as_ref(), is_registered)?,
    };
    let formats = Formats {
        depth: depth.format,
        color: color.as_ref().map(|c| c.format),
    };
    check_sizes(&name, &formats, &lenses)?;
    let depth_scale = depth.known.depth_scale;
    let streams = [Some(depth.stream), color.map(|c| c.stream)];
    let driver = OpenniDriver {
        name: name.clone(),
        streams: streams.into_iter().flatten().collect(),
        formats,
        _device: device,
    };
    for stream in &driver.streams {
        stream.start().map_err(fault)?;
    }
    Ok(Opened {
        driver: Box::new(driver),
        name,
        formats,
        lenses,
        depth_scale,
    })
}

/// A stream, not yet started.
struct Prepared {
    stream: OniStream,
    format: StreamFormat,
    known: Known,
}

/// Makes a stream in the size of the given calibration, or VGA; `None` if the camera lacks it.
fn prepare(
    device: &OniDevice,
    stream: Stream,
    file: Option<&CameraFile>,
) -> Result<Option<Prepared>, Refusal> {
    let lenses = file.map(|f| &f.lenses);
    let lens = lenses.map(|l| match stream {
        Stream::Depth => l.depth,
        Stream::Color => l.color.unwrap_or(l.depth),
    });
    let size = lens.map_or([640, 480], |l| [l.intrinsics.width, l.intrinsics.height]);
    let Some(wanted) = best_mode(stream, size, &device.modes(sensor(stream))) else {
        return Ok(None);
    };
    let made = device.stream(sensor(stream), wanted)?;
    let mode = made.mode().unwrap_or(wanted);
    let Some(known) = understood(stream, mode.pixel_format) else {
        return Err((
            stream.name(),
            format!("pixel format {} is not read", mode.pixel_format),
        ));
    };
    let format = StreamFormat {
        encoding: known.encoding,
        width: mode.width.unsigned_abs(),
        height: mode.height.unsigned_abs(),
        rate: f64::from(mode.fps),
    };
    Ok(Some(Prepared {
        stream: made,
        format,
        known,
    }))
}

/// Lenses of the fields of view that the camera states; registered depth is in the colour camera's image.
fn stated_lenses(
    name: &str,
    depth: &Prepared,
    color: Option<&Prepared>,
    is_registered: bool,
) -> Result<LensCalibration, DeviceError> {
    let way = "give a camera.json (`camera = PATH`)";
    if color.is_some() && !is_registered {
        let why = format!("the camera does not register depth to colour: {way}");
        return Err(DeviceError::calibration(name, why));
    }
    let view = color.filter(|_| is_registered).unwrap_or(depth);
    let pinhole = view
        .stream
        .field_of_view()
        .and_then(|angles| pinhole(&depth.format, angles));
    let pinhole = pinhole.ok_or_else(|| {
        DeviceError::calibration(name, format!("the camera states no field of view: {way}"))
    })?;
    Ok(Calibration::registered(pinhole).into())
}

/// Pinhole of horizontal and vertical fields of view, radians; `None` for impossible ones.
fn pinhole(format: &StreamFormat, angles: [f64; 2]) -> Option<Intrinsics> {
    let focal = |side: u32, angle: f64| 0.5 * f64::from(side) / (0.5 * angle).tan();
    let center = |side: u32| 0.5 * (f64::from(side) - 1.0);
    let k = Intrinsics {
        width: format.width,
        height: format.height,
        fx: focal(format.width, angles[0]),
        fy: focal(format.height, angles[1]),
        cx: center(format.width),
        cy: center(format.height),
    };
    k.validated().ok()
}

/// Streams before the device: they are destroyed first.
struct OpenniDriver {
    name: String,
    /// Depth, then colour if there is any.
    streams: Vec<OniStream>,
    formats: Formats,
    _device: OniDevice,
}

impl Drop for OpenniDriver {
    fn drop(&mut self) {
        self.streams.iter().for_each(OniStream::stop);
        #[allow(clippy::disallowed_methods)] // on the camera's own thread
        std::thread::sleep(SETTLING);
    }
}

impl Driver for OpenniDriver {
    fn poll(&mut self, sink: &mut dyn FnMut(SensorImage)) -> Result<(), DeviceError> {
        let fault = |(call, why): Refusal| DeviceError::driver(&self.name, call, why);
        let Some((index, image)) = ffi::wait(&self.streams, POLL).map_err(fault)? else {
            return Ok(());
        };
        let (stream, format) = match (index, self.formats.color) {
            (0, _) | (_, None) => (Stream::Depth, self.formats.depth),
            (_, Some(color)) => (Stream::Color, color),
        };
        let time_ns = image.time_us.saturating_mul(1000);
        let bytes = checked_rows(image, &format).map_err(|why| fault((stream.name(), why)))?;
        sink(SensorImage {
            stream,
            time_ns,
            bytes,
        });
        Ok(())
    }
}

/// Rows of an image that has the stream's size.
fn checked_rows(image: ffi::Image, format: &StreamFormat) -> Result<Vec<u8>, String> {
    let [width, height, stride] = [image.width, image.height, image.stride].map(i32::unsigned_abs);
    let (got, want) = ((width, height), (format.width, format.height));
    if got != want {
        return Err(format!("{got:?} pixels, but the stream has {want:?}"));
    }
    packed_rows(image.bytes, stride as usize, format)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::Encoding;

    #[test]
    fn a_field_of_view_is_a_pinhole() {
        let format = StreamFormat {
            encoding: Encoding::Depth16,
            width: 640,
            height: 480,
            rate: 30.0,
        };
        // PrimeSense states 1.0226 and 0.79661 rad, which libraries know as 570.3 pixels.
        let k = pinhole(&format, [1.0226, 0.796_61]).expect("possible");
        assert!(
            (k.fx - 570.34).abs() < 0.1 && (k.fy - 570.34).abs() < 0.2,
            "{k:?}"
        );
        assert_eq!((k.cx, k.cy), (319.5, 239.5));
        for angles in [[0.0, 0.8], [f64::NAN, 0.8], [1.0, 4.0]] {
            assert!(pinhole(&format, angles).is_none(), "{angles:?}");
        }
    }
}
