//! Poses in which folds are judged.

use clap::ValueEnum;
use nalgebra::Vector3;
use tryon_body::{Pose, RestBody, Template};
use tryon_geometry::math::{Body, Rigid, World};

/// Pose of the embedded body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FoldPose {
    /// Arms off the trunk, 45° down.
    Rest,
    /// Both arms 50° above the horizontal.
    Raised,
    /// Left arm forward, right arm hanging.
    Forward,
    /// Left leg before the right one, knees bent, arms hanging.
    Step,
    /// Thighs and shanks as on a chair.
    Seated,
    /// Trunk turned to the left by 45°.
    Twisted,
}

impl FoldPose {
    /// All poses, in the order of tables.
    pub const ALL: [Self; 6] = [
        Self::Rest,
        Self::Raised,
        Self::Forward,
        Self::Step,
        Self::Seated,
        Self::Twisted,
    ];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Raised => "raised",
            Self::Forward => "forward",
            Self::Step => "step",
            Self::Seated => "seated",
            Self::Twisted => "twisted",
        }
    }

    /// Pose of a body in the world, y up, facing z.
    pub fn of(self, template: &Template, rest: &RestBody) -> Pose<World> {
        /// Angle of hanging arms below the horizontal (rad).
        const HANGING: f64 = 1.2;
        let skeleton = template.skeleton();
        let mut pose = Pose::rest(skeleton, Rigid::<World, Body>::identity());
        match self {
            Self::Rest => {}
            Self::Raised => pose.lower_arms(skeleton, rest, -0.87),
            Self::Forward => {
                pose.lower_arms(skeleton, rest, HANGING);
                pose.turn_arm(skeleton, rest, "left", &Vector3::new(0.15, 0.0, 1.0));
            }
            Self::Step => {
                pose.lower_arms(skeleton, rest, HANGING);
                pose.set(skeleton, "left_hip", &[-0.6, 0.0, 0.0]);
                pose.set(skeleton, "left_knee", &[0.35]);
                pose.set(skeleton, "right_hip", &[0.3, 0.0, 0.0]);
                pose.set(skeleton, "right_knee", &[0.3]);
            }
            Self::Seated => {
                for side in ["left", "right"] {
                    pose.set(skeleton, &format!("{side}_hip"), &[-1.4, 0.0, 0.0]);
                    pose.set(skeleton, &format!("{side}_knee"), &[1.4]);
                }
            }
            Self::Twisted => {
                for joint in ["spine1", "spine2", "spine3"] {
                    pose.set(skeleton, joint, &[0.0, 0.26, 0.0]);
                }
            }
        }
        pose
    }
}
