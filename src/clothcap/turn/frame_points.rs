//! Points of one frame on the tracked subject, with normals from local planes of the depth image.

use crate::scan::BodyScan;
use crate::settings::FramePointSettings;
use nalgebra::{Matrix3, Vector3};
use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::{Camera, P3, Rigid, V3, World};
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::PointTree;

/// Points of a frame on the subject whose tracked body is `posed`; camera frame, metres. Readings near the floor are left
/// out where it is known.
pub(super) fn camera_points(
    frame: &RgbdFrame,
    calibration: &Calibration,
    posed: &[P3],
    floor: Option<&Rigid<World, Camera>>,
    settings: &FramePointSettings,
) -> BodyScan {
    let image = DepthReader {
        depth: &frame.depth,
        camera: &calibration.depth,
        settings,
    };
    let mask = image.subject(posed, floor);
    let pixels: Vec<usize> = (0..mask.len()).filter(|i| mask[*i]).collect();
    let mut local = Vec::new();
    par::map_into(Par::Rayon, pixels.len(), 256, &mut local, |k| {
        image.local_plane(pixels[k], &mask)
    });
    let mut out = BodyScan {
        oriented: true,
        ..BodyScan::default()
    };
    for (point, normal) in local.into_iter().flatten() {
        if let Some(color) = &frame.color {
            // Black outside of the image.
            out.colors
                .push(calibration.color_at(color, &point).unwrap_or_default());
        }
        out.point_of_row.push(out.points.len() as u32);
        out.points.push(point);
        out.normals.push(normal);
    }
    out
}

struct DepthReader<'a> {
    depth: &'a DepthImage,
    camera: &'a Intrinsics,
    settings: &'a FramePointSettings,
}

impl DepthReader<'_> {
    fn at(&self, i: usize) -> (i32, i32) {
        let width = self.depth.width() as usize;
        ((i % width) as i32, (i / width) as i32)
    }

    /// Metres; 0 without a reading.
    fn z(&self, u: i32, v: i32) -> f32 {
        f32::from(self.depth.at(u, v)) * 1e-3
    }

    fn point(&self, i: usize) -> P3 {
        let (u, v) = self.at(i);
        self.camera.unproject(u as f32, v as f32, self.z(u, v))
    }

    /// Pixels of the subject: connected to readings on the tracked body, off it by less than cloth stands off.
    fn subject(&self, posed: &[P3], floor: Option<&Rigid<World, Camera>>) -> Vec<bool> {
        let settings = self.settings;
        let tree = PointTree::new(posed);
        let up = floor.map(|w| (w.inverse().vector(&Vector3::y()).cast::<f32>(), w));
        let above = |p: &P3| match &up {
            Some((up, w)) => {
                up.dot(&p.coords) + w.iso().translation.vector.y as f32 > settings.floor
            }
            None => true,
        };
        let mut off = Vec::new();
        par::map_into(Par::Rayon, self.depth.data().len(), 512, &mut off, |i| {
            let p = self.point(i);
            if p.z <= 0.0 || !above(&p) {
                return f32::INFINITY;
            }
            let nearest = tree.nearest(&p, settings.farthest);
            nearest.map_or(f32::INFINITY, |(_, d2)| d2.sqrt())
        });
        let mut mask: Vec<bool> = off.iter().map(|d| *d < settings.certain).collect();
        let mut open: Vec<usize> = (0..mask.len()).filter(|i| mask[*i]).collect();
        let width = self.depth.width() as i32;
        while let Some(i) = open.pop() {
            let (u, v) = self.at(i);
            for (du, dv) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                let (a, b) = (self.z(u, v), self.z(u + du, v + dv));
                let j = ((v + dv) * width + u + du) as usize;
                if b > 0.0 && !mask[j] && off[j].is_finite() && (a - b).abs() < settings.step * a {
                    mask[j] = true;
                    open.push(j);
                }
            }
        }
        mask
    }

    /// Point and unit normal of the plane through the readings about a pixel; `None` at rims and grazing angles.
    fn local_plane(&self, i: usize, mask: &[bool]) -> Option<(P3, V3)> {
        let settings = self.settings;
        let (window, rim) = (settings.window, settings.rim);
        let (u, v) = self.at(i);
        let z = self.z(u, v);
        let width = self.depth.width() as i32;
        let (mut h, mut g) = (Matrix3::<f32>::zeros(), Vector3::<f32>::zeros());
        let mut count = 0;
        for dv in -window..=window {
            for du in -window..=window {
                let other = self.z(u + du, v + dv);
                let is_near = du.abs() <= rim && dv.abs() <= rim;
                if other <= 0.0 || (other - z).abs() > 2.0 * settings.step * z {
                    if is_near {
                        return None;
                    }
                    continue;
                }
                if !mask[((v + dv) * width + u + du) as usize] {
                    continue;
                }
                // Inverse depth of a plane is linear in the pixel.
                let row = Vector3::new(1.0, du as f32, dv as f32);
                h += row * row.transpose();
                g += row / other;
                count += 1;
            }
        }
        if count < settings.least {
            return None;
        }
        let [a, b, c] = h.cholesky()?.solve(&g).into();
        let camera = self.camera;
        let (fx, fy) = (camera.fx as f32, camera.fy as f32);
        let (x, y) = (u as f32 - camera.cx as f32, v as f32 - camera.cy as f32);
        // 1/z = a + b (u' − u) + c (v' − v) is the plane n · p = 1 with these components.
        let plane = V3::new(b * fx, c * fy, a - b * x - c * y);
        let point = camera.unproject(u as f32, v as f32, 1.0 / a);
        let normal = -plane.try_normalize(f32::MIN_POSITIVE)?;
        let cosine = -normal.dot(&point.coords.normalize());
        (a > 0.0 && cosine > settings.grazing).then_some((point, normal))
    }
}
