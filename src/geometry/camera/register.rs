//! Registration: depth drawn into the colour view, and colours of depth pixels.
//!
//! Each depth pixel draws its footprint, the box around the parallelogram to its neighbours on the same surface, with the
//! plane of their depths and a z-test. Surfaces have no holes, and no edge of depth is bridged. 2.3 ms for 640 × 576 into
//! 1280 × 720 on one thread.

mod footprint;
mod projection;

use super::{ColorImage, DepthImage, FrameSizeError, Intrinsics, LensCalibration};
use footprint::{EMPTY, FootprintBlock, FootprintModel, RowWindow};
use projection::{BLOCK, ProjectedRow, Projection};

/// Depth nearer than a point by more than this share hides it from the colour camera.
const HIDDEN_SHARE: f32 = 0.02;

/// Maps between a depth camera and the pinhole of its colour camera: tables are built once (0.1 s), a frame allocates
/// nothing.
///
/// Depth is taken with the distortion of the lens given, so raw images need no rectification; give a
/// [`Calibration`](super::Calibration) for rectified ones. Colour images are rectified ones.
#[derive(Clone, Debug)]
pub struct Registration {
    depth: Intrinsics,
    color: Intrinsics,
    projection: Projection,
    model: FootprintModel,
    rows: [ProjectedRow; 3],
}

impl Registration {
    /// Tabulates the rays of all depth pixels. Without a colour camera the colour view is the depth camera's pinhole.
    pub fn new(lenses: impl Into<LensCalibration>) -> Self {
        let lenses = lenses.into();
        let depth = lenses.depth.intrinsics;
        let color = lenses.color.map_or(depth, |lens| lens.intrinsics);
        let projection = Projection::new(&lenses, &color);
        Self {
            depth,
            color,
            model: FootprintModel {
                steps: steps(&lenses, &color),
                size: [color.width as f32, color.height as f32],
            },
            rows: std::array::from_fn(|_| ProjectedRow::new(depth.width as usize)),
            projection,
        }
    }

    /// Draws depth \[mm\] into the colour view: `out` takes the colour camera's size, with depth along its axis, 0 where the
    /// depth camera reads nothing.
    ///
    /// # Errors
    /// A depth image that has not the size of its camera.
    pub fn depth_in_color(
        &mut self,
        depth: &DepthImage,
        out: &mut DepthImage,
    ) -> Result<(), FrameSizeError> {
        FrameSizeError::check("depth image", depth.size(), self.depth.size())?;
        out.resize(self.color.size());
        out.data_mut().fill(EMPTY);
        if self.color.width > 1 && self.color.height > 1 {
            draw(self, depth.data(), out.data_mut());
        }
        for reading in out.data_mut() {
            *reading = if *reading == EMPTY { 0 } else { *reading };
        }
        Ok(())
    }

    /// Colour of each depth pixel, from the nearest pixel of a rectified colour image: `out` takes the depth camera's size,
    /// black without reading and out of view. With `registered`, depth in the colour view, points that the colour camera
    /// does not see are black too.
    ///
    /// # Errors
    /// An image that has not the size of its camera.
    pub fn color_in_depth(
        &self,
        depth: &DepthImage,
        color: &ColorImage,
        registered: Option<&DepthImage>,
        out: &mut ColorImage,
    ) -> Result<(), FrameSizeError> {
        FrameSizeError::check("depth image", depth.size(), self.depth.size())?;
        FrameSizeError::check("colour image", color.size(), self.color.size())?;
        if let Some(registered) = registered {
            let (got, expected) = (registered.size(), self.color.size());
            FrameSizeError::check("registered depth image", got, expected)?;
        }

        out.resize(self.depth.size());
        let width = (self.depth.width as usize).max(1);
        let (pixels, _) = out.data_mut().as_chunks_mut::<3>();
        let rows = pixels.chunks_mut(width).zip(depth.data().chunks(width));
        for (v, (pixels, depth)) in rows.enumerate() {
            for (u, (out, reading)) in pixels.iter_mut().zip(depth).enumerate() {
                let point = self.projection.pixel([u, v], *reading);
                let seen = self.nearest(point, registered);
                *out = seen.map_or([0; 3], |[x, y]| color.at(x, y));
            }
        }
        Ok(())
    }

    /// Colour pixel nearest to a point of the colour view, if it shows the point.
    fn nearest(&self, [u, v, z]: [f32; 3], registered: Option<&DepthImage>) -> Option<[u32; 2]> {
        let (x, y) = (u + 0.5, v + 0.5);
        let (width, height) = (self.color.width as f32, self.color.height as f32);
        let is_inside = x >= 0.0 && y >= 0.0 && x < width && y < height;
        if z <= 0.0 || !is_inside {
            return None;
        }
        let is_hidden = registered.is_some_and(|image| {
            let front = f32::from(image.at(x as i32, y as i32));
            front > 0.0 && front < z * (1.0 - HIDDEN_SHARE)
        });
        (!is_hidden).then_some([x as u32, y as u32])
    }
}

/// Columns and rows between neighbouring depth pixels in the colour view: of a plane in front, without the baseline.
fn steps(lenses: &LensCalibration, color: &Intrinsics) -> [[f32; 2]; 2] {
    let depth = &lenses.depth.intrinsics;
    let step = |x: f64, y: f64| {
        let d = lenses
            .color_from_depth
            .vector(&nalgebra::Vector3::new(x, y, 0.0));
        [(d.x * color.fx) as f32, (d.y * color.fy) as f32]
    };
    [step(1.0 / depth.fx, 0.0), step(0.0, 1.0 / depth.fy)]
}

/// Draws all rows; compiled a second time for AVX2, with the same bits.
fn draw(registration: &mut Registration, depth: &[u16], out: &mut [u16]) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn draw_avx2(registration: &mut Registration, depth: &[u16], out: &mut [u16]) {
            draw_rows(registration, depth, out);
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // Sound: the feature was just detected.
            #[allow(unsafe_code)]
            unsafe {
                return draw_avx2(registration, depth, out);
            }
        }
    }
    draw_rows(registration, depth, out);
}

#[inline(always)]
fn draw_rows(registration: &mut Registration, depth: &[u16], out: &mut [u16]) {
    let (height, width) = (
        registration.depth.height as usize,
        registration.depth.width as usize,
    );
    let [above, middle, below] = &mut registration.rows;
    above.clear();
    registration.projection.row(0, depth, middle);
    for v in 0..height {
        if v + 1 < height {
            registration.projection.row(v + 1, depth, below);
        } else {
            below.clear();
        }
        let rows = RowWindow {
            above,
            middle,
            below,
        };
        for first in (0..width).step_by(BLOCK) {
            if !middle.has_readings(first) {
                continue;
            }
            let block = registration.model.block(&rows, first);
            draw_block(&block, registration.color.width as usize, out);
            if block.is_large.contains(&true) {
                draw_large(&registration.model, &rows, &block, first, out);
            }
        }
        std::mem::swap(above, middle);
        std::mem::swap(middle, below);
    }
}

/// Draws the 2 × 2 colour pixels of each footprint.
///
/// One of the four at a time: two next to each other would be stored as one, and the next footprint would wait for it.
#[inline(always)]
fn draw_block(block: &FootprintBlock, width: usize, out: &mut [u16]) {
    for (depth, shift) in block.depth.iter().zip([0, 1, width, width + 1]) {
        for (offset, depth) in block.offset.iter().zip(depth) {
            if let Some(nearest) = out.get_mut(*offset as usize + shift) {
                *nearest = (*nearest).min(*depth);
            }
        }
    }
}

/// Draws the footprints of a block that have more than 2 × 2 colour pixels.
#[cold]
fn draw_large(
    model: &FootprintModel,
    rows: &RowWindow<'_>,
    block: &FootprintBlock,
    first: usize,
    out: &mut [u16],
) {
    let width = model.size[0] as usize;
    for k in (0..BLOCK).filter(|k| block.is_large[*k]) {
        let footprint = model.footprint(rows, first + k);
        let [columns, lines] =
            [0, 1].map(|c| footprint.first[c] as usize..footprint.end[c] as usize);
        for y in lines {
            for x in columns.clone() {
                let nearest = &mut out[y * width + x];
                *nearest = (*nearest).min(footprint.depth([x as f32, y as f32]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Calibration, Distortion};
    use crate::fixtures::{RegistrationScore, TwoCameras};
    use crate::math::Rigid;
    use nalgebra::{UnitQuaternion, Vector3};

    const DEPTH: Intrinsics = Intrinsics {
        width: 200,
        height: 150,
        fx: 160.0,
        fy: 160.0,
        cx: 99.5,
        cy: 74.5,
    };

    fn registered(lenses: impl Into<LensCalibration>, depth: &DepthImage) -> DepthImage {
        let mut out = DepthImage::default();
        let done = Registration::new(lenses).depth_in_color(depth, &mut out);
        done.expect("the size of the camera");
        out
    }
    fn pair(color: Intrinsics, shift: f64, roll: f64) -> Calibration {
        let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
        Calibration {
            depth: DEPTH,
            color: Some(color),
            color_from_depth: Rigid::from_parts(Vector3::new(shift, 0.0, 0.0), roll),
        }
    }
    fn image(reading: impl Fn(i32, i32) -> u16) -> DepthImage {
        let mut image = DepthImage::empty(DEPTH.width, DEPTH.height);
        for (i, d) in image.data_mut().iter_mut().enumerate() {
            *d = reading(i as i32 % 200, i as i32 / 200);
        }
        image
    }
    /// Pixels without reading in the middle half of an image.
    fn holes(image: &DepthImage) -> usize {
        let (w, h) = (image.width() as i32, image.height() as i32);
        let middle = (h / 4..3 * h / 4).flat_map(|v| (w / 4..3 * w / 4).map(move |u| (u, v)));
        middle.filter(|(u, v)| image.at(*u, *v) == 0).count()
    }

    /// Analytic wall and sphere through both lenses.
    #[test]
    fn registered_depth_is_that_of_the_scene() {
        let scene = TwoCameras::azure_kinect();
        let (raw, truth) = (scene.raw_depth(), scene.registered_truth());
        let score = RegistrationScore::new(&registered(scene.lenses, &raw), &truth);
        assert!(score.within_a_pixel > 0.999, "{score:?}");
        assert!(score.at_the_pixel > 0.995, "{score:?}");
        assert!(score.holes < 2e-5, "{score:?}");
        assert!(score.mean_error_mm < 0.4, "{score:?}");
    }

    #[test]
    fn the_same_view_keeps_its_readings() {
        let depth = image(|u, v| ((u * 7919 + v * 104_729) % 4000 + 400) as u16);
        assert_eq!(registered(Calibration::registered(DEPTH), &depth), depth);
        assert_eq!(registered(pair(DEPTH, 0.0, 0.0), &depth), depth);
    }

    #[test]
    fn nothing_is_drawn_without_readings() {
        let empty = registered(pair(DEPTH, 0.05, 0.0), &image(|_, _| 0));
        assert!(empty.data().iter().all(|d| *d == 0));
        let none = Intrinsics {
            width: 0,
            height: 0,
            ..DEPTH
        };
        let nothing = registered(Calibration::registered(none), &DepthImage::default());
        assert_eq!(nothing, DepthImage::default());
        let thin = Intrinsics { width: 1, ..DEPTH };
        assert_eq!(
            holes(&registered(pair(thin, 0.0, 0.0), &image(|_, _| 900))),
            0
        );
        let e = Registration::new(pair(DEPTH, 0.0, 0.0))
            .depth_in_color(&DepthImage::empty(3, 2), &mut DepthImage::default());
        assert_eq!(e.map_err(|e| e.got), Err([3, 2]));
    }

    /// The gap beside the front has the width of the disparity: 0.05 · 160 (1/1 − 1/3) pixels.
    #[test]
    fn edges_are_not_bridged() {
        let depth = image(|u, _| if u < 100 { 1000 } else { 3000 });
        for shift in [-0.05, 0.05] {
            let out = registered(pair(DEPTH, shift, 0.0), &depth);
            assert!(out.data().iter().all(|d| [0, 1000, 3000].contains(d)));
            let gap = holes(&out) as f64 / 75.0;
            let want = if shift < 0.0 {
                0.05 * 160.0 * 2.0 / 3.0
            } else {
                0.0
            };
            assert!((gap - want).abs() <= 1.0, "{gap} of {want} pixels");
        }
    }

    #[test]
    fn one_pixel_is_drawn_as_large_as_it_is() {
        let depth = image(|u, v| if (u, v) == (100, 75) { 2000 } else { 0 });
        let four = registered(pair(DEPTH.resized(800, 600), 0.0, 0.0), &depth);
        let drawn = four.data().iter().filter(|d| **d == 2000).count();
        assert!((16..=25).contains(&drawn), "{drawn}");
    }

    #[test]
    fn surfaces_have_no_holes_in_larger_and_rolled_views() {
        let slanted = image(|u, v| (1500 + 4 * u - 3 * v) as u16);
        for size in [[200, 150], [280, 210], [390, 290], [1000, 750]] {
            for roll in [0.0, 0.05, 0.8, std::f64::consts::FRAC_PI_2] {
                let color = DEPTH.resized(size[0], size[1]);
                let out = registered(pair(color, -0.03, roll), &slanted);
                assert_eq!(holes(&out), 0, "{size:?}, {roll}");
            }
        }
    }

    #[test]
    fn folding_lenses_and_broken_cameras_draw_what_they_read() {
        let mut lenses = LensCalibration::from(pair(DEPTH, 0.05, 0.0));
        lenses.depth.distortion = Distortion::from_opencv(&[-0.9, 0.0, 0.0, 0.0]).expect("finite");
        let out = registered(lenses.clone(), &image(|_, _| 1000));
        assert_eq!((out.at(0, 0), out.at(107, 75)), (0, 1000));
        for bad in [0.0, f64::NAN, f64::INFINITY] {
            lenses.depth.intrinsics.fx = bad;
            registered(lenses.clone(), &image(|_, _| 1000));
            let color = Intrinsics { fx: bad, ..DEPTH };
            registered(pair(color, 0.05, 0.0), &image(|_, _| 1000));
            registered(pair(DEPTH, bad, 0.0), &image(|_, _| 1000));
        }
    }

    /// A front of 1 m hides a strip of the wall from the colour camera.
    #[test]
    fn colors_are_those_of_points_that_the_color_camera_sees() {
        let depth = image(|u, _| if u < 100 { 1000 } else { 3000 });
        let cameras = pair(DEPTH, 0.05, 0.0);
        let registered = registered(cameras.clone(), &depth);
        let ramp = (0..150).flat_map(|_| (0..200).flat_map(|u| [u as u8, 1, 1]));
        let color = ColorImage::new(200, 150, ramp.collect()).expect("200×150");
        let (registration, mut out) = (Registration::new(cameras), ColorImage::default());
        let done = registration.color_in_depth(&depth, &color, Some(&registered), &mut out);
        done.expect("sizes");
        assert_eq!(out.at(50, 75)[0], 58);
        assert_eq!(out.at(150, 75)[0], 153);
        let hidden = (100..190).filter(|u| out.at(*u, 75) == [0; 3]).count();
        assert!((4..=7).contains(&hidden), "{hidden}");
        assert_eq!(out.at(199, 75)[0], 0);
    }
}
