//! Empty scene in depth, and the person's mask before it.

use super::settings::ExtrinsicsSettings;
use tryon_geometry::camera::{DepthImage, Intrinsics};
use tryon_geometry::math::order_statistics::quantile;

/// Share of a pixel's readings that are at most as far as the empty scene: a person who moves covers a pixel for a part
/// of the time.
const FAR: f64 = 0.9;

/// A pixel of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Pixel {
    /// No reading, where the empty scene has one.
    #[default]
    Unknown,
    /// The scene.
    Scene,
    /// The person.
    Person,
}

/// Depth of the empty scene.
#[derive(Clone, Debug)]
pub(crate) struct DepthBackground {
    camera: Intrinsics,
    /// Millimetres, row-major; 0 where it gives no return.
    far: Vec<u16>,
    before: [f32; 2],
    least_area: f32,
}

impl DepthBackground {
    /// Far end of each pixel's readings; no return where fewer than half of the images have one.
    pub(crate) fn new(
        camera: Intrinsics,
        images: &[&DepthImage],
        settings: &ExtrinsicsSettings,
    ) -> Self {
        let mut readings: Vec<f32> = Vec::new();
        let far = (0..camera.pixels()).map(|i| {
            readings.clear();
            let of_pixel = images.iter().filter_map(|image| image.data().get(i));
            readings.extend(of_pixel.filter(|d| **d > 0).map(|d| f32::from(*d)));
            if 2 * readings.len() < images.len() {
                return 0;
            }
            quantile(&mut readings, FAR).unwrap_or(0.0) as u16
        });
        Self {
            far: far.collect(),
            camera,
            before: settings.before_scene,
            least_area: settings.least_area,
        }
    }

    pub(crate) fn camera(&self) -> &Intrinsics {
        &self.camera
    }

    /// Depth of the empty scene at a pixel (m), infinite without a return; `None` outside of the image.
    pub(crate) fn far(&self, u: i32, v: i32) -> Option<f32> {
        let (width, height) = (self.camera.width as i32, self.camera.height as i32);
        let is_inside = u >= 0 && v >= 0 && u < width && v < height;
        let mm = is_inside.then(|| self.far[(v * width + u) as usize])?;
        Some(if mm == 0 {
            f32::INFINITY
        } else {
            f32::from(mm) / 1000.0
        })
    }

    /// Pixels of the largest connected thing before the scene; empty if that is smaller than a person.
    pub(crate) fn person(&self, depth: &DepthImage) -> Vec<Pixel> {
        let [share, least] = self.before;
        let pixel = |(d, far): (&u16, &u16)| {
            let (z, far) = (f32::from(*d) * 1e-3, f32::from(*far) * 1e-3);
            match (*d > 0, far > 0.0) {
                (false, true) => Pixel::Unknown,
                (false, false) => Pixel::Scene,
                (true, false) => Pixel::Person,
                (true, true) if z < far - least.max(share * far) => Pixel::Person,
                (true, true) => Pixel::Scene,
            }
        };
        let mut mask: Vec<Pixel> = depth.data().iter().zip(&self.far).map(pixel).collect();
        let area = keep_largest(&mut mask, self.camera.width as usize, |i| {
            let z = f32::from(depth.data()[i]) * 1e-3;
            z * z / (self.camera.fx * self.camera.fy) as f32
        });
        if area < self.least_area {
            mask.clear();
        }
        mask
    }
}

/// Makes all connected persons but the largest unknown; returns that one's area.
fn keep_largest(mask: &mut [Pixel], width: usize, area_of: impl Fn(usize) -> f32) -> f32 {
    const FREE: u32 = u32::MAX;
    let mut component = vec![FREE; mask.len()];
    let (mut areas, mut stack) = (Vec::new(), Vec::new());
    for first in 0..mask.len() {
        if mask[first] != Pixel::Person || component[first] != FREE {
            continue;
        }
        let id = areas.len() as u32;
        let mut area = 0.0;
        component[first] = id;
        stack.push(first);
        while let Some(i) = stack.pop() {
            area += area_of(i);
            let column = i % width;
            let columns = column.saturating_sub(1)..(column + 2).min(width);
            let row = i - column;
            for start in [row.wrapping_sub(width), row, row + width] {
                for k in columns.clone().map(|c| start.wrapping_add(c)) {
                    if mask.get(k) == Some(&Pixel::Person) && component[k] == FREE {
                        component[k] = id;
                        stack.push(k);
                    }
                }
            }
        }
        areas.push(area);
    }
    let largest = (0..areas.len()).max_by(|a, b| areas[*a].total_cmp(&areas[*b]));
    for (pixel, id) in mask.iter_mut().zip(component) {
        if *pixel == Pixel::Person && Some(id as usize) != largest {
            *pixel = Pixel::Unknown;
        }
    }
    largest.map_or(0.0, |l| areas[l])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall at 3 m; a square at 2 m that moves, and a speck at 1 m.
    #[test]
    fn the_largest_thing_before_the_scene_is_the_person() {
        let camera = Intrinsics::KINECT_V1.resized(64, 48);
        let image = |left: usize| {
            let mut data = vec![3000; 64 * 48];
            (10..40).for_each(|v| data[v * 64 + left..][..12].fill(2000));
            data[3 * 64 + 60] = 1000;
            DepthImage::new(64, 48, data).expect("64×48")
        };
        let images = [2, 14, 26, 38, 50].map(image);
        let settings = ExtrinsicsSettings::default();
        let refs: Vec<&DepthImage> = images.iter().collect();
        let background = DepthBackground::new(camera, &refs, &settings);
        // The speck is always there: it belongs to the scene.
        assert_eq!(background.far(60, 3), Some(1.0));
        assert_eq!(background.far(20, 20), Some(3.0));
        assert_eq!(background.far(64, 20), None);

        let mask = background.person(&images[1]);
        let count = |kind| mask.iter().filter(|p| **p == kind).count();
        assert_eq!((count(Pixel::Person), count(Pixel::Unknown)), (360, 0));
        let small = ExtrinsicsSettings {
            least_area: 1.0,
            ..settings
        };
        let background = DepthBackground::new(camera, &refs, &small);
        assert!(background.person(&images[1]).is_empty());
    }
}
