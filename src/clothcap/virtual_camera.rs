//! Depth frames of scans in virtual cameras, so that the tracker can find the person in them.

use super::cloud::mean_spacing;
use super::scan::{BodyScan, axis_range};
use tryon_geometry::camera::{Intrinsics, RgbdFrame};
use tryon_geometry::math::P3;
use tryon_tracking::still::VirtualCamera;

/// Nearest point drawn, metres.
const NEAR: f32 = 0.1;
/// Faces a point, two on a whole surface, below which a scan is drawn as a cloud.
const TORN: f64 = 1.4;
/// Side of a point of a cloud as a multiple of the distance between points: closes the gaps.
const SPLAT: f32 = 2.5;

/// Depth frame of a scan.
pub(super) fn scan_frame(camera: &VirtualCamera, scan: &BodyScan) -> RgbdFrame {
    let points = camera.view(&scan.points);
    camera.frame(&if is_torn(scan) {
        splat(&camera.calibration.depth, &points)
    } else {
        camera.depth(&points, &scan.faces)
    })
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
