//! The person in a still: depth frames from virtual cameras around a shape, and the steps of the tracker on one of them.

use crate::settings::StillCameraSettings;
use crate::{StepError, StepReport, TrackerConfig, TrackerModel, TrackerState, Workspace, step};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::sync::Arc;
use tryon_body::{BodyShape, Pose, Template};
use tryon_geometry::camera::{Calibration, Intrinsics, NoiseModel, RgbdFrame};
use tryon_geometry::math::{Camera, P3, Rigid, World};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Options, View, VisibilityBuffer, rasterise_with};

/// Columns and rows, pixels: those of the sensors that the tracker is made for.
const SIZE: [u32; 2] = [480, 640];

/// A camera at a shape.
#[derive(Clone, Debug)]
pub struct VirtualCamera {
    /// Projection.
    pub calibration: Calibration,
    /// Pose.
    pub world_from_camera: Rigid<World, Camera>,
}

impl VirtualCamera {
    /// Camera that sees the whole of `bounds` from the direction `yaw` about the vertical, radians; 0 looks along −z.
    pub fn around([low, high]: [P3; 2], yaw: f64) -> Self {
        let [width, height] = SIZE;
        let StillCameraSettings { focal, fill, .. } = StillCameraSettings::default();
        let depth = Intrinsics {
            width,
            height,
            fx: f64::from(focal),
            fy: f64::from(focal),
            cx: f64::from(width - 1) / 2.0,
            cy: f64::from(height - 1) / 2.0,
        };
        let extent = high - low;
        let across = extent.x.max(extent.z);
        let share = (extent.y / height as f32).max(across / width as f32);
        let distance = f64::from((share * focal / fill + 0.5 * across).max(1.0));
        let middle = nalgebra::center(&low, &high).cast::<f64>();
        let around = Rotation3::from_axis_angle(&Vector3::y_axis(), yaw);
        // Camera axes in the world: x to the right of the picture, y down, z towards the person.
        let axes = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
        let rotation = around * Rotation3::from_matrix_unchecked(axes);
        let place = middle + around * Vector3::new(0.0, 0.0, distance);
        Self {
            calibration: Calibration::registered(depth),
            world_from_camera: Rigid::from_parts(
                place.coords,
                UnitQuaternion::from_rotation_matrix(&rotation),
            ),
        }
    }

    /// Points of the world in the frame of the camera, metres.
    pub fn view(&self, points: &[P3]) -> Vec<P3> {
        let mut out = Vec::new();
        let camera_from_world = self.world_from_camera.inverse();
        camera_from_world.points_f32(points, &mut out);
        out
    }

    /// Depth of a surface at each pixel, metres, infinite beside it; `points` in the frame of the camera.
    pub fn depth(&self, points: &[P3], faces: &[Face]) -> Vec<f32> {
        let view = View::Perspective {
            camera: self.calibration.depth,
            near: StillCameraSettings::default().near,
        };
        let mut buffer = VisibilityBuffer::default();
        let options = Options {
            par: Par::Rayon,
            ..Options::default()
        };
        rasterise_with(options, &view, points, faces, &mut buffer);
        buffer.depth
    }

    /// Frame of the depths at all pixels, metres.
    pub fn frame(&self, metres: &[f32]) -> RgbdFrame {
        RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: NoiseModel::None.apply(&self.calibration.depth, metres, 0, 0),
            color: None,
        }
    }
}

/// Steps on one frame: the tracker finds the person in the first and measures the size in the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StillSteps {
    /// Steps, at least one.
    pub count: u64,
    /// Time from one to the next, nanoseconds.
    pub interval_ns: u64,
}

impl StillSteps {
    /// Steps on a frame, the first at its time; the report of the last.
    ///
    /// # Errors
    /// A frame that does not fit the camera.
    pub fn run(
        &self,
        model: &TrackerModel,
        state: &mut TrackerState,
        frame: &RgbdFrame,
        workspace: &mut Workspace,
    ) -> Result<StepReport, StepError> {
        let mut frame = frame.clone();
        for _ in 1..self.count {
            step(model, state, &frame, workspace)?;
            frame.time_ns = frame.time_ns.saturating_add(self.interval_ns);
        }
        step(model, state, &frame, workspace)
    }
}

/// Person found in a still.
#[derive(Clone, Debug)]
pub struct StillPerson {
    /// Pose.
    pub pose: Pose<World>,
    /// Shape.
    pub shape: BodyShape,
}

/// Person in a frame of a virtual camera; `None` if the tracker finds nobody in it.
///
/// # Errors
/// As [`StillSteps::run`].
pub fn find_still_person(
    template: &Arc<Template>,
    camera: &VirtualCamera,
    frame: &RgbdFrame,
    config: TrackerConfig,
    steps: StillSteps,
) -> Result<Option<StillPerson>, StepError> {
    let model = TrackerModel::new(template.clone(), camera.calibration.clone(), config);
    let mut state = TrackerState::new(&model);
    steps.run(&model, &mut state, frame, &mut Workspace::default())?;
    Ok(state.status.is_live().then(|| StillPerson {
        pose: state.pose.transformed(&camera.world_from_camera),
        shape: state.shape,
    }))
}
