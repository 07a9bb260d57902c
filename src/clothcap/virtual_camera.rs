//! Depth images of a scan from virtual cameras around it, so that the tracker can find the person in it.

use super::cloud::mean_spacing;
use super::scan::{BodyScan, axis_range};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use tryon_geometry::camera::{Calibration, Intrinsics, NoiseModel, RgbdFrame};
use tryon_geometry::math::{Camera, P3, Rigid, World};
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Options, View, VisibilityBuffer, rasterise_with};

/// Columns, rows and focal length, pixels: those of the sensors that the tracker is made for.
const SIZE: [u32; 2] = [480, 640];
const FOCAL: f32 = 525.0;
/// Share of the rows that the person fills.
const FILL: f32 = 0.72;
/// Nearest surface drawn, metres.
const NEAR: f32 = 0.1;
/// Faces a point, two on a whole surface, below which a scan is drawn as a cloud.
const TORN: f64 = 1.4;
/// Side of a point of a cloud as a multiple of the distance between points: closes the gaps.
const SPLAT: f32 = 2.5;

/// A camera with its depth image of a scan.
#[derive(Clone, Debug)]
pub(super) struct VirtualCamera {
    /// Projection.
    pub calibration: Calibration,
    /// Pose.
    pub world_from_camera: Rigid<World, Camera>,
}

impl VirtualCamera {
    /// Camera that sees the whole of `bounds` from the direction `yaw` about the vertical, radians; 0 looks along −z.
    pub(super) fn around([low, high]: [P3; 2], yaw: f64) -> Self {
        let [width, height] = SIZE;
        let depth = Intrinsics {
            width,
            height,
            fx: f64::from(FOCAL),
            fy: f64::from(FOCAL),
            cx: f64::from(width - 1) / 2.0,
            cy: f64::from(height - 1) / 2.0,
        };
        let extent = high - low;
        let across = extent.x.max(extent.z);
        let share = (extent.y / height as f32).max(across / width as f32);
        let distance = f64::from((share * FOCAL / FILL + 0.5 * across).max(1.0));
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

    /// Depth image of a scan, millimetres; 0 beside it.
    pub(super) fn frame(&self, scan: &BodyScan) -> RgbdFrame {
        let camera = self.calibration.depth;
        let mut points = Vec::new();
        let camera_from_world = self.world_from_camera.inverse();
        camera_from_world.points_f32(&scan.points, &mut points);
        let metres = if is_torn(scan) {
            splat(&camera, &points)
        } else {
            let view = View::Perspective { camera, near: NEAR };
            let mut buffer = VisibilityBuffer::default();
            let options = Options {
                par: Par::Rayon,
                ..Options::default()
            };
            rasterise_with(options, &view, &points, &scan.faces, &mut buffer);
            buffer.depth
        };
        RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: NoiseModel::None.apply(&camera, &metres, 0, 0),
            color: None,
        }
    }
}

/// A cloud, or a mesh whose faces leave much of the surface between its points open.
fn is_torn(scan: &BodyScan) -> bool {
    (scan.faces.len() as f64) < TORN * scan.points.len() as f64
}

/// Depth of each pixel of a cloud, metres, infinite beside it: each point is drawn as a square that faces the camera.
fn splat(camera: &Intrinsics, points: &[P3]) -> Vec<f32> {
    let mut depth = vec![f32::INFINITY; (camera.width * camera.height) as usize];
    let side = SPLAT * mean_spacing(points);
    for p in points.iter().filter(|p| p.z > NEAR) {
        let q = camera.project(p);
        let half = (0.5 * side * camera.fx as f32 / p.z).max(0.5);
        let range = |middle: f32, size: u32| {
            let low = (middle - half).ceil().clamp(0.0, size as f32) as u32;
            let high = (middle + half).floor().clamp(-1.0, size as f32 - 1.0);
            low..(high + 1.0) as u32
        };
        for row in range(q.y, camera.height) {
            for column in range(q.x, camera.width) {
                let slot = &mut depth[(row * camera.width + column) as usize];
                *slot = slot.min(p.z);
            }
        }
    }
    depth
}

/// Share of points left out at each end of an axis: strays.
const STRAYS: f64 = 0.002;

/// Bounds of a scan without its strays, metres.
pub(super) fn bounds(points: &[P3]) -> [P3; 2] {
    let mut ends = [P3::origin(); 2];
    for axis in 0..3 {
        let [low, high] = axis_range(points, axis, STRAYS);
        (ends[0][axis], ends[1][axis]) = (low, high);
    }
    ends
}
