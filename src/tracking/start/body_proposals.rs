//! Proposals of the part network for one frame: joints, facing, and poses of the body from them.

use super::facing::{Facing, facing};
use super::joint_proposals::JointProposals;
use super::proposed_pose::ProposedPoses;
use crate::fit::{FitContext, FitScratch, evaluate, fit_pose};
use crate::model::{PartKind, TrackerModel};
use crate::registration::Observation;
use crate::segment::part_network::{PersonCells, PersonParts};
use crate::settings::{ProposalSettings, Schedule};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use tryon_body::parts::{BodyPart, BodySide};
use tryon_body::{BoneTransforms, Pose};
use tryon_geometry::math::P3;

/// Proposals of one frame.
pub(crate) struct BodyProposals {
    joints: JointProposals,
    flipped: JointProposals,
    facing: Option<Facing>,
    /// Unit direction against gravity, camera frame.
    up: Vector3<f64>,
    settings: ProposalSettings,
}

/// The subject's cells, as the part network reads them; `up` is the unit vector against gravity, camera frame.
pub(crate) fn person_cells<'a>(
    observation: &Observation<'a>,
    up: &Vector3<f64>,
) -> PersonCells<'a> {
    PersonCells {
        cloud: observation.grid,
        cells: observation.cells,
        up: up.cast(),
    }
}

impl BodyProposals {
    /// Proposals of what was seen of the subject. `up` is the unit direction against gravity, camera frame.
    pub(crate) fn new(
        model: &TrackerModel,
        observation: &Observation<'_>,
        up: &Vector3<f64>,
        parts: &PersonParts,
    ) -> Self {
        let person = person_cells(observation, up);
        let settings = &model.config.start.proposals;
        let joints = JointProposals::new(&model.part_classes, &parts.joints, settings);
        Self {
            flipped: joints.flipped(&model.part_classes),
            joints,
            facing: facing(&person, &parts.yaw),
            up: *up,
            settings: model.config.start.proposals,
        }
    }

    /// Factor on a pose's cost by its root's rotation: 1 along the facing and near that of a moment ago, more beyond a
    /// quarter turn from the one and after a turn around from the other.
    pub(crate) fn prior_cost(&self, pose: &Pose, recent: Option<UnitQuaternion<f64>>) -> f64 {
        let rotation = pose.root.iso().rotation;
        let settings = &self.settings;
        let has_turned = recent.is_some_and(|r| r.angle_to(&rotation) > settings.turn);
        let turn_cost = if has_turned { settings.turn_cost } else { 1.0 };
        let odds = match self.facing {
            Some(f) if !self.is_doubtful() && self.faces_away(pose) => f.odds(),
            _ => 1.0,
        };
        turn_cost * (1.0 + settings.against_facing * (odds - 1.0))
    }

    /// True for a pose more than a quarter turn from the facing.
    pub(crate) fn faces_away(&self, pose: &Pose) -> bool {
        let front = pose.root.iso().rotation * Vector3::z();
        self.facing
            .is_some_and(|f| front.dot(&f.front.cast()) < 0.0)
    }

    /// True where a hand or foot of `bones` is far from all its heavy proposals. A detected hand, `[left, right]`, is surer
    /// than its proposals.
    pub(crate) fn contradict(
        &self,
        model: &TrackerModel,
        bones: &BoneTransforms,
        is_detected: [bool; 2],
    ) -> bool {
        disputed_ends(&self.joints, model, bones, is_detected) > 0
    }

    /// Factor on the cost of a start, whose bones and detected hands are in the scratch: 1, and more for each hand and foot
    /// far from all its heavy proposals.
    pub(crate) fn dispute_cost(
        &self,
        model: &TrackerModel,
        pose: &Pose,
        scratch: &FitScratch,
    ) -> f64 {
        let is_detected = scratch.terms.hands.map(|h| h.is_some());
        let joints = self.joints_along(pose);
        let disputed = disputed_ends(joints, model, &scratch.bones, is_detected);
        1.0 + self.settings.disputed_cost * disputed as f64
    }

    /// Joints as seen, or exchanged for a pose that faces away from the facing.
    fn joints_along(&self, pose: &Pose) -> &JointProposals {
        if self.faces_away(pose) {
            &self.flipped
        } else {
            &self.joints
        }
    }

    /// The body at its proposed joints as seen, and in doubt of the facing otherwise; trunk by its joints or upright, each
    /// limb at the proposal of least cost.
    pub(crate) fn poses(&self, context: &FitContext<'_>, scratch: &mut FitScratch) -> Vec<Pose> {
        let mut out = Vec::new();
        for (joints, turn) in self.hypotheses() {
            let poses = proposed(context, joints);
            let upright = self.facing.map(|f| upright(&self.up, &f.front.cast()));
            let along = upright.and_then(|u| poses.trunk_along(u * about_body(turn)));
            for trunk in poses.trunk().into_iter().chain(along) {
                out.push(with_limbs(context, joints, &trunk, scratch).unwrap_or(trunk));
            }
        }
        out
    }

    /// True where the facing may be anything: half a body, a profile.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.facing
            .is_none_or(|f| f.confidence < self.settings.doubtful)
    }

    /// Joints as seen, and exchanged where the facing isn't sure, each with the turn of an upright trunk from the facing,
    /// radians.
    fn hypotheses(&self) -> impl Iterator<Item = (&JointProposals, f64)> {
        let is_sure = self
            .facing
            .is_some_and(|f| f.confidence > self.settings.sure);
        let flipped = (!is_sure).then_some((&self.flipped, PI));
        std::iter::once((&self.joints, 0.0)).chain(flipped)
    }

    /// A pose after a fit with its joints pulled to their proposals; `None` where it faces away from them. `scratch` with the
    /// pose's bones.
    pub(crate) fn pulled(
        &self,
        context: &FitContext<'_>,
        pose: &Pose,
        scratch: &mut FitScratch,
    ) -> Option<Pose> {
        let targets = self.joints.targets(context.model, scratch);
        if targets.is_empty() || self.faces_away(pose) {
            return None;
        }
        let fit = &context.model.config.fit;
        let schedule = Schedule {
            iterations: fit.seen_joints.iterations,
            ..fit.track
        };
        let mut pulled = pose.clone();
        scratch.with_targets(targets, |s| fit_pose(context, &mut pulled, &schedule, s));
        Some(pulled)
    }

    /// `pose` with each limb moved to its proposed place where that costs less; `None` where it nowhere does.
    pub(crate) fn limbs_of(
        &self,
        context: &FitContext<'_>,
        pose: &Pose,
        scratch: &mut FitScratch,
    ) -> Option<Pose> {
        with_limbs(context, self.joints_along(pose), pose, scratch)
    }
}

/// Number of hands and feet of `bones` that are far from all their heavy proposals, but detected hands.
fn disputed_ends(
    proposals: &JointProposals,
    model: &TrackerModel,
    bones: &BoneTransforms,
    is_detected: [bool; 2],
) -> usize {
    let settings = &model.config.start.proposals;
    let ends = [PartKind::Hand, PartKind::Foot].into_iter();
    let sides = [BodySide::Left, BodySide::Right];
    let ends = ends.flat_map(|kind| sides.map(|side| (kind, side)));
    let is_open = |(kind, side): &(PartKind, BodySide)| {
        *kind == PartKind::Foot || !is_detected[*side as usize]
    };
    let is_disputed = |class: &u8| {
        let is_heavy = proposals.of_class(*class).any(|(_, w)| w > settings.heavy);
        let Some(end) = model.part_classes.anchor_of(*class, &bones.joints) else {
            return false;
        };
        let is_far = |(p, _): (P3, f32)| (p.cast::<f64>() - end).norm() > settings.far;
        is_heavy && proposals.of_class(*class).all(is_far)
    };
    let classes = ends.filter(is_open).map(|(kind, side)| kind.class(side));
    classes.filter(is_disputed).count()
}

/// Rotation of an upright body with a given front, made level; one along the view is taken for the camera's −z.
pub(crate) fn upright(up: &Vector3<f64>, front: &Vector3<f64>) -> UnitQuaternion<f64> {
    let level = front - up * up.dot(front);
    let z = level
        .try_normalize(f64::EPSILON)
        .unwrap_or_else(|| -Vector3::z());
    let axes = Matrix3::from_columns(&[up.cross(&z), *up, z]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

/// Turn about the body's upright, radians.
pub(crate) fn about_body(turn: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn)
}

/// `pose` with each limb at its proposal of least cost, but arms whose hand is detected; `None` where all stay.
fn with_limbs(
    context: &FitContext<'_>,
    joints: &JointProposals,
    pose: &Pose,
    scratch: &mut FitScratch,
) -> Option<Pose> {
    let settings = &context.model.config.start.proposals;
    use BodyPart::*;
    let mut least = evaluate(context, pose, settings.reach, scratch).cost;
    let mut best = None;
    let [left, right] = scratch.terms.hands.map(|hand| hand.is_some());
    let arms = [(LeftArm, left), (RightArm, right)];
    let open = arms.into_iter().filter(|(_, is_detected)| !is_detected);
    for part in [LeftLeg, RightLeg].into_iter().chain(open.map(|a| a.0)) {
        let others = proposed(context, joints).limb_poses(best.as_ref().unwrap_or(pose), part);
        least *= settings.cheaper;
        for other in others {
            let cost = evaluate(context, &other, settings.reach, scratch).cost;
            if cost < least {
                (least, best) = (cost, Some(other));
            }
        }
    }
    best
}

fn proposed<'a>(context: &FitContext<'a>, proposals: &'a JointProposals) -> ProposedPoses<'a> {
    ProposedPoses {
        model: context.model,
        rest: &context.body.rest,
        proposals,
    }
}
