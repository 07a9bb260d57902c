//! Left and right of a person's joints: by the names, and by the way ahead that feet, knees and elbows show.

use super::hints;
use super::tree::JointTree;
use super::{HumanJoints, LimbChain};
use crate::parts::BodySide;
use nalgebra::{Point3, Vector3, center};

/// Shares of one frame's evidence that a joint's bend has against a foot's direction: knees and elbows bend one way only,
/// but little.
const BEND: f64 = 0.5;

/// Evidence that decides against names; feet of a standing person give 0.3.
const SURE: f64 = 0.1;
/// Evidence that decides without names; bends of nearly straight limbs give less.
const SEEN: f64 = 0.03;

/// Sum over frames of the evidence that the first limb of each pair is the left one.
#[derive(Clone, Copy, Debug, Default)]
pub struct SideEvidence {
    sum: f64,
    frames: usize,
}

impl SideEvidence {
    /// Adds joints' places in one pose.
    pub fn add(&mut self, joints: &HumanJoints, places: &[Point3<f64>]) {
        let middle =
            |pair: &[LimbChain; 2]| center(&places[pair[0].root()], &places[pair[1].root()]);
        let up = middle(&joints.arms) - middle(&joints.legs);
        let lateral = places[joints.legs[0].root()] - places[joints.legs[1].root()];
        // Ahead, if the first is left: x × y = z.
        let Some(ahead) = lateral.cross(&up).try_normalize(0.0) else {
            return;
        };
        self.frames += 1;
        self.sum += joints
            .legs
            .iter()
            .map(|leg| foot(leg, places, ahead) + BEND * bend(leg, places, ahead))
            .sum::<f64>();
        self.sum += joints
            .arms
            .iter()
            .map(|arm| -BEND * bend(arm, places, ahead))
            .sum::<f64>();
    }
    /// Evidence of a frame, about 0.3 for a standing person with feet; its sign decides.
    pub fn mean(&self) -> f64 {
        self.sum / self.frames.max(1) as f64
    }
}

/// Component ahead of the foot, over the leg's length.
fn foot(leg: &LimbChain, places: &[Point3<f64>], ahead: Vector3<f64>) -> f64 {
    let length = length(leg, places);
    leg.after_end().map_or(0.0, |toe| {
        (places[toe] - places[leg.end()]).dot(&ahead) / length
    })
}

/// Component ahead of the hinge from the line between the limb's ends, over its length.
fn bend(limb: &LimbChain, places: &[Point3<f64>], ahead: Vector3<f64>) -> f64 {
    let (root, hinge, end) = (
        places[limb.root()],
        places[limb.hinge()],
        places[limb.end()],
    );
    (hinge - center(&root, &end)).dot(&ahead) / length(limb, places)
}

fn length(limb: &LimbChain, places: &[Point3<f64>]) -> f64 {
    let (root, hinge, end) = (
        places[limb.root()],
        places[limb.hinge()],
        places[limb.end()],
    );
    ((hinge - root).norm() + (end - hinge).norm()).max(f64::MIN_POSITIVE)
}

/// Names' vote that the first of a pair is the left one: positive for left, negative for right, 0 for none.
fn vote(tree: &JointTree<'_>, pair: &[LimbChain; 2]) -> i32 {
    let of = |joint: &usize| match hints::side(tree.name(*joint)) {
        Some(BodySide::Left) => 1,
        Some(BodySide::Right) => -1,
        None => 0,
    };
    let votes = |limb: &LimbChain| limb.chain.iter().map(of).sum::<i32>().signum();
    (votes(&pair[0]) - votes(&pair[1])).signum()
}

/// True if the first arm is on the side of the first leg in this pose.
pub(super) fn is_same_side(joints: &HumanJoints, places: &[Point3<f64>]) -> bool {
    let lateral = |pair: &[LimbChain; 2]| places[pair[0].root()] - places[pair[1].root()];
    lateral(&joints.arms).dot(&lateral(&joints.legs)) >= 0.0
}

/// Basis of the decision between left and right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SideBasis {
    /// The way ahead and the names agree.
    Both,
    /// The way ahead; the joints name no sides.
    Ahead,
    /// The names; the pose shows no way ahead.
    Names,
    /// The way ahead; the names say the opposite.
    AgainstNames,
}

impl HumanJoints {
    /// The same, with the left leg and arm first. `evidence`: [`SideEvidence::mean`].
    ///
    /// # Errors
    /// When neither the way ahead nor the names tell left from right.
    pub fn sided(
        mut self,
        tree: &JointTree<'_>,
        evidence: f64,
    ) -> Result<(Self, SideBasis), String> {
        let names = (vote(tree, &self.legs) + vote(tree, &self.arms)).signum();
        let is_sure = evidence.abs() > SURE;
        let (first_is_left, basis) = match names {
            0 if evidence.abs() > SEEN => (evidence > 0.0, SideBasis::Ahead),
            0 => {
                return Err("neither feet, knees and elbows nor names tell left from right".into());
            }
            _ if !is_sure => (names > 0, SideBasis::Names),
            _ if (evidence > 0.0) == (names > 0) => (names > 0, SideBasis::Both),
            _ => (evidence > 0.0, SideBasis::AgainstNames),
        };
        if !first_is_left {
            self.legs.swap(0, 1);
            self.arms.swap(0, 1);
        }
        Ok((self, basis))
    }
}
