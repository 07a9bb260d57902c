//! Outline of the person in depth: points on its rim, with the direction of the rim.

use super::depth_background::{DepthBackground, Pixel};
use super::settings::ExtrinsicsSettings;
use nalgebra::Vector2;
use tryon_geometry::camera::{DepthImage, Intrinsics};
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::math::{P3d, V3d};

/// Margin of the image in which the outline is that of the image (depth pixels).
const MARGIN: i32 = 6;
/// Distances from the rim to the middles of the windows of 5 × 5 in which depth is read (depth pixels).
const INSIDE: [f32; 2] = [2.5, 6.0];
const OUTSIDE: f32 = 4.0;
/// Largest depth of the rim behind its first window (m).
const MOST_BEND: f32 = 0.12;
/// Readings that a window needs.
const LEAST_READINGS: usize = 6;
/// Share of readings around a rim point that are known; a shadow of the projector leaves fewer.
const LEAST_KNOWN: f32 = 0.5;
/// Slope of the smoothed mask across a rim, per pixel: a straight rim has 0.23.
const LEAST_SLOPE: f32 = 0.1;

/// A point of the rim, depth camera frame, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RimPoint {
    pub(crate) point: P3d,
    /// Displacement by one depth pixel along the rim; in the image, (y, −x) of it leads away from the person.
    pub(crate) tangent: V3d,
}

/// Outline of one frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct PersonOutline {
    pub(crate) points: Vec<RimPoint>,
    /// Middle of the rim, metres.
    pub(crate) centre: P3d,
}

/// Outline of the person in a frame; `None` without a person.
pub(crate) fn outline(
    depth: &DepthImage,
    scene: &DepthBackground,
    settings: &ExtrinsicsSettings,
) -> Option<PersonOutline> {
    let mask = scene.person(depth);
    if mask.is_empty() {
        return None;
    }
    let view = MaskedDepth {
        depth,
        mask: &mask,
        scene,
        behind: settings.behind,
    };
    let soft = SoftMask::new(&mask, scene.camera(), settings.smoothing);
    let mut points = Vec::new();
    soft.rim(|at, outward| points.extend(view.rim_point(at, outward)));
    let stride = points.len().div_ceil(settings.points.max(1)).max(1);
    let points: Vec<RimPoint> = points.into_iter().step_by(stride).collect();
    let sum: V3d = points.iter().map(|p| p.point.coords).sum();
    let centre = P3d::from(sum / points.len().max(1) as f64);
    (!points.is_empty()).then_some(PersonOutline { points, centre })
}

/// Depth image with its mask.
struct MaskedDepth<'a> {
    depth: &'a DepthImage,
    mask: &'a [Pixel],
    scene: &'a DepthBackground,
    behind: f32,
}

impl MaskedDepth<'_> {
    /// Place in space of an image point on the rim, if the scene is far behind it.
    fn rim_point(&self, at: Vector2<f32>, outward: Vector2<f32>) -> Option<RimPoint> {
        let k = self.scene.camera();
        let z = self.rim_depth(at, outward)?;
        let far = self.far_outside(at + outward * OUTSIDE)?;
        if far < z + self.behind {
            return None;
        }
        let on = |p: Vector2<f32>| k.unproject(p.x, p.y, z).cast::<f64>();
        let point = on(at);
        let tangent = on(at + Vector2::new(-outward.y, outward.x)) - point;
        Some(RimPoint { point, tangent })
    }

    /// Depth of the person at the rim, metres. Skin bends away from the camera there: the depth of a round limb is that
    /// of its rim less a multiple of the root of the distance to the rim, and two windows give both.
    fn rim_depth(&self, at: Vector2<f32>, outward: Vector2<f32>) -> Option<f32> {
        let [first, second] = INSIDE.map(|d| self.depth_around(at - outward * d));
        let [near, far] = INSIDE.map(f32::sqrt);
        let first = first?;
        let bend = second.map_or(0.0, |second| (first - second) * near / (far - near));
        Some(first + bend.clamp(0.0, MOST_BEND))
    }

    /// Depth of the person around an image point, metres.
    fn depth_around(&self, at: Vector2<f32>) -> Option<f32> {
        let mut readings: Vec<f32> = self
            .window(at)
            .filter(|(i, ..)| self.mask[*i] == Pixel::Person)
            .map(|(i, ..)| f32::from(self.depth.data()[i]) * 1e-3)
            .collect();
        if readings.len() < LEAST_READINGS {
            return None;
        }
        median(&mut readings)
    }

    /// Depth of the nearest scene around an image point, metres; `None` beside the image.
    fn far_outside(&self, at: Vector2<f32>) -> Option<f32> {
        let far = self.window(at).filter_map(|(_, u, v)| self.scene.far(u, v));
        far.reduce(f32::min)
    }

    /// Index, column and row of 5 × 5 pixels, of those inside the image.
    fn window(&self, at: Vector2<f32>) -> impl Iterator<Item = (usize, i32, i32)> {
        let k = self.scene.camera();
        let (width, height) = (k.width as i32, k.height as i32);
        let (u, v) = (at.x.round() as i32, at.y.round() as i32);
        let around = (-2..3).flat_map(move |y| (-2..3).map(move |x| (u + x, v + y)));
        let inside = move |&(u, v): &(i32, i32)| u >= 0 && v >= 0 && u < width && v < height;
        around
            .filter(inside)
            .map(move |(u, v)| ((v * width + u) as usize, u, v))
    }
}

/// Share of the person around each pixel among the known pixels, by normalised convolution with a Gaussian.
struct SoftMask {
    width: usize,
    height: usize,
    /// NaN where too little is known.
    share: Vec<f32>,
}

impl SoftMask {
    fn new(mask: &[Pixel], camera: &Intrinsics, sigma: f32) -> Self {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let radius = (2.5 * sigma).ceil() as i32;
        let kernel: Vec<f32> = (-radius..=radius)
            .map(|x| (-0.5 * (x as f32 / sigma).powi(2)).exp())
            .collect();
        let sum: f32 = kernel.iter().sum();
        let kernel: Vec<f32> = kernel.iter().map(|k| k / sum).collect();
        let plane = |of: &dyn Fn(Pixel) -> bool| {
            let hard = mask.iter().map(|p| f32::from(u8::from(of(*p)))).collect();
            blur(hard, width, &kernel)
        };
        let person = plane(&|p| p == Pixel::Person);
        let known = plane(&|p| p != Pixel::Unknown);
        let share = person.iter().zip(known).map(|(person, known)| {
            if known < LEAST_KNOWN {
                f32::NAN
            } else {
                person / known
            }
        });
        Self {
            share: share.collect(),
            width,
            height,
        }
    }

    /// Calls `found` with each place where half of the surroundings are the person, and the unit normal away from it.
    fn rim(&self, mut found: impl FnMut(Vector2<f32>, Vector2<f32>)) {
        let margin = MARGIN as usize;
        for v in margin..self.height.saturating_sub(margin) {
            for u in margin..self.width.saturating_sub(margin) {
                let i = v * self.width + u;
                let here = self.share[i];
                for (to, step) in [(i + 1, Vector2::x()), (i + self.width, Vector2::y())] {
                    let there = self.share[to];
                    let is_crossed = (here < 0.5) != (there < 0.5);
                    if !is_crossed || here.is_nan() || there.is_nan() {
                        continue;
                    }
                    let part = (0.5 - here) / (there - here);
                    let near = if part < 0.5 { i } else { to };
                    let slope = self.slope(near);
                    let is_across =
                        slope.dot(&step).abs() * std::f32::consts::SQRT_2 >= slope.norm();
                    if is_across && slope.norm() >= LEAST_SLOPE {
                        let at = Vector2::new(u as f32, v as f32) + step * part;
                        found(at, -slope.normalize());
                    }
                }
            }
        }
    }

    /// Gradient by central differences; NaN beside what is unknown.
    fn slope(&self, i: usize) -> Vector2<f32> {
        let s = &self.share;
        let w = self.width;
        Vector2::new(s[i + 1] - s[i - 1], s[i + w] - s[i - w]) * 0.5
    }
}

/// Separable convolution; borders repeat.
fn blur(image: Vec<f32>, width: usize, kernel: &[f32]) -> Vec<f32> {
    let height = image.len() / width.max(1);
    let radius = (kernel.len() / 2) as i32;
    let mut across = vec![0.0; image.len()];
    for (row, out) in image
        .chunks_exact(width)
        .zip(across.chunks_exact_mut(width))
    {
        if row.iter().all(|p| *p == row[0]) {
            out.fill(row[0]);
            continue;
        }
        for (u, out) in out.iter_mut().enumerate() {
            *out = kernel
                .iter()
                .enumerate()
                .map(|(k, w)| {
                    w * row[(u as i32 + k as i32 - radius).clamp(0, width as i32 - 1) as usize]
                })
                .sum();
        }
    }
    let mut out = vec![0.0; image.len()];
    for (v, row) in out.chunks_exact_mut(width).enumerate() {
        for (k, w) in kernel.iter().enumerate() {
            let from = (v as i32 + k as i32 - radius).clamp(0, height as i32 - 1) as usize;
            for (out, from) in row.iter_mut().zip(&across[from * width..][..width]) {
                *out += w * from;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An upright cylinder of 0.12 m radius whose axis is 2.4 m away: its rim is as far as the axis.
    #[test]
    fn the_rim_of_a_limb_is_behind_what_is_seen_of_it() {
        let camera = Intrinsics::KINECT_V1;
        let row: Vec<u16> = (0..640u16)
            .map(|u| {
                let x = (f64::from(u) - 319.5) / 525.0;
                // |(x z, z − 2.4)| = 0.12
                let (a, b) = (1.0 + x * x, 2.4);
                let root = b * b - a * (2.4 * 2.4 - 0.12 * 0.12);
                if root < 0.0 {
                    return 4000;
                }
                (1e3 * (b - root.sqrt()) / a).round() as u16
            })
            .collect();
        let image = DepthImage::new(640, 480, row.repeat(480)).expect("640×480");
        let wall = DepthImage::new(640, 480, vec![4000; 640 * 480]).expect("640×480");
        let settings = ExtrinsicsSettings::default();
        let scene = DepthBackground::new(camera, &[&wall], &settings);
        let found = outline(&image, &scene, &settings).expect("a limb");
        for p in &found.points {
            assert!((p.point.z - 2.4).abs() < 0.015, "{}", p.point);
        }
    }

    /// A disc of 0.5 m radius at 2 m before a wall at 3 m: its outline is a circle, at the depth of the disc.
    #[test]
    fn the_outline_of_a_disc_is_a_circle() {
        let camera = Intrinsics::KINECT_V1;
        let radius = 0.5 * 525.0 / 2.0;
        let (cx, cy) = (300.25, 250.5);
        let disc = |u: f32, v: f32| (u - cx).hypot(v - cy) < radius;
        let pixels = (0..480).flat_map(|v| (0..640).map(move |u| (u as f32, v as f32)));
        let image = pixels.map(|(u, v)| if disc(u, v) { 2000 } else { 3000 });
        let image = DepthImage::new(640, 480, image.collect()).expect("640×480");
        let wall = DepthImage::new(640, 480, vec![3000; 640 * 480]).expect("640×480");
        let settings = ExtrinsicsSettings::default();
        let scene = DepthBackground::new(camera, &[&wall], &settings);

        let found = outline(&image, &scene, &settings).expect("a disc");
        assert!(found.points.len() > 150 && found.points.len() <= settings.points);
        let mut off = Vec::new();
        for p in &found.points {
            let at = camera.project(&p.point.cast());
            let from_centre = Vector2::new(at.x - cx, at.y - cy);
            off.push(from_centre.norm() - radius);
            // Turned to the right of the tangent is away from the person.
            let outward = Vector2::new(p.tangent.y, -p.tangent.x).normalize();
            assert!(outward.dot(&from_centre.normalize().cast()) > 0.95);
            assert!((p.point.z - 2.0).abs() < 1e-6);
        }
        let mean = off.iter().sum::<f32>() / off.len() as f32;
        assert!(mean.abs() < 0.1, "{mean} pixels");
        assert!(off.iter().all(|o| o.abs() < 0.8));

        let near = DepthImage::new(640, 480, vec![2300; 640 * 480]).expect("640×480");
        let scene = DepthBackground::new(camera, &[&near], &settings);
        assert!(
            outline(&image, &scene, &settings).is_none(),
            "0.3 m before the wall"
        );
    }
}
