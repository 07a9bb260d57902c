//! Pose hypotheses from proposed joints: trunk by weighted Procrustes alignment, limbs by inverse kinematics.

use super::joint_proposals::JointProposals;
use super::limb::Limb;
use super::part_classes::PartKind;
use super::pose_fit::{FitContext, FitScratch, evaluate};
use crate::body::parts::{BodyPart, BodySide};
use crate::body::{BoneTransforms, Pose};
use crate::math::{P3d, Rigid, polar_rotation_3};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Least number of trunk joints for an alignment.
const LEAST_JOINTS: usize = 3;
/// Longest pair in comparisons of hypotheses, metres.
const REACH: f32 = 0.15;
/// Limb lengths from its root beyond which a proposed end is not this limb's.
const STRETCH: f64 = 1.2;

/// Proposed joints of one frame and the body they are for.
pub(super) struct ProposedPoses<'a> {
    pub context: FitContext<'a>,
    pub proposals: &'a JointProposals,
}

/// A limb with the classes of its end and its hinge.
struct LimbClasses<'a> {
    limb: &'a Limb,
    end: u8,
    hinge: u8,
}

impl ProposedPoses<'_> {
    /// Rest pose with the trunk at its proposed joints; `None` with too few of them.
    pub(super) fn trunk(&self) -> Option<Pose> {
        let model = self.context.model;
        let rest = &self.context.body.rest.joints;
        let roots: Vec<usize> = model.limbs().map(|(_, l)| l.root).collect();
        let is_trunk =
            |j: usize| model.parts[j] == BodyPart::Trunk as usize || roots.contains(&j);
        let mut pairs: Vec<(Vector3<f64>, Vector3<f64>, f64)> = Vec::new();
        let mut last = None;
        for anchor in &self.proposals.anchors {
            // The heaviest place of each class.
            if last == Some(anchor.class) || !anchor.joints.iter().all(|&j| is_trunk(j)) {
                continue;
            }
            last = Some(anchor.class);
            let [a, b] = anchor.joints.map(|j| rest[j].coords);
            let at = anchor.position.coords.cast::<f64>();
            pairs.push(((a + b) * 0.5, at, f64::from(anchor.weight)));
        }
        if pairs.len() < LEAST_JOINTS {
            return None;
        }
        let root = procrustes(&pairs)?;
        let root = Rigid::from_parts(root.translation.vector, root.rotation);
        Some(Pose::rest(model.template.skeleton(), root))
    }

    /// `pose` with the given part moved to its proposed places where that costs less.
    pub(super) fn choose_limb(
        &self,
        pose: &Pose,
        part: BodyPart,
        scratch: &mut FitScratch,
    ) -> Pose {
        let Some(classes) = self.classes(part) else {
            return pose.clone();
        };
        let cost = |pose: &Pose, scratch: &mut FitScratch| {
            evaluate(&self.context, pose, REACH, scratch).cost
        };
        let mut best = (cost(pose, scratch), pose.clone());
        for candidate in self.limb_poses(pose, &classes) {
            let cost = cost(&candidate, scratch);
            if cost < best.0 {
                best = (cost, candidate);
            }
        }
        best.1
    }

    fn classes(&self, part: BodyPart) -> Option<LimbClasses<'_>> {
        let (_, limb) = self.context.model.limbs().find(|(p, _)| *p == part)?;
        let (end, hinge, side) = match part {
            BodyPart::Trunk => return None,
            BodyPart::LeftArm => (PartKind::Hand, PartKind::Elbow, BodySide::Left),
            BodyPart::RightArm => (PartKind::Hand, PartKind::Elbow, BodySide::Right),
            BodyPart::LeftLeg => (PartKind::Foot, PartKind::Knee, BodySide::Left),
            BodyPart::RightLeg => (PartKind::Foot, PartKind::Knee, BodySide::Right),
        };
        Some(LimbClasses {
            limb,
            end: end.class(side),
            hinge: hinge.class(side),
        })
    }

    /// The limb at each proposed end within its length, with its hinge at each proposed place and free; straight through
    /// the hinge without an end.
    fn limb_poses(&self, pose: &Pose, classes: &LimbClasses<'_>) -> Vec<Pose> {
        let (model, rest) = (self.context.model, &self.context.body.rest);
        let limb = classes.limb;
        let mut bones = BoneTransforms::default();
        pose.bones(model.template.skeleton(), rest, &mut bones);
        let root = bones.joints[limb.root];
        let length = limb.length(rest);
        let places = |class: u8| {
            let places = self.proposals.of_class(class);
            places.map(|(p, _)| P3d::from(p.coords.cast::<f64>()))
        };
        let hinges: Vec<P3d> = places(classes.hinge).collect();
        let mut targets: Vec<(P3d, Option<P3d>)> = Vec::new();
        for end in places(classes.end).filter(|e| (e - root).norm() < STRETCH * length) {
            targets.push((end, None));
            targets.extend(hinges.iter().map(|h| (end, Some(*h))));
        }
        for hinge in &hinges {
            let along = (hinge - root).try_normalize(f64::EPSILON);
            targets.extend(along.map(|a| (root + a * length, None)));
        }
        let reached = |(end, hinge): &(P3d, Option<P3d>)| {
            let mut reached = pose.clone();
            limb.reach(
                model.template.skeleton(),
                rest,
                &mut reached,
                end,
                hinge.as_ref(),
            );
            reached
        };
        targets.iter().map(reached).collect()
    }
}

/// Rigid motion of least squares that takes the first of each weighted pair to the second (Kabsch).
fn procrustes(
    pairs: &[(Vector3<f64>, Vector3<f64>, f64)],
) -> Option<nalgebra::Isometry3<f64>> {
    let total: f64 = pairs.iter().map(|p| p.2).sum();
    if !(total > f64::EPSILON) {
        return None;
    }
    let mean = |of: fn(&(Vector3<f64>, Vector3<f64>, f64)) -> Vector3<f64>| {
        pairs.iter().map(|p| of(p) * p.2).sum::<Vector3<f64>>() / total
    };
    let (from, to) = (mean(|p| p.0), mean(|p| p.1));
    let covariance: Matrix3<f64> = pairs
        .iter()
        .map(|(a, b, w)| (b - to) * (a - from).transpose() * *w)
        .sum();
    let rotation = Rotation3::from_matrix_unchecked(polar_rotation_3(&covariance));
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Some(nalgebra::Isometry3::from_parts(
        (to - rotation * from).into(),
        rotation,
    ))
}
