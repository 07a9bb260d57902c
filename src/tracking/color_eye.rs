//! The eye for colour: landmarks of the person in a colour image, lifted by depth, as a sighting for the tracker.

use crate::part_classes::PartKind;
use crate::segment::part_network::JointProposal;
use crate::sighting::ColorSighting;
use tryon_body::parts::BodySide;
use tryon_geometry::camera::{Calibration, FrameSizeError, RgbdFrame};
use tryon_geometry::math::P3d;
use tryon_landmarks::LandmarkKind::{self, *};
use tryon_landmarks::{LandmarkError, LandmarkLifter, Landmarker, LiftedPose, PoseLandmarks};

/// Frames from one look to the next: four at 30 Hz are a seventh of a second, in which a trunk turns by 20° at most.
pub const COLOR_INTERVAL: u64 = 4;

/// Fault of a look.
#[derive(Debug, thiserror::Error)]
pub enum ColorEyeError {
    /// The networks could not be run.
    #[error(transparent)]
    Landmarks(#[from] LandmarkError),
    /// An image has not the size of its camera.
    #[error(transparent)]
    FrameSize(#[from] FrameSizeError),
}

/// Sees one person in the colour images of one camera; 16 ms for one who is followed.
#[derive(Clone)]
pub struct ColorEye {
    landmarker: Landmarker,
    lifter: LandmarkLifter,
}

/// A paired class with the landmarks whose middle it is, left and right, and the depth of the joint below the skin, metres.
type SeenKind = (PartKind, [&'static [LandmarkKind]; 2], f64);

/// Depths are half those of a grown-up's limbs.
const KINDS: [SeenKind; 6] = [
    (
        PartKind::Shoulder,
        [&[LeftShoulder], &[RightShoulder]],
        0.06,
    ),
    (PartKind::Elbow, [&[LeftElbow], &[RightElbow]], 0.04),
    (
        PartKind::Hand,
        [&[LeftWrist, LeftIndex], &[RightWrist, RightIndex]],
        0.02,
    ),
    (PartKind::Hip, [&[LeftHip], &[RightHip]], 0.1),
    (PartKind::Knee, [&[LeftKnee], &[RightKnee]], 0.05),
    (PartKind::Foot, [&[LeftAnkle], &[RightAnkle]], 0.04),
];

impl ColorEye {
    /// An eye beside this camera with networks that were loaded; tables of its rays take 0.1 s.
    pub fn new(landmarker: Landmarker, calibration: Calibration) -> Self {
        Self {
            landmarker,
            lifter: LandmarkLifter::new(calibration),
        }
    }

    /// The person in a frame; `None` without colour or without anybody.
    ///
    /// # Errors
    /// [`ColorEyeError`].
    pub fn look(&mut self, frame: &RgbdFrame) -> Result<Option<ColorSighting>, ColorEyeError> {
        let Some(color) = &frame.color else {
            return Ok(None);
        };
        let Some(pose) = self.landmarker.find(color)? else {
            return Ok(None);
        };
        let lifted = self.lifter.lift(&frame.depth, &pose)?;
        Ok(Some(ColorSighting {
            time_ns: frame.time_ns,
            trunk: lifted.trunk,
            joints: joints(&pose, &lifted),
        }))
    }
}

/// Proposals of the joints that are seen.
fn joints(pose: &PoseLandmarks, lifted: &LiftedPose) -> Vec<JointProposal> {
    let sides = [BodySide::Left, BodySide::Right];
    let of_kind = |(kind, landmarks, depth): SeenKind| {
        sides
            .into_iter()
            .zip(landmarks)
            .filter_map(move |(side, own)| {
                let seen: Vec<P3d> = own.iter().filter_map(|k| lifted.at(*k)).collect();
                let sum: nalgebra::Vector3<f64> = seen.iter().map(|p| p.coords).sum();
                let skin = sum / seen.len().max(1) as f64;
                let behind = skin.try_normalize(f64::EPSILON)? * depth;
                let visible = own.iter().map(|k| pose.at(*k).visibility);
                Some(JointProposal {
                    class: kind.class(side),
                    position: P3d::from(skin + behind).cast(),
                    weight: visible.fold(1.0, f32::min),
                })
            })
    };
    KINDS.into_iter().flat_map(of_kind).collect()
}
