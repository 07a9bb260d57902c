//! The first message of a sender: its camera.

use tryon_geometry::camera::{Intrinsics, LensCalibration};
use tryon_geometry::math::Rigid;
use tryon_proto::convert::geometry::{lens_from_wire, rigid_from_wire};
use tryon_proto::convert::{WireError, required};
use tryon_proto::v1::{CameraDescription, CameraFrame, ColorEncoding};

/// Length of a unit of depth, metres: from a hundredth of a millimetre to a decimetre.
const UNITS: std::ops::RangeInclusive<f64> = 1e-5..=0.1;
/// Most bytes of a device's name.
const MAX_DEVICE: usize = 64;
/// Most bytes of a JPEG: larger than any that a camera makes.
const MAX_JPEG: usize = 16 << 20;

/// A described camera.
#[derive(Clone, Debug)]
pub(super) struct Description {
    pub(super) lenses: LensCalibration,
    /// Length of a unit of depth, metres.
    pub(super) depth_unit: f64,
    /// Model and serial number, as the sender says.
    pub(super) device: String,
}

fn field(of: &str) -> String {
    format!("publish_frames_request.{of}")
}

impl Description {
    /// Checks a message.
    ///
    /// # Errors
    /// Names the field at fault.
    pub(super) fn from_wire(d: &CameraDescription) -> Result<Self, WireError> {
        let of = |part: &str| field(&format!("description.{part}"));
        let depth = required(d.depth.as_ref(), &of("depth"))?;
        let color = d.color.as_ref().map(|c| lens_from_wire(c, &of("color")));
        let pose = d.color_from_depth.as_ref();
        let pose = pose.map(|t| rigid_from_wire(t, &of("color_from_depth")));
        if !UNITS.contains(&d.depth_unit) {
            let why = format!("{} m, expected 1e-5 to 0.1 m", d.depth_unit);
            return Err(WireError::new(of("depth_unit"), why));
        }
        if d.device.len() > MAX_DEVICE || d.device.chars().any(char::is_control) {
            let why = format!("at most {MAX_DEVICE} bytes without control characters");
            return Err(WireError::new(of("device"), why));
        }
        Ok(Self {
            lenses: LensCalibration {
                depth: lens_from_wire(depth, &of("depth"))?,
                color: color.transpose()?,
                color_from_depth: pose.transpose()?.unwrap_or_else(Rigid::identity),
            },
            depth_unit: d.depth_unit,
            device: d.device.clone(),
        })
    }

    /// Pinhole of the colour images.
    pub(super) fn color(&self) -> Intrinsics {
        self.lenses.color.unwrap_or(self.lenses.depth).intrinsics
    }

    /// Checks the lengths of a frame.
    ///
    /// # Errors
    /// Names the field at fault.
    pub(super) fn check(&self, frame: &CameraFrame) -> Result<(), WireError> {
        let of = |part: &str| field(&format!("frame.{part}"));
        let depth = 2 * self.lenses.depth.intrinsics.pixels();
        if frame.depth.len() != depth {
            let why = format!("{} bytes, expected {depth}", frame.depth.len());
            return Err(WireError::new(of("depth"), why));
        }
        let pixels = self.color().pixels();
        let Ok(encoding) = ColorEncoding::try_from(frame.color_encoding) else {
            let why = format!("{} is no encoding", frame.color_encoding);
            return Err(WireError::new(of("color_encoding"), why));
        };
        let fits = match encoding {
            ColorEncoding::Unspecified => frame.color.is_empty(),
            ColorEncoding::Rgb8 | ColorEncoding::Bgr8 => frame.color.len() == 3 * pixels,
            ColorEncoding::Yuyv => frame.color.len() == 2 * pixels,
            ColorEncoding::Jpeg => (1..=MAX_JPEG).contains(&frame.color.len()),
        };
        if fits {
            return Ok(());
        }
        let k = self.color();
        let why = format!(
            "{} bytes are no {}×{} of {}",
            frame.color.len(),
            k.width,
            k.height,
            encoding.as_str_name()
        );
        Err(WireError::new(of("color"), why))
    }
}
