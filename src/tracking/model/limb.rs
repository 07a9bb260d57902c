//! Arms and legs as chains of a ball, a hinge and an end; two-bone inverse kinematics by the law of cosines.

use crate::settings::ModelSettings;
use nalgebra::{UnitQuaternion, Vector3};
use tryon_body::parts::{BodyPart, EllipticColumn, LimbJoints};
use tryon_body::{BoneTransforms, JointMotion, Pose, RestBody, Skeleton, Template};
use tryon_geometry::math::{P3d, exp_so3, log_so3};
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// One arm or leg of the template.
#[derive(Clone, Debug)]
pub(crate) struct Limb {
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
    /// Point that stands for hand or foot, as a share of the way from end to tip.
    middle: f64,
    /// Depth by which a point lies before a reading when it is in the air, metres.
    air: f64,
}

/// Points of a bone that are tested for free space.
const AIR_SAMPLES: usize = 5;

/// The arms of a template, left and right; `None` for one without.
pub(crate) fn arms(template: &Template, settings: &ModelSettings) -> [Option<Limb>; 2] {
    [BodyPart::LeftArm, BodyPart::RightArm]
        .map(|arm| limb(template, arm, settings.hand, settings.air))
}

/// The legs of a template, left and right; `None` for one without.
pub(crate) fn legs(template: &Template, settings: &ModelSettings) -> [Option<Limb>; 2] {
    [BodyPart::LeftLeg, BodyPart::RightLeg]
        .map(|leg| limb(template, leg, settings.foot, settings.air))
}

fn limb(template: &Template, part: BodyPart, middle: f64, air: f64) -> Option<Limb> {
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
        air,
    })
}

impl Limb {
    /// Point of hand or foot that a reading of it stands for, camera frame, metres.
    pub(crate) fn hand(&self, bones: &BoneTransforms) -> P3d {
        bones.joints[self.end] + (bones.joints[self.tip] - bones.joints[self.end]) * self.middle
    }
    /// At least this share of the hinge's angle is held by no reading; `unseen` has the share of each angle.
    pub(crate) fn is_hinge_unseen(&self, unseen: &[f64], least: f64) -> bool {
        unseen.get(self.bend).is_some_and(|share| *share >= least)
    }
    /// Hinge, middle of the lower bone, end, and point of hand or foot, camera frame, metres.
    pub(crate) fn lower_points(&self, bones: &BoneTransforms) -> [P3d; 4] {
        let [hinge, end] = [self.hinge, self.end].map(|j| bones.joints[j]);
        [hinge, nalgebra::center(&hinge, &end), end, self.hand(bones)]
    }
    /// Points of its bones, out of [`AIR_SAMPLES`] each, where it cannot be: inside the trunk, or before another
    /// measured surface.
    pub(crate) fn misplaced_points(
        &self,
        bones: &BoneTransforms,
        grid: &OrganisedCloud,
        trunk: Option<&EllipticColumn>,
    ) -> usize {
        let [root, hinge] = [self.root, self.hinge].map(|j| bones.joints[j]);
        let along = |(from, to): (P3d, P3d)| {
            (1..=AIR_SAMPLES).map(move |k| from + (to - from) * (k as f64 / AIR_SAMPLES as f64))
        };
        let is_in_air = |p: &P3d| {
            let cell = grid.cell_of(&p.cast()).and_then(|(u, v)| grid.cell(u, v));
            // A sleeve without return looks like a background that was removed.
            let is_measured = |c: &usize| grid.labels[*c] != Label::Unknown && grid.depth[*c] > 0.0;
            let cell = cell.filter(is_measured);
            cell.is_some_and(|c| p.z < f64::from(grid.depth[c]) - self.air)
        };
        let bones = [(root, hinge), (hinge, self.hand(bones))];
        let points = bones.into_iter().flat_map(along);
        let is_inside = |p: &P3d| trunk.is_some_and(|t| t.inside(p).is_some());
        points.filter(|p| is_in_air(p) || is_inside(p)).count()
    }
    /// Length of the stretched limb from root to tip, metres.
    pub(crate) fn length(&self, rest: &RestBody) -> f64 {
        (rest.joints[self.hinge] - rest.joints[self.root]).norm()
            + (rest.joints[self.tip] - rest.joints[self.hinge]).norm()
    }
    /// Moves the hand or foot to `target` by bending the hinge and turning the root from the rest pose. With `hinge`, the
    /// limb then turns about the line from root to target until its hinge points there.
    pub(crate) fn reach(
        &self,
        skeleton: &Skeleton,
        rest: &RestBody,
        pose: &mut Pose,
        target: &P3d,
        hinge: Option<&P3d>,
    ) {
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
        let parent = skeleton.joints()[self.root].parent;
        let parent = parent.map_or(pose.root.iso().rotation, |p| bones.bones[p].rotation);
        let at = self.angles[0];
        let old = exp_so3(&pose.rotation_vector(skeleton, self.root));
        let new = log_so3(&(parent.inverse() * turn * parent * old));
        pose.angles[at..at + 3].copy_from_slice(new.as_slice());
        pose.clamp_to_limits(skeleton);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::TestScene;

    #[test]
    fn a_limb_reaches_its_target_with_its_hinge_on_the_given_side() {
        let scene = TestScene::default();
        let (model, rest, pose) = (&scene.model, &scene.rest, &scene.pose);
        let skeleton = model.template.skeleton();
        let bones = scene.bones(pose);
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
            limb.reach(skeleton, rest, &mut found, &target, Some(&asked));
            let now = scene.bones(&found);
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
            let far = root + offset * 5.0;
            limb.reach(skeleton, rest, &mut found, &far, None);
            assert!(found.is_finite(), "a target out of reach");
            limb.reach(skeleton, rest, &mut found, &root, Some(&root));
            assert!(found.is_finite(), "a target in the joint itself");
        }
    }
}
