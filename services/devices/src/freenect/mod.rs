//! Kinect v1 by libfreenect.

mod disparity;
mod ffi;
mod ticks;

pub(crate) use disparity::disparity_to_mm;

use super::calibration::{check_sizes, given};
use super::device::{choose, source_name};
use super::driver::{Driver, Encoding, Formats, Opened, POLL, SensorImage, StreamFormat};
use super::{Device, DeviceError, DeviceOptions, Family, Mode, Stream};
use disparity::{REFERENCE_MM, REFERENCE_PIXEL_MM};
use ffi::{Camera, Context, DEPTH_11BIT, DEPTH_REGISTERED, FrameMode, MEDIUM, VIDEO_RGB};
use ticks::TickClock;
use tryon_geometry::camera::{Calibration, Intrinsics, LensCalibration};
use tryon_geometry::math::{Rigid, V3d};

/// Model, for people: the USB does not tell Kinects v1 apart.
const MODEL: &str = "Kinect v1";
/// Units of depth in a metre.
const MILLIMETRES: f64 = 1000.0;
/// Distance of infrared and colour camera, metres (`dcmos_rcmos_dist` of libfreenect's zero plane).
const COLOR_OFFSET_M: f64 = 0.023;

/// Cameras that are plugged in.
///
/// # Errors
/// Without the library, or when the USB cannot be searched.
pub(super) fn list() -> Result<Vec<Device>, DeviceError> {
    let context = Context::open()?;
    let modes: Vec<Mode> = [Stream::Depth, Stream::Color]
        .into_iter()
        .filter_map(|stream| Some(mode(stream, &best(&context, stream)?)))
        .collect();
    let device = |serial| Device {
        family: Family::Freenect,
        serial,
        name: MODEL.into(),
        modes: modes.clone(),
    };
    Ok(serials(&context)?.into_iter().map(device).collect())
}

/// Serial numbers, or positions where the library states none.
fn serials(context: &Context) -> Result<Vec<String>, DeviceError> {
    match context.serials()? {
        Some(serials) => Ok(serials),
        None => Ok((0..context.count()?).map(|i| i.to_string()).collect()),
    }
}

/// The mode of a stream that is used: registered depth, else disparity; RGB.
fn best(context: &Context, stream: Stream) -> Option<FrameMode> {
    let formats: &[i32] = match stream {
        Stream::Depth => &[DEPTH_REGISTERED, DEPTH_11BIT],
        Stream::Color => &[VIDEO_RGB],
    };
    let modes = context.modes(stream);
    let with = |format| {
        let is_it = |m: &&FrameMode| m.resolution == MEDIUM && m.format == format;
        modes.iter().find(is_it).copied()
    };
    formats.iter().find_map(|format| with(*format))
}

fn mode(stream: Stream, mode: &FrameMode) -> Mode {
    Mode {
        stream,
        width: mode.width.unsigned_abs().into(),
        height: mode.height.unsigned_abs().into(),
        rate: mode.framerate.into(),
    }
}

/// Opens a camera by its serial number.
///
/// # Errors
/// Without the library or the camera, or when it refuses.
pub(super) fn open(serial: Option<&str>, options: &DeviceOptions) -> Result<Opened, DeviceError> {
    let context = Context::open()?;
    let serial = match (context.serials()?, serial) {
        (Some(present), _) => choose(Family::Freenect, serial, &present)?,
        // The library compares by itself.
        (None, Some(serial)) => serial.to_owned(),
        (None, None) => choose(Family::Freenect, None, &serials(&context)?)?,
    };
    let name = source_name(Family::Freenect, &serial);
    let unoffered = |stream: Stream| {
        let why = "the library offers no mode of 640×480 that is understood";
        DeviceError::driver(&name, stream.name(), why)
    };
    let of = |stream| best(&context, stream).ok_or_else(|| unoffered(stream));
    let (depth, color) = (of(Stream::Depth)?, of(Stream::Color)?);
    let (lenses, depth_scale) = match given(&name, options)? {
        Some(file) => (file.lenses, file.depth_scale),
        None => (lenses(depth.format), MILLIMETRES),
    };
    let formats = formats(&depth, &color);
    check_sizes(&name, &formats, &lenses)?;
    let camera = context
        .start(&serial, depth, color)
        .map_err(|(call, code)| {
            let why = format!("libfreenect answers {code}: is it used by another program?");
            DeviceError::driver(&name, call, why)
        })?;
    Ok(Opened {
        driver: Box::new(FreenectDriver {
            name: name.clone(),
            camera,
            clock: TickClock::default(),
        }),
        name,
        formats,
        lenses,
        depth_scale,
    })
}

fn formats(depth: &FrameMode, color: &FrameMode) -> Formats {
    let format = |encoding, m: Mode| StreamFormat {
        encoding,
        width: m.width,
        height: m.height,
        rate: m.rate,
    };
    let encoding = if depth.format == DEPTH_REGISTERED {
        Encoding::Depth16
    } else {
        Encoding::KinectDisparity
    };
    Formats {
        depth: format(encoding, mode(Stream::Depth, depth)),
        color: Some(format(Encoding::Rgb8, mode(Stream::Color, color))),
    }
}

/// Lenses of the design: those of single devices are within a few per cent.
///
/// Registered depth is in the colour camera's image, whose focal length is 525 pixels (ROS, TUM RGB-D). Disparity is in
/// the infrared camera's, with the focal length of libfreenect's zero plane, as in its `freenect_camera_to_world`.
fn lenses(depth_format: i32) -> LensCalibration {
    let color = Intrinsics::KINECT_V1;
    if depth_format == DEPTH_REGISTERED {
        return Calibration::registered(color).into();
    }
    // Columns of the zero plane are half as wide as the image's.
    let focal = REFERENCE_MM / REFERENCE_PIXEL_MM / 2.0;
    let infrared = Intrinsics {
        fx: focal,
        fy: focal,
        ..color
    };
    Calibration {
        depth: infrared,
        color: Some(color),
        color_from_depth: Rigid::from_parts(
            V3d::new(-COLOR_OFFSET_M, 0.0, 0.0),
            nalgebra::UnitQuaternion::identity(),
        ),
    }
    .into()
}

struct FreenectDriver {
    name: String,
    camera: Camera,
    clock: TickClock,
}

impl Driver for FreenectDriver {
    fn poll(&mut self, sink: &mut dyn FnMut(SensorImage)) -> Result<(), DeviceError> {
        let images = self.camera.poll(POLL).map_err(|code| {
            let why = format!("libfreenect answers {code}: has the camera been unplugged?");
            DeviceError::driver(&self.name, "freenect_process_events", why)
        })?;
        for (stream, ticks, bytes) in images {
            let time_ns = self.clock.nanoseconds(ticks);
            sink(SensorImage {
                stream,
                time_ns,
                bytes,
            });
        }
        Ok(())
    }
}
