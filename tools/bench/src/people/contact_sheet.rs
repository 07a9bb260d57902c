//! Contact sheets: shaded depth images with true and tracked joints, many in one picture.

use super::common_joints::Points;
use super::session::TrackedSession;
use crate::{EvaluateError, Sheet};
use std::path::Path;
use tryon_geometry::camera::{DepthImage, Intrinsics};
use tryon_geometry::math::P3d;

/// Size of one cell, pixels, and cells in a row.
const CELL: [u32; 2] = [240, 180];
const COLUMNS: usize = 8;
/// Most cells of one sheet.
const MOST: usize = 160;
/// Colours of the truth and of the tracked joints, sRGB.
const TRUE: [u8; 3] = [60, 200, 60];
const TRACKED: [u8; 3] = [230, 60, 40];
/// Pairs of common joints that a bone connects.
#[rustfmt::skip]
const BONES: [[usize; 2]; 15] = [
    [0, 1], [0, 2], [2, 4], [1, 3], [3, 5], [6, 7], [6, 8], [8, 10],
    [7, 9], [9, 11], [0, 6], [1, 7], [13, 12], [0, 13], [1, 13],
];

/// Shaded depth images in rows.
#[derive(Clone, Debug)]
pub(super) struct ContactSheet(Sheet);

impl Default for ContactSheet {
    fn default() -> Self {
        Self(Sheet::new(CELL, COLUMNS))
    }
}

impl ContactSheet {
    /// Adds a depth image with its true and tracked joints; nothing once the sheet is full.
    pub(super) fn add(
        &mut self,
        camera: &Intrinsics,
        depth: &DepthImage,
        truth: Option<&Points>,
        tracked: Option<&Points>,
    ) {
        if self.0.len() >= MOST {
            return;
        }
        let scale = f64::max(
            f64::from(depth.width()) / f64::from(CELL[0]),
            f64::from(depth.height()) / f64::from(CELL[1]),
        );
        let mut cell = shaded(depth, scale);
        for (points, color) in [(truth, TRUE), (tracked, TRACKED)] {
            let Some(points) = points else { continue };
            let place = |p: &P3d| {
                let q = camera.project(&p.cast::<f32>());
                (p.z > 0.1).then(|| [f64::from(q.x) / scale, f64::from(q.y) / scale])
            };
            for [a, b] in BONES {
                if let (Some(a), Some(b)) = (place(&points[a]), place(&points[b])) {
                    line(&mut cell, a, b, color);
                }
            }
        }
        self.0.push(cell);
    }

    /// Tracks the next depth image of a session and adds it if `is_shown`; the common joints with a live pose.
    pub(super) fn track(
        &mut self,
        session: &mut TrackedSession,
        depth: DepthImage,
        truth: Option<&Points>,
        is_shown: bool,
    ) -> Option<Points> {
        let shown = is_shown.then(|| depth.clone());
        let tracked = session.track(depth);
        if let Some(depth) = shown {
            let camera = &session.model.calibration().depth;
            self.add(camera, &depth, truth, tracked.as_ref());
        }
        tracked
    }

    /// Writes the sheet; nothing without cells.
    pub(super) fn write(&self, path: &Path) -> Result<(), EvaluateError> {
        self.0.write(path)
    }
}

/// Grey picture of a depth image, lit from the camera, darker with distance.
fn shaded(depth: &DepthImage, scale: f64) -> Vec<u8> {
    let [w, h] = CELL;
    let mut out = Vec::with_capacity(3 * (w * h) as usize);
    for v in 0..h {
        for u in 0..w {
            let (x, y) = ((f64::from(u) * scale) as i32, (f64::from(v) * scale) as i32);
            let inside = x < depth.width() as i32 && y < depth.height() as i32;
            let z = if inside { depth.at(x, y) } else { 0 };
            let grey = if z == 0 {
                if inside { 20 } else { 255 }
            } else {
                let near = |d: u16| if d == 0 { f64::from(z) } else { f64::from(d) };
                let slope = |a: u16, b: u16| (near(a) - near(b)) / f64::from(z) * 80.0;
                let (gx, gy) = (
                    slope(depth.at(x + 3, y), depth.at(x - 3, y)),
                    slope(depth.at(x, y + 3), depth.at(x, y - 3)),
                );
                let light = 1.0 / (1.0 + gx * gx + gy * gy).sqrt();
                let far = (f64::from(z) / 5000.0).clamp(0.0, 0.8);
                (40.0 + 215.0 * light * (1.0 - far)) as u8
            };
            out.extend([grey; 3]);
        }
    }
    out
}

/// A straight line of single pixels; parts outside are left out.
fn line(cell: &mut [u8], a: [f64; 2], b: [f64; 2], color: [u8; 3]) {
    let steps = (b[0] - a[0]).abs().max((b[1] - a[1]).abs()).ceil();
    if !steps.is_finite() || steps > 2000.0 {
        return;
    }
    for i in 0..=steps as usize {
        let t = i as f64 / steps.max(1.0);
        let (x, y) = (a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t);
        if x >= 0.0 && y >= 0.0 && x < f64::from(CELL[0]) && y < f64::from(CELL[1]) {
            let at = 3 * (y as usize * CELL[0] as usize + x as usize);
            cell[at..at + 3].copy_from_slice(&color);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_of_empty_images_is_written_and_one_without_cells_is_not() {
        let dir = tempfile::tempdir().expect("folder");
        let camera = Intrinsics::KINECT_V1;
        let mut sheet = ContactSheet::default();
        let path = dir.path().join("new/one.png");
        sheet.write(&path).expect("nothing to do");
        assert!(!path.exists());
        let far = [P3d::new(9e9, 0.0, 1.0); 14];
        let image = DepthImage::empty(640, 480);
        sheet.add(&camera, &image, Some(&far), Some(&[P3d::origin(); 14]));
        sheet.write(&path).expect("written");
        assert!(path.exists());
    }
}
