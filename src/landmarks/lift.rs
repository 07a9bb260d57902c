//! Joints in metres: landmarks lifted by depth that is registered to the colour image.
//!
//! The network also guesses each landmark's depth relative to the hips. The readings of all visible landmarks place that
//! guess, by medians; a joint whose own readings lie before its place is hidden, behind it they are the background's, and either
//! has none.

use crate::landmark::LANDMARKS;
use crate::placed_guess::{PlacedGuess, is_seen};
use crate::reading_window::ReadingWindow;
use crate::{Landmark, LandmarkKind, LandmarkLiftSettings, PoseLandmarks};
use tryon_body::TrunkSides;
use tryon_geometry::camera::{Calibration, DepthImage, FrameSizeError, Intrinsics, Registration};
use tryon_geometry::math::{Camera, ColorCamera, P3d, Rigid};

/// Lifts landmarks of one camera's frames.
#[derive(Clone, Debug)]
pub struct LandmarkLifter {
    registration: Registration,
    color: Intrinsics,
    depth_from_color: Rigid<Camera, ColorCamera>,
    settings: LandmarkLiftSettings,
    /// Depth in the colour view.
    registered: DepthImage,
}

/// Joints of one person, camera frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LiftedPose {
    /// Point of the person's surface before each joint, metres, in the order of [`LandmarkKind`]; `None` where depth is
    /// missing, or something hides the joint.
    pub joints: [Option<P3d>; LANDMARKS],
    /// Shoulders and hips: where one of a pair has no depth, it is where the network guesses it from the other.
    pub trunk: TrunkSides,
    /// Size of the person over that of a grown-up, by depth and the landmarks' pixels; `None` without readings. Roughly: one
    /// man has 0.8 to 1.1.
    pub size: Option<f64>,
}

impl LiftedPose {
    /// One joint.
    pub fn at(&self, kind: LandmarkKind) -> Option<P3d> {
        self.joints[kind as usize]
    }
}

impl LandmarkLifter {
    /// Tabulates the cameras' rays; 0.1 s. Images are rectified ones.
    pub fn new(calibration: Calibration) -> Self {
        Self::with(calibration, LandmarkLiftSettings::default())
    }

    /// [`Self::new`] with settings.
    pub fn with(calibration: Calibration, settings: LandmarkLiftSettings) -> Self {
        Self {
            color: calibration.color.unwrap_or(calibration.depth),
            depth_from_color: calibration.color_from_depth.inverse(),
            registration: Registration::new(calibration),
            settings,
            registered: DepthImage::default(),
        }
    }

    /// Joints by the depth image \[mm\] of the same moment; 3 ms for 640 × 576 into 1280 × 720.
    ///
    /// # Errors
    /// A depth image, or landmarks of a colour image, that has not the size of its camera.
    pub fn lift(
        &mut self,
        depth: &DepthImage,
        pose: &PoseLandmarks,
    ) -> Result<LiftedPose, FrameSizeError> {
        let expected = [self.color.width, self.color.height];
        if pose.image != expected {
            return Err(FrameSizeError {
                what: "colour image of the landmarks",
                got: pose.image,
                expected,
            });
        }
        (self.registration).depth_in_color(depth, &mut self.registered)?;
        let placed = PlacedGuess::new(pose, &self.registered, &self.color, &self.settings);
        let size = placed.as_ref().map(|placed| placed.scale);
        let [least, most] = self.settings.sizes;
        let Some(placed) = placed.filter(|placed| (least..=most).contains(&placed.scale)) else {
            return Ok(LiftedPose {
                joints: [None; LANDMARKS],
                trunk: TrunkSides::default(),
                size,
            });
        };
        let joints = std::array::from_fn(|k| {
            let landmark = &pose.landmarks[k];
            let depth = self.depth_of(landmark, &placed)?;
            let point = unproject(&self.color, landmark.pixel, depth);
            Some(self.depth_from_color.point(&point))
        });
        let pair = |left, right| self.pair(pose, &joints, [left, right], placed.scale);
        let trunk = TrunkSides {
            shoulders: pair(LandmarkKind::LeftShoulder, LandmarkKind::RightShoulder),
            hips: pair(LandmarkKind::LeftHip, LandmarkKind::RightHip),
        };
        Ok(LiftedPose {
            joints,
            trunk,
            size,
        })
    }

    /// Depth of a landmark's surface along the colour camera's axis, metres.
    fn depth_of(&self, landmark: &Landmark, placed: &PlacedGuess) -> Option<f64> {
        if !is_seen(landmark, &self.settings) {
            return None;
        }
        let expected = placed.depth(landmark);
        let range = expected - self.settings.nearer..=expected + self.settings.farther;
        let window = ReadingWindow::around(&self.registered, landmark.pixel, placed.radius)?;
        window.median(&self.registered, range, self.settings.share)
    }

    /// Both joints of a pair, one of which may be where the network guesses it from the other.
    fn pair(
        &self,
        pose: &PoseLandmarks,
        joints: &[Option<P3d>; LANDMARKS],
        kinds: [LandmarkKind; 2],
        scale: f64,
    ) -> Option<[P3d; 2]> {
        let [left, right] = kinds.map(|kind| pose.at(kind).guess.cast::<f64>());
        let across = self.depth_from_color.vector(&((left - right) * scale));
        match kinds.map(|kind| joints[kind as usize]) {
            [Some(left), Some(right)] => Some([left, right]),
            [Some(left), None] => Some([left, left - across]),
            [None, Some(right)] => Some([right + across, right]),
            [None, None] => None,
        }
    }
}

/// Point of the colour camera's frame at a depth, metres.
fn unproject(color: &Intrinsics, [u, v]: [f32; 2], depth: f64) -> P3d {
    P3d::new(
        (f64::from(u) - color.cx) / color.fx * depth,
        (f64::from(v) - color.cy) / color.fy * depth,
        depth,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PersonRegion;
    use nalgebra::{UnitQuaternion, Vector3};
    use std::f64::consts::FRAC_PI_2;
    use tryon_geometry::math::{V3, V3d};

    const CAMERA: Intrinsics = Intrinsics {
        width: 320,
        height: 240,
        fx: 250.0,
        fy: 250.0,
        cx: 159.5,
        cy: 119.5,
    };

    /// A flat person at 2 m of whom the network knows the pixels, in a room of 4 m; scale: the person over the guess.
    fn scene(yaw: f32, scale: f32) -> (PoseLandmarks, DepthImage) {
        let mut depth = DepthImage::empty(CAMERA.width, CAMERA.height);
        depth.data_mut().fill(4000);
        let (s, c) = yaw.sin_cos();
        let landmarks = std::array::from_fn(|k| {
            // The left is at positive x of a person who faces the camera.
            let side = if k % 2 == 1 { 0.2 } else { -0.2 };
            let guess = Vector3::new(side * c, 0.05 * k as f32 - 0.8, side * s);
            let place = V3::new(0.0, 0.0, 2.0) + scale * guess;
            let pixel = [place.x, place.y].map(|m| m / 2.0 * CAMERA.fx as f32);
            let pixel = [pixel[0] + CAMERA.cx as f32, pixel[1] + CAMERA.cy as f32];
            for v in -5..=5 {
                for u in -5..=5 {
                    let (u, v) = (pixel[0] as i32 + u, pixel[1] as i32 + v);
                    if (0..320).contains(&u) && (0..240).contains(&v) {
                        depth.data_mut()[(v * 320 + u) as usize] = (place.z * 1000.0) as u16;
                    }
                }
            }
            Landmark {
                pixel,
                visibility: 0.9,
                presence: 0.9,
                guess,
            }
        });
        let pose = PoseLandmarks {
            landmarks,
            presence: 1.0,
            image: [320, 240],
            region: PersonRegion::whole([320, 240], 0),
            next_region: None,
        };
        (pose, depth)
    }
    fn lift(pose: &PoseLandmarks, depth: &DepthImage) -> LiftedPose {
        let mut lifter = LandmarkLifter::new(Calibration::registered(CAMERA));
        lifter.lift(depth, pose).expect("sizes of the camera")
    }
    fn yaw(lifted: &LiftedPose) -> f64 {
        (lifted.trunk.yaw(&V3::new(0.0, -1.0, 0.0))).expect("a trunk")
    }

    #[test]
    fn joints_lie_where_depth_shows_them() {
        for (turn, scale) in [(0.0, 1.0), (0.7, 1.0), (-0.5, 0.6)] {
            let (pose, depth) = scene(turn, scale);
            let lifted = lift(&pose, &depth);
            let left = lifted.at(LandmarkKind::LeftShoulder).expect("seen");
            let depth = 2.0 + f64::from(scale * 0.2 * turn.sin());
            assert!((left.z - depth).abs() < 2e-3, "{left}");
            let size = lifted.size.expect("readings");
            assert!((size - f64::from(scale)).abs() < 0.1, "{size}");
            assert!(
                (yaw(&lifted) - f64::from(turn)).abs() < 0.05,
                "{turn}: {}",
                yaw(&lifted)
            );
        }
    }

    #[test]
    fn hidden_and_unread_joints_are_none_and_the_guess_completes_their_pair() {
        let (pose, mut depth) = scene(1.2, 1.0);
        let [u, v] = pose.at(LandmarkKind::LeftShoulder).pixel.map(|c| c as i32);
        let mut paint = |reading: u16| {
            for (k, pixel) in depth.data_mut().iter_mut().enumerate() {
                let (x, y) = (k as i32 % 320, k as i32 / 320);
                if (x - u).abs() <= 3 && (y - v).abs() <= 3 {
                    *pixel = reading;
                }
            }
            lift(&pose, &depth)
        };
        // No reading, the background beside the person, a hand before it.
        for reading in [0, 4000, 1700] {
            let lifted = paint(reading);
            assert_eq!(lifted.at(LandmarkKind::LeftShoulder), None, "{reading}");
            assert!(lifted.at(LandmarkKind::RightShoulder).is_some());
            assert!((yaw(&lifted) - 1.2).abs() < 0.1, "{}", yaw(&lifted));
        }
    }

    /// A flat scene at 2 m, seen by a colour camera 10 cm to the right that is rolled by a quarter turn.
    #[test]
    fn joints_are_in_the_depth_cameras_frame() {
        let (pose, mut depth) = scene(0.0, 1.0);
        depth.data_mut().fill(2000);
        let roll = UnitQuaternion::from_axis_angle(&V3d::z_axis(), FRAC_PI_2);
        let calibration = Calibration {
            depth: Intrinsics {
                fx: 150.0,
                ..CAMERA
            },
            color: Some(CAMERA),
            color_from_depth: Rigid::from_parts(roll * V3d::new(-0.1, 0.0, 0.0), roll),
        };
        let mut lifter = LandmarkLifter::new(calibration);
        let lifted = lifter.lift(&depth, &pose).expect("sizes");
        let shoulder = lifted.at(LandmarkKind::RightShoulder).expect("seen");
        // 0.2 m to the left and 0.2 m up in the colour camera: in the depth camera to the left and below.
        let want = P3d::new(0.1 - 0.2, 0.2, 2.0);
        assert!((shoulder - want).norm() < 0.01, "{shoulder}");
    }

    #[test]
    fn nothing_is_lifted_without_readings_and_foreign_sizes_are_refused() {
        let (mut pose, depth) = scene(0.0, 1.0);
        let empty = lift(&pose, &DepthImage::empty(320, 240));
        assert_eq!(
            (empty.joints, empty.trunk),
            ([None; LANDMARKS], TrunkSides::default())
        );
        assert_eq!(empty.size, None);
        // A person of 30 cm.
        let (doll, depth_of_doll) = scene(0.0, 0.2);
        let doll = lift(&doll, &depth_of_doll);
        assert!(doll.size.is_some_and(|size| size < 0.3) && doll.joints == [None; LANDMARKS]);
        for landmark in &mut pose.landmarks {
            landmark.visibility = 0.1;
        }
        assert_eq!(lift(&pose, &depth).trunk, TrunkSides::default());
        pose.landmarks = [Landmark::default(); LANDMARKS];
        assert_eq!(lift(&pose, &depth).joints, [None; LANDMARKS]);
        pose.image = [640, 480];
        let mut lifter = LandmarkLifter::new(Calibration::registered(CAMERA));
        assert!(lifter.lift(&depth, &pose).is_err());
    }
}
