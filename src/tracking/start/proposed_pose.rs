//! Pose hypotheses from proposed joints: trunk by weighted Procrustes alignment, limbs by inverse kinematics.

use super::joint_proposals::JointProposals;
use crate::model::{Limb, PartKind, TrackerModel};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use tryon_body::parts::{BodyPart, BodySide};
use tryon_body::{BoneTransforms, Pose, RestBody};
use tryon_geometry::math::{P3, P3d, Rigid, polar_rotation_3};

/// Poses that proposals of one frame suggest for a body.
#[derive(Clone, Copy)]
pub(crate) struct ProposedPoses<'a> {
    /// Tracker of the body.
    pub(crate) model: &'a TrackerModel,
    /// The body in its rest pose.
    pub(crate) rest: &'a RestBody,
    /// Proposals of one frame.
    pub(crate) proposals: &'a JointProposals,
}

/// A limb with the classes of its end and its hinge.
struct LimbClasses<'a> {
    limb: &'a Limb,
    end: u8,
    hinge: u8,
}

/// A corresponding pair: place in the rest pose, place in the camera frame, weight.
type WeightedPair = (Vector3<f64>, Vector3<f64>, f64);

impl ProposedPoses<'_> {
    /// Rest pose with the trunk at its proposed joints; `None` with too few of them.
    pub(crate) fn trunk(&self) -> Option<Pose> {
        let settings = &self.model.config.start.proposals;
        let pairs = self.trunk_pairs();
        if pairs.len() < settings.least_joints {
            return None;
        }
        let root = procrustes(&pairs)?;
        let root = Rigid::from_parts(root.translation.vector, root.rotation);
        Some(Pose::rest(self.model.template.skeleton(), root))
    }

    /// Rest pose of a given rotation with the trunk at its proposed joints, for half a body, whose few joints lie on a line;
    /// `None` without a joint.
    pub(crate) fn trunk_along(&self, rotation: UnitQuaternion<f64>) -> Option<Pose> {
        let pairs = self.trunk_pairs();
        let total: f64 = pairs.iter().map(|p| p.2).sum();
        let sum: Vector3<f64> = pairs.iter().map(|(a, b, w)| (b - rotation * a) * *w).sum();
        let root = (total > f64::EPSILON).then(|| Rigid::from_parts(sum / total, rotation))?;
        Some(Pose::rest(self.model.template.skeleton(), root))
    }

    /// Joints of the trunk: each class's place in the rest pose and its heaviest proposal.
    fn trunk_pairs(&self) -> Vec<WeightedPair> {
        let model = self.model;
        let roots: Vec<usize> = model.limbs().map(|(_, l)| l.root).collect();
        let is_trunk = |j: usize| model.parts[j] == BodyPart::Trunk as usize || roots.contains(&j);
        let mut pairs: Vec<WeightedPair> = Vec::new();
        let mut last = None;
        for anchor in &self.proposals.anchors {
            if last == Some(anchor.class) || !anchor.joints.iter().all(|&j| is_trunk(j)) {
                continue;
            }
            last = Some(anchor.class);
            let [a, b] = anchor.joints.map(|j| self.rest.joints[j].coords);
            let at = anchor.position.coords.cast::<f64>();
            pairs.push(((a + b) * 0.5, at, f64::from(anchor.weight)));
        }
        pairs
    }

    /// `pose` with one limb at each proposed end within its length, heaviest first: its hinge at each proposed place, then
    /// free; straight through the hinge without an end.
    pub(crate) fn limb_poses(&self, pose: &Pose, part: BodyPart) -> Vec<Pose> {
        let settings = &self.model.config.start.proposals;
        let Some(classes) = self.classes(part) else {
            return vec![];
        };
        let (skeleton, limb) = (self.model.template.skeleton(), classes.limb);
        let mut bones = BoneTransforms::default();
        pose.bones(skeleton, self.rest, &mut bones);
        let root = bones.joints[limb.root];
        let length = limb.length(self.rest);
        let places = |class: u8| {
            let heavy = |(_, w): &(P3, f32)| *w >= settings.least_end;
            let places = self.proposals.of_class(class).filter(heavy);
            places.map(|(p, _)| P3d::from(p.coords.cast::<f64>()))
        };
        let hinges: Vec<P3d> = places(classes.hinge).collect();
        let mut targets: Vec<(P3d, Option<P3d>)> = Vec::new();
        for end in places(classes.end).filter(|e| (e - root).norm() < settings.stretch * length) {
            targets.extend(hinges.iter().map(|h| (end, Some(*h))));
            targets.push((end, None));
        }
        for hinge in &hinges {
            let along = (hinge - root).try_normalize(f64::EPSILON);
            targets.extend(along.map(|a| (root + a * length, None)));
        }
        let reached = |(end, hinge): &(P3d, Option<P3d>)| {
            let mut reached = pose.clone();
            limb.reach(skeleton, self.rest, &mut reached, end, hinge.as_ref());
            reached
        };
        targets.iter().map(reached).collect()
    }

    fn classes(&self, part: BodyPart) -> Option<LimbClasses<'_>> {
        let (_, limb) = self.model.limbs().find(|(p, _)| *p == part)?;
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
}

/// Rigid motion of least squares that takes the first of each weighted pair to the second (Kabsch).
fn procrustes(pairs: &[WeightedPair]) -> Option<nalgebra::Isometry3<f64>> {
    let total: f64 = pairs.iter().map(|p| p.2).sum();
    if !(total > f64::EPSILON) {
        return None;
    }
    let mean = |of: fn(&WeightedPair) -> Vector3<f64>| {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{PART_CLASSES, PartClasses};
    use crate::segment::part_network::JointProposal;
    use crate::test_scene::TestScene;

    impl ProposedPoses<'_> {
        /// The trunk at its proposed joints with each limb at its heaviest proposal.
        fn pose(&self) -> Option<Pose> {
            let with_limb = |pose: Pose, (part, _): (BodyPart, &Limb)| {
                let first = self.limb_poses(&pose, part).into_iter().next();
                first.unwrap_or(pose)
            };
            Some(self.model.limbs().fold(self.trunk()?, with_limb))
        }
    }

    /// Proposals of a pose without error.
    fn exact(scene: &TestScene, classes: &PartClasses, pose: &Pose) -> JointProposals {
        let joints = scene.joints(pose);
        let found: Vec<JointProposal> = (0..PART_CLASSES as u8)
            .filter_map(|class| {
                let position = classes.anchor_of(class, &joints)?.cast::<f32>();
                Some(JointProposal {
                    class,
                    position,
                    weight: 0.8,
                })
            })
            .collect();
        JointProposals::new(classes, &found, &scene.model.config.start.proposals)
    }

    #[test]
    fn a_pose_is_found_from_its_own_joints_and_turned_from_mirrored_ones() {
        let scene = TestScene::default();
        let classes = PartClasses::new(&scene.model.template);
        let mut truth = scene.pose.clone();
        let skeleton = scene.model.template.skeleton();
        for (limb, bend) in scene.model.arms.iter().flatten().zip([0.8, 0.3]) {
            truth.angles[limb.angles[3]] = bend;
        }
        truth.clamp_to_limits(skeleton);
        let proposals = exact(&scene, &classes, &truth);
        let found = |proposals: &JointProposals| {
            let poses = ProposedPoses {
                model: &scene.model,
                rest: &scene.rest,
                proposals,
            };
            poses.pose().expect("a trunk")
        };
        let off = scene.distance(&found(&proposals), &truth);
        assert!(off < 0.10, "{off}");
        let flipped = found(&proposals.flipped(&classes));
        let turn = (flipped.root.iso().rotation.inverse() * truth.root.iso().rotation).angle();
        assert!(turn > 2.8, "{turn}");
        let none = JointProposals::default();
        let poses = ProposedPoses {
            model: &scene.model,
            rest: &scene.rest,
            proposals: &none,
        };
        assert!(poses.pose().is_none());
    }
}
