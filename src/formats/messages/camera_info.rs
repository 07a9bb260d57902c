//! Camera of an image topic, as `sensor_msgs/CameraInfo` and `foxglove.CameraCalibration` state it.

use super::fault::MessageFault;
use tryon_geometry::camera::{Distortion, Intrinsics, Lens};

/// A stated camera. Matrices are row-major.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraInfo {
    pub(super) frame_id: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) distortion_model: String,
    /// Coefficients of the model.
    pub(super) d: Vec<f64>,
    /// Pinhole of raw images, 3×3.
    pub(super) k: Vec<f64>,
    /// Rotation of rectified images, 3×3.
    pub(super) r: Vec<f64>,
    /// Projection of rectified images, 3×4.
    pub(super) p: Vec<f64>,
}

/// Largest entry of `R` less the identity that is no rotation.
const SAME_ROTATION: f64 = 1e-6;

impl CameraInfo {
    /// Lens of the images of `topic`, and what is left out: rectified images (`image_rect…`) have the pinhole `P` and
    /// no distortion, all others `K` and `D`.
    ///
    /// # Errors
    /// `K`, `D` or a model that cannot be used.
    pub(super) fn lens(&self, topic: &str) -> Result<(Lens, Vec<String>), MessageFault> {
        if !self.is_rectified(topic) {
            let lens = Lens {
                intrinsics: self.intrinsics("K", [0, 2, 4, 5])?,
                distortion: self.distortion()?,
            };
            return Ok((lens, Vec::new()));
        }
        let lens = Lens::from(self.intrinsics("P", [0, 2, 5, 6])?);
        let mut notes = Vec::new();
        if self.d.iter().any(|c| *c != 0.0) {
            let why = "its name says rectified: P is its camera, D belongs to the raw image";
            notes.push(format!("{topic}: D is not applied; {why}"));
        }
        if self.rotates() {
            let why = "transforms name the frame of the raw image";
            notes.push(format!("{topic}: R of its camera is not applied; {why}"));
        }
        Ok((lens, notes))
    }

    /// True for topics of rectified images whose camera states `P`.
    fn is_rectified(&self, topic: &str) -> bool {
        let mut segments = topic.split('/');
        segments.any(|s| s.starts_with("image_rect")) && self.p.first().is_some_and(|f| *f != 0.0)
    }

    fn rotates(&self) -> bool {
        let identity = |i: usize| if i.is_multiple_of(4) { 1.0 } else { 0.0 };
        let is_set = self.r.iter().any(|v| *v != 0.0);
        let mut entries = self.r.iter().enumerate();
        is_set && entries.any(|(i, v)| (v - identity(i)).abs() > SAME_ROTATION)
    }

    /// Pinhole from the entries fx, cx, fy, cy of `matrix`.
    fn intrinsics(&self, matrix: &str, at: [usize; 4]) -> Result<Intrinsics, MessageFault> {
        let (values, expected) = match matrix {
            "P" => (&self.p, 12),
            _ => (&self.k, 9),
        };
        if values.len() != expected {
            let why = format!("{} values, expected {expected}", values.len());
            return Err(MessageFault::new(matrix, why));
        }
        let [fx, cx, fy, cy] = at.map(|i| values[i]);
        let k = Intrinsics {
            width: self.width,
            height: self.height,
            fx,
            fy,
            cx,
            cy,
        };
        k.validated().map_err(|e| {
            let field = match e.field {
                side @ ("width" | "height") => side.to_owned(),
                entry => format!("{matrix}.{entry}"),
            };
            MessageFault::new(field, format!("{}, expected {}", e.value, e.why))
        })
    }

    fn distortion(&self) -> Result<Distortion, MessageFault> {
        if self.d.iter().all(|c| *c == 0.0) {
            return Ok(Distortion::default());
        }
        // The last is the RealSense SDK's name of the first.
        let models = ["plumb_bob", "rational_polynomial", "Brown Conrady"];
        if !self.distortion_model.is_empty() && !models.contains(&self.distortion_model.as_str()) {
            let why = format!(
                "`{}` with coefficients {:?}, expected plumb_bob or rational_polynomial",
                self.distortion_model, self.d
            );
            return Err(MessageFault::new("distortion_model", why));
        }
        Distortion::from_opencv(&self.d).map_err(|e| MessageFault::new("D", e.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> CameraInfo {
        CameraInfo {
            frame_id: "c".into(),
            width: 64,
            height: 48,
            distortion_model: "plumb_bob".into(),
            d: vec![-0.25, 0.06, 0.001, -0.002, 0.01],
            k: vec![52.0, 0.0, 31.5, 0.0, 53.0, 23.5, 0.0, 0.0, 1.0],
            r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: vec![
                50.0, 0.0, 31.0, 0.0, 0.0, 51.0, 23.0, 0.0, 0.0, 0.0, 1.0, 0.0,
            ],
        }
    }

    #[test]
    fn raw_images_have_k_and_d_rectified_ones_p() {
        let (raw, notes) = camera().lens("/cam/image_raw").expect("a lens");
        assert_eq!(raw.intrinsics.fx, 52.0);
        assert_eq!(raw.distortion.radial[..3], [-0.25, 0.06, 0.01]);
        assert_eq!(raw.distortion.tangential, [0.001, -0.002]);
        assert!(notes.is_empty());
        let (rectified, notes) = camera().lens("/cam/image_rect_color").expect("a lens");
        let k = rectified.intrinsics;
        assert_eq!([k.fx, k.fy, k.cx, k.cy], [50.0, 51.0, 31.0, 23.0]);
        assert!(rectified.distortion.is_none());
        assert!(notes.len() == 1 && notes[0].contains("D is not applied"));
    }

    #[test]
    fn other_models_are_refused_by_name_unless_their_coefficients_are_zero() {
        let mut fisheye = camera();
        fisheye.distortion_model = "equidistant".into();
        let e = fisheye.lens("/c").expect_err("refused");
        assert_eq!(e.field, "distortion_model");
        assert!(e.why.contains("`equidistant`"));
        fisheye.d = vec![0.0; 4];
        assert!(
            fisheye
                .lens("/c")
                .is_ok_and(|(l, _)| l.distortion.is_none())
        );
        let mut bad = camera();
        bad.d = vec![0.1; 3];
        assert_eq!(bad.lens("/c").expect_err("a count").field, "D");
        bad.k[0] = 0.0;
        assert_eq!(bad.lens("/c").expect_err("not calibrated").field, "K.fx");
        bad.k.pop();
        assert_eq!(bad.lens("/c").expect_err("cut").field, "K");
    }
}
