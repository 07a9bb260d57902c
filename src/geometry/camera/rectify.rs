//! Rectification: frames of real lenses as the pinholes of the same intrinsics draw them.

use super::resample::{ColorTable, DepthTable};
use super::undistort::LensRays;
use super::{
    Calibration, ColorImage, DepthImage, FrameSizeError, Lens, LensCalibration, RgbdFrame,
};

/// Removes lens distortion from frames: tables are built once (0.1 s), a frame allocates nothing.
///
/// Depth is sampled at the nearest pixel and never blended, colour bilinearly. Pixels whose ray a lens does not draw
/// become 0 (no reading) and black. A camera without distortion costs nothing.
#[derive(Clone, Debug)]
pub struct Rectifier {
    calibration: Calibration,
    depth: Option<DepthTable>,
    color: Option<ColorTable>,
    /// Images exchanged with those of a frame.
    spare: (DepthImage, ColorImage),
}

impl Rectifier {
    /// Tables of both lenses. Colour that is registered to depth has the depth camera's lens.
    pub fn new(lenses: &LensCalibration) -> Self {
        let color = lenses.color.unwrap_or(lenses.depth);
        Self {
            calibration: lenses.pinholes(),
            depth: table(lenses.depth, DepthTable::new),
            color: table(color, ColorTable::new),
            spare: <_>::default(),
        }
    }

    /// Calibration of rectified frames: the lenses' pinholes.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// True if frames stay as they are.
    pub fn is_identity(&self) -> bool {
        self.depth.is_none() && self.color.is_none()
    }

    /// Replaces the images of a frame by rectified ones.
    ///
    /// # Errors
    /// An image that has not the size of its camera; the frame is then unchanged.
    pub fn rectify(&mut self, frame: &mut RgbdFrame) -> Result<(), FrameSizeError> {
        let depth = self.calibration.depth;
        FrameSizeError::check("depth image", frame.depth.size(), depth.size())?;
        if let Some(color) = &frame.color {
            let camera = self.calibration.color.unwrap_or(depth);
            FrameSizeError::check("colour image", color.size(), camera.size())?;
        }

        let (spare_depth, spare_color) = &mut self.spare;
        if let Some(table) = &self.depth {
            spare_depth.resize(frame.depth.size());
            table.apply(&frame.depth, spare_depth);
            std::mem::swap(&mut frame.depth, spare_depth);
        }
        if let (Some(table), Some(color)) = (&self.color, &mut frame.color) {
            spare_color.resize(color.size());
            table.apply(color, spare_color);
            std::mem::swap(color, spare_color);
        }
        Ok(())
    }
}

/// Table of a lens, if it distorts.
fn table<T>(lens: Lens, new: impl Fn(&LensRays, [u32; 2]) -> T) -> Option<T> {
    let size = lens.intrinsics.size();
    (!lens.distortion.is_none()).then(|| new(&LensRays::new(lens), size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Distortion, Intrinsics};
    use crate::fixtures::TwoCameras;

    fn frame(depth: DepthImage, color: Option<ColorImage>) -> RgbdFrame {
        RgbdFrame {
            sequence: 1,
            time_ns: 2,
            depth,
            color,
        }
    }
    /// Depth camera of 640 × 480 without colour.
    fn lens(focal: f64, coefficients: &[f64]) -> LensCalibration {
        let intrinsics = Intrinsics {
            fx: focal,
            fy: focal,
            ..Intrinsics::KINECT_V1
        };
        let mut lenses = LensCalibration::from(Calibration::registered(intrinsics));
        lenses.depth.distortion = Distortion::from_opencv(coefficients).expect("finite");
        lenses
    }

    /// The same scene through the lens and through the pinhole, nearest pixels.
    #[test]
    fn rectified_depth_is_that_of_a_pinhole() {
        let mut scene = TwoCameras::azure_kinect();
        let mut rectifier = Rectifier::new(&scene.lenses);
        let mut got = frame(scene.raw_depth(), None);
        rectifier.rectify(&mut got).expect("size of the camera");
        scene.lenses.depth.distortion = Distortion::default();
        let want = scene.raw_depth();

        let (mut readings, mut right) = (0, 0);
        for v in 1..575 {
            for u in 1..639 {
                let reading = i32::from(got.depth.at(u, v));
                if reading > 0 {
                    let mut around = (0..9).map(|i| want.at(u + i % 3 - 1, v + i / 3 - 1));
                    readings += 1;
                    right +=
                        i32::from(around.any(|w| (reading - i32::from(w)).abs() * 200 <= reading));
                }
            }
        }
        assert!(
            readings > 300_000 && right * 1000 > readings * 999,
            "{right} of {readings}"
        );
    }

    /// A ramp, whose bilinear samples are the source coordinates themselves.
    #[test]
    fn rectified_color_is_sampled_at_the_source() {
        let lenses = lens(525.0, &[0.1, -0.2, 0.001, -0.001, 0.05]);
        let ramp = (0..480u32)
            .flat_map(|v| (0..640u32).flat_map(move |u| [u / 4, v / 2, 7].map(|c| c as u8)));
        let color = ColorImage::new(640, 480, ramp.collect()).expect("640×480");
        let mut got = frame(DepthImage::empty(640, 480), Some(color));
        Rectifier::new(&lenses).rectify(&mut got).expect("sizes");
        let color = got.color.expect("colour stays");
        let rays = LensRays::new(lenses.depth);
        for (u, v) in [(100, 100), (320, 240), (500, 50), (600, 400)] {
            let [x, y] = rays.source([f64::from(u), f64::from(v)]).expect("drawn");
            let [r, g, b] = color.at(u, v).map(f64::from);
            // Steps of a quarter and a half level become one level.
            assert!(
                (r - (x - 1.5) / 4.0).abs() < 1.0 && (g - (y - 0.5) / 2.0).abs() < 1.0 && b == 7.0
            );
        }
    }

    /// r (1 − 0.3 r²) grows up to 1.054 and falls back to the centre at 1.83; the corners are at 2.
    #[test]
    fn rays_beyond_the_fold_have_no_reading() {
        let depth = DepthImage::new(640, 480, vec![900; 640 * 480]).expect("640×480");
        let mut got = frame(depth, Some(ColorImage::filled(640, 480, [9; 3])));
        Rectifier::new(&lens(200.0, &[-0.3, 0.0, 0.0, 0.0]))
            .rectify(&mut got)
            .expect("sizes");
        let color = got.color.expect("colour stays");
        for v in 0..480 {
            for u in 0..640 {
                let r = (f64::from(u) - 319.5).hypot(f64::from(v) - 239.5) / 200.0;
                let is_drawn = r < (1.0f64 / 0.9).sqrt();
                assert_eq!(got.depth.at(u, v), if is_drawn { 900 } else { 0 });
                assert_eq!(
                    color.at(u as u32, v as u32)[0],
                    if is_drawn { 9 } else { 0 }
                );
            }
        }
    }

    #[test]
    fn frames_of_a_pinhole_are_not_copied() {
        let mut rectifier = Rectifier::new(&lens(525.0, &[]));
        assert!(rectifier.is_identity());
        let mut frame = frame(DepthImage::empty(640, 480), None);
        let memory = frame.depth.data().as_ptr();
        rectifier.rectify(&mut frame).expect("sizes");
        assert_eq!(memory, frame.depth.data().as_ptr());
    }

    #[test]
    fn other_sizes_are_refused_and_broken_cameras_read_nothing() {
        let mut rectifier = Rectifier::new(&lens(525.0, &[0.1, 0.0, 0.0, 0.0]));
        let mut bad = frame(
            DepthImage::empty(640, 480),
            Some(ColorImage::filled(320, 240, [1; 3])),
        );
        let e = rectifier.rectify(&mut bad).expect_err("a quarter");
        assert_eq!(
            (e.what, e.got, e.expected),
            ("colour image", [320, 240], [640, 480])
        );
        assert_eq!(bad.color, Some(ColorImage::filled(320, 240, [1; 3])));

        let depth = DepthImage::new(640, 480, vec![900; 640 * 480]).expect("640×480");
        for focal in [0.0, f64::NAN, f64::INFINITY] {
            let mut frame = frame(depth.clone(), None);
            let mut rectifier = Rectifier::new(&lens(focal, &[0.1, 0.0, 0.0, 0.0]));
            rectifier.rectify(&mut frame).expect("sizes");
            assert!(frame.depth.data().iter().all(|d| *d == 0));
        }
    }
}
