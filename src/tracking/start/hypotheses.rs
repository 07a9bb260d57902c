//! Pose hypotheses of arms and legs: a fixed set of arms, and limbs that end at extremities of the readings.

use crate::fit::{FitContext, FitScratch, evaluate};
use crate::model::Limb;
use crate::segment::{Extremity, extremities};
use nalgebra::{UnitQuaternion, Vector3};
use tryon_body::parts::BodyPart;
use tryon_body::{BoneTransforms, JointMotion, Pose};
use tryon_geometry::math::{P3, P3d, exp_so3, log_so3};

/// Directions of the upper arm (x outward, y up, z forward).
const UPPER_ARMS: [[f64; 3]; 9] = [
    [0.15, -0.99, 0.0],
    [0.4, -0.92, 0.0],
    [0.75, -0.65, -0.1],
    [1.0, 0.0, 0.0],
    [0.7, 0.7, 0.0],
    [0.25, 0.95, 0.15],
    [0.3, -0.75, 0.6],
    [0.3, -0.1, 0.95],
    [0.75, -0.2, 0.6],
];
/// Directions of a thigh that stands or sits, as [`UPPER_ARMS`].
const RESTING_LEGS: [[f64; 3]; 2] = [[0.05, -1.0, 0.0], [0.1, -0.8, 0.5]];
/// Bends of the elbow in the first pass over arms, radians.
const BENDS: [f64; 2] = [0.1, 1.4];
/// Bends of elbow or knee in the second pass, radians.
const MORE_BENDS: [f64; 3] = [0.7, 1.4, 2.2];
/// Turns of the upper arm about its own axis in the second pass, radians.
const TWISTS: [f64; 5] = [-1.8, -0.9, 0.0, 0.9, 1.8];
/// Turns of a thigh about its own axis with the knee at an extremity, radians.
const LEG_TWISTS: [f64; 3] = [-0.9, 0.0, 0.9];
/// Cost of a bend, m² per point and squared radian; a hand of ten readings is worth 7·10⁻⁵. Without it a straight arm,
/// explained by a bent one turned inside out, stays so.
const BEND_COST: f64 = 1e-5;
/// Cost of a twist, m² per point and squared radian; see [`BEND_COST`].
const TWIST_COST: f64 = 3e-5;
/// Upper arms that enter the second pass.
const ARM_FINALISTS: usize = 3;

/// Extremities to detect: head, hands, feet, and elbows of hands that lie on the body.
const EXTREMITIES: usize = 7;
/// Limb lengths from its root beyond which an extremity is not this limb's.
const STRETCH: f64 = 1.15;
/// Depth of a joint below its extremity on the skin, metres.
const BEHIND: f64 = 0.02;
/// Distance of a hinge from its root, in lengths of the upper bone, at which a point may be the hinge.
const HINGE_RANGE: std::ops::Range<f64> = 0.5..1.4;
/// Longest pair in comparisons of hypotheses, metres.
const REACH: f32 = 0.15;

/// A point of the skin displaced along its viewing ray to the bone.
fn inside(p: &P3) -> P3d {
    let p = p.cast::<f64>();
    p + p.coords.try_normalize(0.0).unwrap_or_else(Vector3::z) * BEHIND
}

/// Hypotheses of limbs in the readings of one frame.
pub(crate) struct Hypotheses<'a> {
    context: FitContext<'a>,
    extremities: Vec<Extremity>,
}

/// A hypothesis of an arm.
struct ArmPose {
    cost: f64,
    /// Direction of the upper arm, for those of the first pass.
    direction: Option<Vector3<f64>>,
    pose: Pose,
}

impl<'a> Hypotheses<'a> {
    /// Detects the extremities around `torso`, camera frame, metres.
    pub(crate) fn new(context: &FitContext<'a>, torso: &P3) -> Self {
        let observation = context.observation;
        Self {
            context: *context,
            extremities: extremities(observation.grid, observation.cells, torso, EXTREMITIES),
        }
    }

    /// The arm pose of one side (0 left, 1 right) of least cost.
    pub(crate) fn choose_arm(&self, pose: &Pose, side: usize, scratch: &mut FitScratch) -> Pose {
        let Some(arm) = &self.context.model.arms[side] else {
            return pose.clone();
        };
        let mut all = Vec::new();
        for pose in self.at_extremities(pose, arm) {
            all.push(ArmPose {
                cost: self.cost(&pose, scratch) + self.effort(&pose, arm),
                direction: None,
                pose,
            });
        }
        for direction in self.upper_arms(pose, arm, side) {
            for bend in BENDS {
                let hypothesis = self.aimed_arm(pose, side, (direction, bend, 0.0), scratch);
                all.push(hypothesis);
            }
        }
        all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut finalists: Vec<Vector3<f64>> = Vec::new();
        for direction in all.iter().filter_map(|a| a.direction) {
            if finalists.len() < ARM_FINALISTS && !finalists.contains(&direction) {
                finalists.push(direction);
            }
        }
        for direction in finalists {
            for bend in MORE_BENDS {
                for twist in TWISTS {
                    all.push(self.aimed_arm(pose, side, (direction, bend, twist), scratch));
                }
            }
        }
        all.into_iter()
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
            .map_or_else(|| pose.clone(), |a| a.pose)
    }

    /// The leg pose of one side (0 left, 1 right) of least cost: as it is, with the knee bent, with the foot or the knee
    /// at an extremity.
    pub(crate) fn choose_leg(&self, pose: &Pose, side: usize, scratch: &mut FitScratch) -> Pose {
        let Some(leg) = &self.context.model.legs[side] else {
            return pose.clone();
        };
        let skeleton = self.context.model.template.skeleton();
        let knee = &skeleton.joints()[leg.hinge].name;
        let mut hypotheses = self.at_extremities(pose, leg);
        let directions = self.towards(pose, leg, self.extremities.iter().map(|e| e.point));
        for bend in MORE_BENDS {
            let mut bent = pose.clone();
            bent.set(skeleton, knee, &[bend]);
            hypotheses.push(bent);
            for &direction in &directions {
                for twist in LEG_TWISTS {
                    hypotheses.push(self.aimed(pose, leg, direction, (bend, twist)));
                }
            }
        }
        let mut best = (self.cost(pose, scratch), pose.clone());
        for pose in hypotheses {
            let cost = self.cost(&pose, scratch) + self.effort(&pose, leg);
            if cost < best.0 {
                best = (cost, pose);
            }
        }
        best.1
    }

    fn cost(&self, pose: &Pose, scratch: &mut FitScratch) -> f64 {
        evaluate(&self.context, pose, REACH, scratch).cost
    }

    /// Directions of the upper arm for the first pass. An extremity may be the elbow, and a path to one passes it.
    fn upper_arms(&self, pose: &Pose, arm: &Limb, side: usize) -> Vec<Vector3<f64>> {
        let sign = outward_sign(side);
        let outward = |d: [f64; 3]| Vector3::new(d[0] * sign, d[1], d[2]).normalize();
        let mut directions: Vec<Vector3<f64>> = UPPER_ARMS.into_iter().map(outward).collect();
        let joints = &self.context.body.rest.joints;
        let lower = (joints[arm.tip] - joints[arm.hinge]).norm() as f32;
        let elbows = self.extremities.iter();
        let elbows = elbows.flat_map(|e| [e.point, e.along(lower)]);
        directions.extend(self.towards(pose, arm, elbows));
        directions
    }

    /// The arm of `side` along a direction, with a bend and a twist, radians.
    fn aimed_arm(
        &self,
        pose: &Pose,
        side: usize,
        (direction, bend, twist): (Vector3<f64>, f64, f64),
        scratch: &mut FitScratch,
    ) -> ArmPose {
        let pose = match &self.context.model.arms[side] {
            Some(arm) => self.aimed(pose, arm, direction, (bend, twist * outward_sign(side))),
            None => pose.clone(),
        };
        let effort = BEND_COST * bend * bend + TWIST_COST * twist * twist;
        ArmPose {
            cost: self.cost(&pose, scratch) + effort,
            direction: (twist == 0.0).then_some(direction),
            pose,
        }
    }

    /// A pose with the limb's root aimed along `direction` (rest frame of its parent), twisted about it, and the hinge
    /// bent, radians.
    fn aimed(
        &self,
        pose: &Pose,
        limb: &Limb,
        direction: Vector3<f64>,
        (bend, twist): (f64, f64),
    ) -> Pose {
        let skeleton = self.context.model.template.skeleton();
        let joints = skeleton.joints();
        let (root, hinge) = (&joints[limb.root], &joints[limb.hinge]);
        let mut aimed = pose.clone();
        let turn = UnitQuaternion::rotation_between(&(hinge.rest - root.rest), &direction);
        if let (JointMotion::Ball { .. }, Some(turn)) = (&root.motion, turn) {
            let about = UnitQuaternion::from_scaled_axis(direction * twist);
            let rotation = log_so3(&(about * turn));
            aimed.set(skeleton, &root.name, rotation.as_slice());
        }
        aimed.set(skeleton, &hinge.name, &[bend]);
        aimed.clamp_to_limits(skeleton);
        aimed
    }

    /// Cost of the bend and twist of a limb; see [`BEND_COST`].
    fn effort(&self, pose: &Pose, limb: &Limb) -> f64 {
        let joints = self.context.model.template.skeleton().joints();
        let Some(child) = joints.iter().position(|j| j.parent == Some(limb.root)) else {
            return 0.0;
        };
        // Twist of the swing–twist decomposition of the root's rotation about its own bone.
        let along = (joints[child].rest - joints[limb.root].rest).normalize();
        let turn = exp_so3(&Vector3::new(
            pose.angles[limb.angles[0]],
            pose.angles[limb.angles[1]],
            pose.angles[limb.angles[2]],
        ));
        let twist = 2.0 * (turn.imag().dot(&along) / turn.w.abs().max(f64::MIN_POSITIVE)).atan();
        let bend = pose.angles[limb.angles[3]];
        BEND_COST * bend * bend + TWIST_COST * twist * twist
    }

    /// Position of the limb's root and rotation of its parent bone.
    fn root_of(&self, pose: &Pose, limb: &Limb) -> (P3d, UnitQuaternion<f64>) {
        let (model, rest) = (self.context.model, &self.context.body.rest);
        let mut bones = BoneTransforms::default();
        pose.bones(model.template.skeleton(), rest, &mut bones);
        let parent = model.parents[limb.root];
        let rotation = parent.map_or(pose.root.iso().rotation, |p| bones.bones[p].rotation);
        (bones.joints[limb.root], rotation)
    }

    /// Poses with the limb's end at each extremity within its length, and its hinge on the path over the surface there.
    fn at_extremities(&self, pose: &Pose, limb: &Limb) -> Vec<Pose> {
        let (model, rest) = (self.context.model, &self.context.body.rest);
        let skeleton = model.template.skeleton();
        let (root, _) = self.root_of(pose, limb);
        let lower = (rest.joints[limb.tip] - rest.joints[limb.hinge]).norm();
        let mut out = Vec::new();
        for end in &self.extremities {
            let target = inside(&end.point);
            let line = target - root;
            if line.norm() > STRETCH * limb.length(rest) || line.norm() < f64::EPSILON {
                continue;
            }
            let hinge = inside(&end.along(lower as f32));
            let mut reached = pose.clone();
            limb.reach(skeleton, rest, &mut reached, &target, Some(&hinge));
            out.push(reached);
        }
        out
    }

    /// Directions (rest frame of the parent bone) from the limb's root to those of `points` that may be its hinge.
    fn towards(
        &self,
        pose: &Pose,
        limb: &Limb,
        points: impl Iterator<Item = P3>,
    ) -> Vec<Vector3<f64>> {
        let joints = &self.context.body.rest.joints;
        let (root, parent) = self.root_of(pose, limb);
        let upper = (joints[limb.hinge] - joints[limb.root]).norm();
        points
            .map(|p| inside(&p))
            .filter(|p| HINGE_RANGE.contains(&((p - root).norm() / upper)))
            .map(|p| (parent.inverse() * (p - root)).normalize())
            .collect()
    }
}

/// `pose` with one arm or leg where it may rest unseen, as little of it as possible in measured free space or the trunk;
/// `None` where it is out of them already.
pub(crate) fn resting_limb(
    context: &FitContext<'_>,
    pose: &Pose,
    part: BodyPart,
    bones: &mut BoneTransforms,
) -> Option<Pose> {
    let (_, limb) = context.model.limbs().find(|(p, _)| *p == part)?;
    let (side, directions): (usize, &[[f64; 3]]) = match part {
        BodyPart::LeftArm => (0, &UPPER_ARMS),
        BodyPart::RightArm => (1, &UPPER_ARMS),
        BodyPart::LeftLeg => (0, &RESTING_LEGS),
        BodyPart::RightLeg => (1, &RESTING_LEGS),
        BodyPart::Trunk => return None,
    };
    let hypotheses = Hypotheses {
        context: *context,
        extremities: Vec::new(),
    };
    let sign = outward_sign(side);
    let all = directions.iter().flat_map(|d| BENDS.map(|bend| (d, bend)));
    let mut misplaced = |pose: &Pose| {
        pose.bones(context.model.template.skeleton(), &context.body.rest, bones);
        let trunk = context.model.trunk.and_then(|t| t.column(bones));
        limb.misplaced_points(bones, context.observation.grid, trunk.as_ref())
    };
    let now = misplaced(pose);
    let aimed = all.map(|(d, bend)| {
        let direction = Vector3::new(d[0] * sign, d[1], d[2]).normalize();
        hypotheses.aimed(pose, limb, direction, (bend, 0.0))
    });
    let rated = aimed.map(|pose| (misplaced(&pose), pose));
    let least = rated.min_by_key(|(points, _)| *points);
    least
        .filter(|(points, _)| *points < now)
        .map(|(_, pose)| pose)
}

/// Sign of the outward x direction of a side (0 left, 1 right).
fn outward_sign(side: usize) -> f64 {
    [1.0, -1.0][side]
}
