//! Pose hypotheses of arms and legs: a fixed set of arms, and limbs that end at extremities of the readings.

use crate::fit::{FitContext, FitScratch, evaluate};
use crate::model::Limb;
use crate::segment::{Extremity, extremities};
use crate::settings::HypothesisSettings;
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

/// A point of the skin displaced along its viewing ray to the bone.
fn inside(p: &P3, settings: &HypothesisSettings) -> P3d {
    let p = p.cast::<f64>();
    p + p.coords.try_normalize(0.0).unwrap_or_else(Vector3::z) * settings.behind
}

/// Hypotheses of limbs in the readings of one frame.
pub(crate) struct Hypotheses<'a> {
    context: FitContext<'a>,
    extremities: Vec<Extremity>,
}

/// Direction of a limb's root bone (rest frame of its parent), bend of its hinge and twist about the bone, radians.
#[derive(Clone, Copy)]
struct LimbAim {
    direction: Vector3<f64>,
    bend: f64,
    twist: f64,
}

impl LimbAim {
    fn new(direction: Vector3<f64>, bend: f64, twist: f64) -> Self {
        Self {
            direction,
            bend,
            twist,
        }
    }
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
        let settings = &context.model.config.segment.extremities;
        let observation = context.observation;
        Self {
            context: *context,
            extremities: extremities(observation.grid, observation.cells, torso, settings),
        }
    }

    /// The arm pose of one side (0 left, 1 right) of least cost.
    pub(crate) fn choose_arm(&self, pose: &Pose, side: usize, scratch: &mut FitScratch) -> Pose {
        let settings = &self.context.model.config.start.hypotheses;
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
            for bend in settings.bends {
                let aim = LimbAim::new(direction, bend, 0.0);
                all.push(self.aimed_arm(pose, side, aim, scratch));
            }
        }
        all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut finalists: Vec<Vector3<f64>> = Vec::new();
        for direction in all.iter().filter_map(|a| a.direction) {
            if finalists.len() < settings.arm_finalists && !finalists.contains(&direction) {
                finalists.push(direction);
            }
        }
        for direction in finalists {
            for bend in settings.more_bends {
                for twist in settings.twists {
                    let aim = LimbAim::new(direction, bend, twist);
                    all.push(self.aimed_arm(pose, side, aim, scratch));
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
        let settings = &self.context.model.config.start.hypotheses;
        let Some(leg) = &self.context.model.legs[side] else {
            return pose.clone();
        };
        let skeleton = self.context.model.template.skeleton();
        let knee = &skeleton.joints()[leg.hinge].name;
        let mut hypotheses = self.at_extremities(pose, leg);
        let directions = self.towards(pose, leg, self.extremities.iter().map(|e| e.point));
        for bend in settings.more_bends {
            let mut bent = pose.clone();
            bent.set(skeleton, knee, &[bend]);
            hypotheses.push(bent);
            for &direction in &directions {
                for twist in settings.leg_twists {
                    hypotheses.push(self.aimed(pose, leg, &LimbAim::new(direction, bend, twist)));
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
        let settings = &self.context.model.config.start.hypotheses;
        evaluate(&self.context, pose, settings.reach, scratch).cost
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

    /// The arm of `side` along a direction; its twist counts outward.
    fn aimed_arm(
        &self,
        pose: &Pose,
        side: usize,
        aim: LimbAim,
        scratch: &mut FitScratch,
    ) -> ArmPose {
        let settings = &self.context.model.config.start.hypotheses;
        let pose = match &self.context.model.arms[side] {
            Some(arm) => {
                let twist = aim.twist * outward_sign(side);
                self.aimed(pose, arm, &LimbAim { twist, ..aim })
            }
            None => pose.clone(),
        };
        let effort =
            settings.bend_cost * aim.bend * aim.bend + settings.twist_cost * aim.twist * aim.twist;
        ArmPose {
            cost: self.cost(&pose, scratch) + effort,
            direction: (aim.twist == 0.0).then_some(aim.direction),
            pose,
        }
    }

    /// A pose with the limb's root aimed along a direction, twisted about it, and the hinge bent.
    fn aimed(&self, pose: &Pose, limb: &Limb, aim: &LimbAim) -> Pose {
        let skeleton = self.context.model.template.skeleton();
        let joints = skeleton.joints();
        let (root, hinge) = (&joints[limb.root], &joints[limb.hinge]);
        let mut aimed = pose.clone();
        let turn = UnitQuaternion::rotation_between(&(hinge.rest - root.rest), &aim.direction);
        if let (JointMotion::Ball { .. }, Some(turn)) = (&root.motion, turn) {
            let about = UnitQuaternion::from_scaled_axis(aim.direction * aim.twist);
            let rotation = log_so3(&(about * turn));
            aimed.set(skeleton, &root.name, rotation.as_slice());
        }
        aimed.set(skeleton, &hinge.name, &[aim.bend]);
        aimed.clamp_to_limits(skeleton);
        aimed
    }

    /// Cost of the bend and twist of a limb; see `bend_cost`.
    fn effort(&self, pose: &Pose, limb: &Limb) -> f64 {
        let settings = &self.context.model.config.start.hypotheses;
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
        settings.bend_cost * bend * bend + settings.twist_cost * twist * twist
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
        let settings = &self.context.model.config.start.hypotheses;
        let (model, rest) = (self.context.model, &self.context.body.rest);
        let skeleton = model.template.skeleton();
        let (root, _) = self.root_of(pose, limb);
        let lower = (rest.joints[limb.tip] - rest.joints[limb.hinge]).norm();
        let mut out = Vec::new();
        for end in &self.extremities {
            let target = inside(&end.point, settings);
            let line = target - root;
            if line.norm() > settings.stretch * limb.length(rest) || line.norm() < f64::EPSILON {
                continue;
            }
            let hinge = inside(&end.along(lower as f32), settings);
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
        let settings = &self.context.model.config.start.hypotheses;
        let [nearest, farthest] = settings.hinge_range;
        let joints = &self.context.body.rest.joints;
        let (root, parent) = self.root_of(pose, limb);
        let upper = (joints[limb.hinge] - joints[limb.root]).norm();
        points
            .map(|p| inside(&p, settings))
            .filter(|p| (nearest..farthest).contains(&((p - root).norm() / upper)))
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
    let settings = &context.model.config.start.hypotheses;
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
    let all = directions
        .iter()
        .flat_map(|d| settings.bends.map(|bend| (d, bend)));
    let mut misplaced = |pose: &Pose| {
        pose.bones(context.model.template.skeleton(), &context.body.rest, bones);
        let trunk = context.model.trunk.and_then(|t| t.column(bones));
        limb.misplaced_points(bones, context.observation.grid, trunk.as_ref())
    };
    let now = misplaced(pose);
    let aimed = all.map(|(d, bend)| {
        let direction = Vector3::new(d[0] * sign, d[1], d[2]).normalize();
        hypotheses.aimed(pose, limb, &LimbAim::new(direction, bend, 0.0))
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
