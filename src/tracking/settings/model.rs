//! Settings of the model: limbs and trunk of the template.

use super::settings;

settings! {
    /// Settings of the model.
    pub struct ModelSettings {
        /// Share of the way from wrist to fingertip that stands for a hand: readings of one half in its sleeve are the
        /// fingers.
        pub hand: f64 = 0.7,
        /// Share of the way from ankle to toes that stands for a foot that hangs or points at the camera.
        pub foot: f64 = 0.5,
        /// Depth by which a point of a limb lies before a reading from which on it is in the air, metres.
        pub air: f64 = 0.10,
        /// Share of the trunk's section that counts as inside: hands press into clothes and soft bodies.
        pub trunk_slack: f64 = 0.65,
        /// Weight of eq. 23 between left and right bones, and between successive bones of a limb.
        pub tie_weights: [f64; 2] = [1.0, 0.5],
    }

    /// Settings of the camera before a still person.
    pub struct StillCameraSettings {
        /// Focal length, pixels.
        pub focal: f32 = 525.0,
        /// Share of the rows that the person fills.
        pub fill: f32 = 0.72,
        /// Nearest surface drawn, metres.
        pub near: f32 = 0.1,
    }
}
