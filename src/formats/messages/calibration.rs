//! Calibration of the chosen topics from the recording's cameras and transforms.

use super::fault::MessageFault;
use super::realsense;
use super::selection::{Selection, shared_segments};
use super::survey::{CameraTopic, ImageTopic, Survey};
use tryon_geometry::camera::{Lens, LensCalibration};
use tryon_geometry::math::Rigid;

/// Metres of a unit of 16-bit depth where nothing states another (REP 118).
const MILLIMETRE: f64 = 0.001;
/// Units within this of each other are the same: they are stored in 32-bit floats.
const UNIT_STEP: f64 = 1e-9;

/// Calibration and unit of a recording.
#[derive(Debug)]
pub(super) struct StreamCalibration {
    pub(super) lenses: LensCalibration,
    /// Metres of a unit of 16-bit depth.
    pub(super) depth_unit: f64,
    /// Notes on what is left out or assumed.
    pub(super) notes: Vec<String>,
}

impl Survey {
    /// Calibration of a selection.
    ///
    /// # Errors
    /// No camera for depth, one for another size, or a camera that cannot be used.
    pub(super) fn calibrate(
        &self,
        selection: &Selection<'_>,
    ) -> Result<StreamCalibration, MessageFault> {
        let mut notes = Vec::new();
        let depth = selection.depth;
        let camera = self.camera(depth).ok_or_else(|| no_camera(depth))?;
        let mut lenses = LensCalibration {
            depth: lens(camera, depth, &mut notes)?,
            color: None,
            color_from_depth: Rigid::identity(),
        };
        if let Some(color) = selection.color {
            self.add_color(&mut lenses, depth, color, &mut notes)?;
        }
        let depth_unit = self.depth_unit(depth, &mut notes)?;
        Ok(StreamCalibration {
            lenses,
            depth_unit,
            notes,
        })
    }

    /// Camera of an image topic: of its frame of reference, and of these the one with the most of its path.
    fn camera(&self, image: &ImageTopic) -> Option<&CameraTopic> {
        let same_frame = self
            .cameras
            .values()
            .filter(|c| c.info.frame_id == image.frame_id);
        same_frame.max_by_key(|c| {
            let is_size = image
                .size
                .is_none_or(|s| s == (c.info.width, c.info.height));
            (shared_segments(&c.topic, &image.topic), is_size)
        })
    }

    fn add_color(
        &self,
        lenses: &mut LensCalibration,
        depth: &ImageTopic,
        color: &ImageTopic,
        notes: &mut Vec<String>,
    ) -> Result<(), MessageFault> {
        let (topic, frame) = (&color.topic, &color.frame_id);
        let Some(camera) = self.camera(color) else {
            if color.size.is_some() && color.size != depth.size {
                return Err(no_camera(color));
            }
            let why = format!("no camera for frame_id `{frame}`; taken as registered to depth");
            notes.push(format!("`{topic}`: {why}"));
            return Ok(());
        };
        let color_lens = lens(camera, color, notes)?;
        let is_same_frame = color.frame_id == depth.frame_id;
        if is_same_frame && color_lens == lenses.depth {
            return Ok(());
        }
        lenses.color = Some(color_lens);
        match self.frames.transform(&depth.frame_id, frame) {
            Some(pose) => lenses.color_from_depth = Rigid::new(pose),
            None => {
                let from = &depth.frame_id;
                let why = format!("no transform from `{from}` to `{frame}`; taken as one place");
                notes.push(format!("`{topic}`: {why}"));
            }
        }
        Ok(())
    }

    /// Metres of a unit of 16-bit depth.
    fn depth_unit(&self, depth: &ImageTopic, notes: &mut Vec<String>) -> Result<f64, MessageFault> {
        let options = self.depth_units.iter();
        let mut of_sensor = options.filter(|(o, _)| realsense::is_same_sensor(o, &depth.topic));
        let stated = depth
            .depth_unit
            .or_else(|| of_sensor.next().map(|(_, unit)| *unit));
        let Some(unit) = stated else {
            if realsense::is_image_topic(&depth.topic) {
                let why = "no Depth_Units stated; 0.001 m taken";
                notes.push(format!("`{}`: {why}", depth.topic));
            }
            return Ok(MILLIMETRE);
        };
        if !(unit.is_finite() && unit > 0.0) {
            let why = format!("{unit}, expected a positive number of metres");
            return Err(MessageFault::new("Depth_Units", why));
        }
        Ok((unit / UNIT_STEP).round().max(1.0) * UNIT_STEP)
    }
}

fn no_camera(image: &ImageTopic) -> MessageFault {
    let schema = match image.schema.starts_with("foxglove") {
        true => "foxglove.CameraCalibration",
        false => "sensor_msgs/CameraInfo",
    };
    let why = format!("none for {image} of frame_id `{}`", image.frame_id);
    MessageFault::new(schema, format!("{why}; give one with --camera"))
}

/// Lens of a camera, checked against its images.
fn lens(
    camera: &CameraTopic,
    image: &ImageTopic,
    notes: &mut Vec<String>,
) -> Result<Lens, MessageFault> {
    let field = |field: &str| format!("`{}` ({}).{field}", camera.topic, camera.schema);
    let found = camera.info.lens(&image.topic);
    let (lens, more) = found.map_err(|f| MessageFault::new(field(&f.field), f.why))?;
    notes.extend(more);
    if camera.changes {
        let frame = &camera.info.frame_id;
        let why = "the camera changes; its first message is taken";
        notes.push(format!("`{}` (frame_id `{frame}`): {why}", camera.topic));
    }
    let size = (lens.intrinsics.width, lens.intrinsics.height);
    if image.size.is_some_and(|s| s != size) {
        let why = format!("{}×{}, but images are {image}", size.0, size.1);
        return Err(MessageFault::new(field("width, height"), why));
    }
    Ok(lens)
}
