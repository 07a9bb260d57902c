//! Landmarks of a person, by name.

use crate::PersonRegion;
use nalgebra::Vector3;

/// Number of landmarks.
pub(crate) const LANDMARKS: usize = 33;

/// Names of the landmarks in MediaPipe's order; left and right are the person's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
#[expect(missing_docs, reason = "the names are the body's")]
pub enum LandmarkKind {
    Nose,
    LeftEyeInner,
    LeftEye,
    LeftEyeOuter,
    RightEyeInner,
    RightEye,
    RightEyeOuter,
    LeftEar,
    RightEar,
    MouthLeft,
    MouthRight,
    LeftShoulder,
    RightShoulder,
    LeftElbow,
    RightElbow,
    LeftWrist,
    RightWrist,
    LeftPinky,
    RightPinky,
    LeftIndex,
    RightIndex,
    LeftThumb,
    RightThumb,
    LeftHip,
    RightHip,
    LeftKnee,
    RightKnee,
    LeftAnkle,
    RightAnkle,
    LeftHeel,
    RightHeel,
    LeftFootIndex,
    RightFootIndex,
}

/// One landmark.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Landmark {
    /// Column and row in the colour image, pixels, centres at integers; may lie beyond the picture.
    pub pixel: [f32; 2],
    /// Probability that nothing hides it, 0 to 1.
    pub visibility: f32,
    /// Probability that it is in the picture, 0 to 1.
    pub presence: f32,
    /// Place from the middle between the hips as the network guesses it from colour for a grown-up, metres, in the axes of
    /// the colour camera: x right, y down, z away.
    pub guess: Vector3<f32>,
}

/// Landmarks of one person in a colour image.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseLandmarks {
    /// All landmarks, in the order of [`LandmarkKind`].
    pub landmarks: [Landmark; LANDMARKS],
    /// Probability that the region shows a person, 0 to 1.
    pub presence: f32,
    /// Columns and rows of the image.
    pub image: [u32; 2],
    /// Region in which the person was found.
    pub region: PersonRegion,
    /// Region of the person as found, in which the next frame's search begins; `None` where it has no extent.
    pub next_region: Option<PersonRegion>,
}

impl PoseLandmarks {
    /// One landmark.
    pub fn at(&self, kind: LandmarkKind) -> &Landmark {
        &self.landmarks[kind as usize]
    }
}
