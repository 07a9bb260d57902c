//! Arms that overlap the trunk, turned outwards until cloth fits between.
//!
//! A tracked body wears the clothes of its person on its trunk, so that arms at its sides reach into it, by half their
//! thickness on real recordings. No sleeve fits there.

use crate::parts::{
    BodyPart, EllipticColumn, EllipticSection, LimbJoints, TrunkFrame, mean_radius,
};
use crate::settings::ArmClearanceSettings;
use crate::{BoneTransforms, Pose, RestBody, Template};
use nalgebra::UnitQuaternion;
use tryon_geometry::math::{P3d, V3d, exp_so3, log_so3};

/// Bands of the trunk between pelvis and shoulders, 6 cm each: waist and chest differ.
const BANDS: usize = 8;
/// Turns of the shoulder, each by the deepest point to first order: the third is below a millimetre.
const TURNS: usize = 3;

/// One upper arm: the joints at its ends, and its radius, metres.
#[derive(Clone, Copy, Debug)]
struct UpperArm {
    joints: LimbJoints,
    radius: f64,
}

/// Trunk and arms of one rest body.
#[derive(Clone, Debug)]
pub struct ArmClearance {
    settings: ArmClearanceSettings,
    arms: [UpperArm; 2],
    /// Section of each band, metres.
    sections: [EllipticSection; BANDS],
}

impl ArmClearance {
    /// `None` for a template without arms.
    pub fn new(template: &Template, rest: &RestBody) -> Option<Self> {
        let limbs = [BodyPart::LeftArm, BodyPart::RightArm].map(|arm| template.parts().limb(arm));
        let joints = [limbs[0]?, limbs[1]?];
        let frame = TrunkFrame::new(rest.joints[0], joints.map(|j| rest.joints[j.root]))?;
        let arms = joints.map(|joints| {
            let bone = [joints.root, joints.hinge].map(|j| rest.joints[j]);
            let radius = mean_radius(template, &rest.vertices, joints.root, bone);
            UpperArm {
                radius: radius.unwrap_or(0.0),
                joints,
            }
        });
        Some(Self {
            settings: ArmClearanceSettings::default(),
            sections: sections(template, rest, &frame),
            arms,
        })
    }

    /// The pose with both arms beside the trunk; the same pose where they are already. `bones` become those of the result.
    pub fn separate<F>(
        &self,
        template: &Template,
        rest: &RestBody,
        pose: &Pose<F>,
        bones: &mut BoneTransforms,
    ) -> Pose<F> {
        let skeleton = template.skeleton();
        let mut pose = pose.clone();
        pose.bones(skeleton, rest, bones);
        let shoulders = self.arms.map(|a| bones.joints[a.joints.root]);
        let Some(frame) = TrunkFrame::new(bones.joints[0], shoulders) else {
            return pose;
        };
        for arm in &self.arms {
            let root = arm.joints.root;
            let parent = skeleton.joints()[root].parent;
            let parent = parent.map_or(pose.root.iso().rotation, |p| bones.bones[p].rotation);
            let before = exp_so3(&pose.rotation_vector(skeleton, root));
            let mut turn = UnitQuaternion::identity();
            for _ in 0..TURNS {
                let Some(more) = self.turn(arm, &frame, bones) else {
                    break;
                };
                turn = more * turn;
                let angle = turn.angle();
                if angle > self.settings.most_turn {
                    turn = UnitQuaternion::identity().slerp(&turn, self.settings.most_turn / angle);
                }
                let local = parent.inverse() * turn * parent * before;
                let at = skeleton.dof_offset(root);
                pose.angles[at..at + 3].copy_from_slice(log_so3(&local).as_slice());
                pose.bones(skeleton, rest, bones);
            }
        }
        pose
    }

    /// Least turn of the shoulder that brings the deepest point of an arm out of the trunk; `None` when all are outside.
    fn turn(
        &self,
        arm: &UpperArm,
        frame: &TrunkFrame,
        bones: &BoneTransforms,
    ) -> Option<UnitQuaternion<f64>> {
        let [root, hinge] = [arm.joints.root, arm.joints.hinge].map(|j| bones.joints[j]);
        let points = self.settings.upper.map(|t| root + (hinge - root) * t);
        let pushes = points.iter();
        let pushes = pushes.filter_map(|p| Some((p - root, self.push(frame, p, arm.radius)?)));
        let (lever, push) = pushes.max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))?;
        let rotation = lever.cross(&push) / lever.norm_squared().max(f64::MIN_POSITIVE);
        Some(UnitQuaternion::from_scaled_axis(rotation))
    }

    /// Shortest way, to first order, from a point of an arm of radius `r` out of the trunk; `None` outside of it.
    fn push(&self, frame: &TrunkFrame, p: &P3d, r: f64) -> Option<V3d> {
        let [_, up, _] = frame.local(p);
        let section = self.section(up / frame.height);
        let column = EllipticColumn {
            base: frame.pelvis + frame.axes[2] * section.front,
            axes: frame.axes,
            half: section.half.map(|h| h + r),
            height: frame.height,
        };
        let (share, gradient) = column.inside(p)?;
        Some(gradient * ((1.0 - share) / gradient.norm_squared()))
    }

    /// Section at a share of the height, between the middles of the bands.
    fn section(&self, height: f64) -> EllipticSection {
        let at = (height * BANDS as f64 - 0.5).clamp(0.0, (BANDS - 1) as f64);
        let k = (at as usize).min(BANDS - 2);
        let t = at - k as f64;
        let [a, b] = [self.sections[k], self.sections[k + 1]];
        let between = |a: f64, b: f64| a + (b - a) * t;
        EllipticSection {
            half: [0, 1].map(|i| between(a.half[i], b.half[i])),
            front: between(a.front, b.front),
        }
    }
}

/// Sections of the trunk of a rest body.
fn sections(template: &Template, rest: &RestBody, frame: &TrunkFrame) -> [EllipticSection; BANDS] {
    let mut bands: [Vec<[f64; 3]>; BANDS] = Default::default();
    for p in frame.skin(template, &rest.vertices) {
        let band = (p[1] / frame.height * BANDS as f64) as usize;
        bands[band.min(BANDS - 1)].push(p);
    }
    bands.map(|points| EllipticSection::around(&points))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BodyShape, embedded};
    use tryon_geometry::math::{Body, Rigid, World};

    /// Step by which the upper arms are lowered from the rest pose, and the number of steps, radians.
    const STEP: f64 = 0.1;
    /// See [`STEP`].
    const STEPS: usize = 12;

    #[test]
    fn arms_in_the_trunk_are_turned_out_as_far_as_they_must_and_others_keep_their_bits() {
        let template = embedded::template();
        let rest = template.personalise(&BodyShape::default());
        let clearance = ArmClearance::new(&template, &rest).expect("arms");
        let mut bones = BoneTransforms::default();
        let mut lowered = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
        let (mut last, mut turned) = (f64::INFINITY, 0);
        for k in 0..STEPS {
            let turn = STEP * k as f64;
            lowered.set(template.skeleton(), "left_shoulder", &[0.0, 0.0, -turn]);
            lowered.set(template.skeleton(), "right_shoulder", &[0.0, 0.0, turn]);
            let result = clearance.separate(&template, &rest, &lowered, &mut bones);
            assert!(k > 0 || result == lowered, "arms at rest are free");
            turned += usize::from(result != lowered);
            let elbows = clearance.arms.map(|a| bones.joints[a.joints.hinge].x.abs());
            assert!((elbows[0] - elbows[1]).abs() < 0.01, "{elbows:?} m");
            assert!(elbows[0] > 0.15, "after {turn} rad: {elbows:?} m");
            assert!(elbows[0] < last + 0.01, "after {turn} rad: {elbows:?} m");
            last = elbows[0];
        }
        assert!((1..STEPS).contains(&turned), "{turned} poses were changed");
    }
}
