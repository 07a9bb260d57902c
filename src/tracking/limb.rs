//! Arms and legs as chains of a ball, a hinge and an end, put where a hand or a foot was seen (law of cosines).

use super::model::TrackerModel;
use crate::body::parts::{BodyPart, LimbJoints};
use crate::body::{BoneTransforms, JointMotion, Pose, RestBody, Template};
use crate::math::{P3d, exp_so3, log_so3};
use nalgebra::{UnitQuaternion, Vector3};

/// One arm or leg of the template.
#[derive(Clone, Debug)]
pub(super) struct Limb {
    /// Shoulder or hip, a ball.
    pub root: usize,
    /// Elbow or knee, a hinge.
    pub hinge: usize,
    /// Wrist or ankle.
    pub end: usize,
    /// End of the hand or the foot.
    pub tip: usize,
    /// Angles of root and hinge.
    pub angles: Vec<usize>,
    /// The hinge's only angle.
    bend: usize,
    /// What is seen of hand or foot is taken for the point at this share of the way from end to tip.
    middle: f64,
}

/// Of a hand out of its sleeve the middle shows, of one half in it the fingers.
const HAND: f64 = 0.7;
/// The end of a foot that hangs or stands towards the camera.
const FOOT: f64 = 0.5;

/// The arms of a template, left and right; `None` for one without.
pub(super) fn arms(template: &Template) -> [Option<Limb>; 2] {
    [BodyPart::LeftArm, BodyPart::RightArm].map(|arm| limb(template, arm, HAND))
}

/// The legs of a template, left and right; `None` for one without.
pub(super) fn legs(template: &Template) -> [Option<Limb>; 2] {
    [BodyPart::LeftLeg, BodyPart::RightLeg].map(|leg| limb(template, leg, FOOT))
}

fn limb(template: &Template, part: BodyPart, middle: f64) -> Option<Limb> {
    let skeleton = template.skeleton();
    let LimbJoints {
        root,
        hinge,
        end,
        tip,
    } = template.parts().limb(part)?;
    let hinged = matches!(skeleton.joints()[hinge].motion, JointMotion::Hinge { .. });
    let ball = matches!(skeleton.joints()[root].motion, JointMotion::Ball { .. });
    let (s, bend) = (skeleton.dof_offset(root), skeleton.dof_offset(hinge));
    (hinged && ball).then(|| Limb {
        root,
        hinge,
        end,
        tip,
        angles: vec![s, s + 1, s + 2, bend],
        bend,
        middle,
    })
}

impl Limb {
    /// Where what is seen of hand or foot is.
    pub(super) fn hand(&self, bones: &BoneTransforms) -> P3d {
        bones.joints[self.end] + (bones.joints[self.tip] - bones.joints[self.end]) * self.middle
    }
    /// From root to tip when stretched, metres.
    pub(super) fn length(&self, rest: &RestBody) -> f64 {
        (rest.joints[self.hinge] - rest.joints[self.root]).norm()
            + (rest.joints[self.tip] - rest.joints[self.hinge]).norm()
    }
    /// Points the limb at `target` with the hinge bent as far as the distance asks, from the rest pose on; where
    /// `hinge` is given, the hinge then turns towards it about the line from root to target.
    pub(super) fn reach(
        &self,
        model: &TrackerModel,
        rest: &RestBody,
        pose: &mut Pose,
        target: &P3d,
        hinge: Option<&P3d>,
    ) {
        let skeleton = model.template.skeleton();
        let mut bones = BoneTransforms::default();
        pose.angles[self.angles[0]..self.angles[0] + 3].fill(0.0);
        pose.bones(skeleton, rest, &mut bones);
        let root = bones.joints[self.root];
        let upper = (bones.joints[self.hinge] - root).norm();
        let lower = (self.hand(&bones) - bones.joints[self.hinge]).norm();
        let far = (target - root).norm();
        let cos = (upper * upper + lower * lower - far * far)
            / (2.0 * upper * lower).max(f64::MIN_POSITIVE);
        pose.angles[self.bend] = std::f64::consts::PI - cos.clamp(-1.0, 1.0).acos();
        pose.clamp_to_limits(skeleton);
        pose.bones(skeleton, rest, &mut bones);
        let (now, wanted) = (self.hand(&bones) - root, target - root);
        let Some(mut turn) = UnitQuaternion::rotation_between(&now, &wanted) else {
            return;
        };
        if let (Some(hinge), Some(line)) = (hinge, wanted.try_normalize(f64::EPSILON)) {
            let across = |v: Vector3<f64>| v - line * line.dot(&v);
            let (is, should) = (
                across(turn * (bones.joints[self.hinge] - root)),
                across(hinge - root),
            );
            let angle = line.dot(&is.cross(&should)).atan2(is.dot(&should));
            turn = UnitQuaternion::from_scaled_axis(line * angle) * turn;
        }
        let parent =
            model.parents[self.root].map_or(pose.root.iso().rotation, |p| bones.bones[p].rotation);
        let at = self.angles[0];
        let old = exp_so3(&Vector3::new(
            pose.angles[at],
            pose.angles[at + 1],
            pose.angles[at + 2],
        ));
        let new = log_so3(&(parent.inverse() * turn * parent * old));
        pose.angles[at..at + 3].copy_from_slice(new.as_slice());
        pose.clamp_to_limits(skeleton);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Calibration, Intrinsics};
    use crate::tracking::{TrackerConfig, TrackerState};

    #[test]
    fn a_limb_reaches_its_target_with_its_hinge_on_the_side_asked_for() {
        let config = TrackerConfig {
            samples: 50,
            ..TrackerConfig::default()
        };
        let calibration = Calibration::registered(Intrinsics::KINECT_V1);
        let model = TrackerModel::new(crate::body::embedded::template(), calibration, config);
        let rest = model.template.personalise(&Default::default());
        let pose = TrackerState::new(&model).pose;
        let mut bones = BoneTransforms::default();
        pose.bones(model.template.skeleton(), &rest, &mut bones);
        let limbs = model.arms.iter().chain(&model.legs).flatten();
        for limb in limbs {
            let root = bones.joints[limb.root];
            let outward = (root - bones.joints[0]).x.signum();
            let is_arm = root.y < bones.joints[0].y;
            let offset = if is_arm {
                Vector3::new(outward * 0.35, 0.2, -0.2)
            } else {
                Vector3::new(0.0, 0.6, -0.3)
            };
            let target = root + offset;
            let asked = root
                + offset * 0.5
                + if is_arm {
                    Vector3::new(0.0, 0.2, 0.1)
                } else {
                    Vector3::new(0.0, 0.0, -0.3)
                };
            let mut found = pose.clone();
            limb.reach(&model, &rest, &mut found, &target, Some(&asked));
            let mut now = BoneTransforms::default();
            found.bones(model.template.skeleton(), &rest, &mut now);
            let off = (limb.hand(&now) - target).norm();
            assert!(off < 0.06, "{}: {off} m", limb.root);
            let line = offset.normalize();
            let across = |p: P3d| {
                let v = p - root;
                v - line * line.dot(&v)
            };
            let (is, should) = (across(now.joints[limb.hinge]), across(asked));
            assert!(
                is.norm() > 0.02 && is.angle(&should) < 0.35,
                "{}: {} rad",
                limb.root,
                is.angle(&should)
            );
            // Out of reach: stretched towards it, nothing breaks.
            let far = root + offset * 5.0;
            limb.reach(&model, &rest, &mut found, &far, None);
            assert!(found.is_finite());
            limb.reach(&model, &rest, &mut found, &root, Some(&root));
            assert!(found.is_finite(), "a target in the joint itself");
        }
    }
}
