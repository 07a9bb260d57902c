//! Recording whose frames are rectified as they are read.

use super::converted::{Converted, FrameConverter};
use super::rgbd_source::RgbdSource;
use std::path::Path;
use tryon_geometry::camera::{Calibration, FrameSizeError, Rectifier, RgbdFrame};

/// Source of rectified frames from one whose frames have lens distortion.
pub type Rectified = Converted<Rectifier>;

impl Rectified {
    /// Wraps `source` if its lenses distort; `path` is named in errors.
    pub fn wrap(path: &Path, source: Box<dyn RgbdSource>) -> Box<dyn RgbdSource> {
        let rectifier = Rectifier::new(&source.lenses());
        if rectifier.is_identity() {
            return source;
        }
        Box::new(Self::new(path, source, rectifier))
    }
}

impl FrameConverter for Rectifier {
    fn calibration(&self) -> &Calibration {
        self.calibration()
    }
    fn convert(&mut self, frame: &mut RgbdFrame) -> Result<(), FrameSizeError> {
        self.rectify(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FormatError;
    use tryon_geometry::camera::{DepthImage, Distortion, Intrinsics, Lens, LensCalibration};

    /// Two frames of a lens; the second one has another size.
    struct TwoFrames {
        calibration: Calibration,
        distortion: Distortion,
        next: u64,
    }

    impl TwoFrames {
        fn new(k1: f64) -> Box<Self> {
            let intrinsics = Intrinsics::KINECT_V1.resized(64, 48);
            Box::new(Self {
                calibration: Calibration::registered(intrinsics),
                distortion: Distortion::from_opencv(&[k1, 0.0, 0.0, 0.0]).expect("finite"),
                next: 0,
            })
        }
    }

    impl RgbdSource for TwoFrames {
        fn calibration(&self) -> &Calibration {
            &self.calibration
        }
        fn lenses(&self) -> LensCalibration {
            let depth = Lens {
                intrinsics: self.calibration.depth,
                distortion: self.distortion,
            };
            LensCalibration {
                depth,
                ..self.calibration.clone().into()
            }
        }
        fn len(&self) -> Option<usize> {
            Some(2)
        }
        fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
            self.next += 1;
            let width = if self.next == 2 { 63 } else { 64 };
            let depth = DepthImage::new(width, 48, vec![1500; width as usize * 48]);
            Ok((self.next < 3).then(|| RgbdFrame {
                sequence: self.next,
                time_ns: 0,
                depth: depth.expect("48 rows"),
                color: None,
            }))
        }
        fn rewind(&mut self) -> Result<(), FormatError> {
            self.next = 0;
            Ok(())
        }
    }

    #[test]
    fn frames_are_rectified_and_bad_sizes_are_named() {
        let mut source = Rectified::wrap(Path::new("a.mcap"), TwoFrames::new(0.3));
        assert_eq!(source.len(), Some(2));
        assert!(source.lenses().depth.distortion.is_none());
        for _ in 0..2 {
            let frame = source.next_frame().expect("right size").expect("first");
            // The corner's ray is drawn outside the image, the centre's is not moved.
            assert_eq!((frame.depth.at(0, 0), frame.depth.at(32, 24)), (0, 1500));
            let e = source.next_frame().expect_err("63 columns").to_string();
            assert!(e.contains("a.mcap") && e.contains("63×48"), "{e}");
            assert!(source.next_frame().expect("the end").is_none());
            source.rewind().expect("in memory");
        }
    }

    #[test]
    fn frames_without_distortion_stay_as_they_are() {
        let mut source = Rectified::wrap(Path::new("a.mcap"), TwoFrames::new(0.0));
        let frame = source.next_frame().expect("not checked").expect("first");
        assert!(frame.depth.data().iter().all(|d| *d == 1500));
        // Not wrapped: the source itself answers.
        assert!(source.next_frame().is_ok_and(|f| f.is_some()));
    }
}
