//! Shoulder, elbow and wrist, or hip, knee and ankle, on the chain of a limb: by the lengths between them.
//!
//! Each choice costs half the squared deviations of its log ratios from those of people, in standard deviations; names
//! that say the same are worth [`HINT`]. Ratios after Drillis and Contini 1966; deviations wide enough for cartoons.

use super::hints::{self, JointHint};
use super::tree::{Branches, JointTree};

/// Cost of a name that says another joint; one that says this joint gains as much.
const HINT: f64 = 1.5;
/// Gain of a wrist with fingers.
const FINGERS: f64 = 1.5;

/// Standard deviation of the way along a segment over its chord: twist bones lie in line in every pose.
const CROOKED: f64 = 0.03;
/// Distance of a joint of hand or foot from the wrist or ankle, over both segments, at least.
const APART: f64 = 0.03;
/// Joints of a chain that are tried; fingers end after a dozen.
const MOST: usize = 24;

/// Proportions of one kind of limb.
#[derive(Debug)]
pub(super) struct LimbKind {
    hints: [JointHint; 3],
    /// Lower over upper segment, and standard deviation of its logarithm.
    lower: [f64; 2],
    /// Hand or foot over both segments, and standard deviation.
    distal: [f64; 2],
    /// From the trunk's joint to the limb's root over both segments, and standard deviation.
    proximal: [f64; 2],
    has_fingers: bool,
}

pub(super) const ARM: LimbKind = LimbKind {
    hints: [JointHint::Shoulder, JointHint::Elbow, JointHint::Wrist],
    lower: [0.9, 0.2],
    distal: [0.25, 0.15],
    proximal: [0.5, 0.35],
    has_fingers: true,
};
pub(super) const LEG: LimbKind = LimbKind {
    hints: [JointHint::Hip, JointHint::Knee, JointHint::Ankle],
    lower: [1.0, 0.12],
    distal: [0.22, 0.12],
    proximal: [0.15, 0.15],
    has_fingers: false,
};

/// Joints of one limb.
#[derive(Clone, Debug, PartialEq)]
pub struct LimbChain {
    /// From the trunk's child to the farthest tip.
    pub chain: Vec<usize>,
    /// Places in the chain of shoulder, elbow and wrist, or hip, knee and ankle.
    at: [usize; 3],
    after_end: Option<usize>,
    pub(super) cost: f64,
}

impl LimbChain {
    /// Shoulder or hip.
    pub fn root(&self) -> usize {
        self.chain[self.at[0]]
    }
    /// Elbow or knee.
    pub fn hinge(&self) -> usize {
        self.chain[self.at[1]]
    }
    /// Wrist or ankle.
    pub fn end(&self) -> usize {
        self.chain[self.at[2]]
    }
    /// First joint away from the wrist or ankle towards the farthest tip; auxiliary joints lie on it.
    pub fn after_end(&self) -> Option<usize> {
        self.after_end
    }
    /// Joints before the shoulder or hip.
    pub fn before_root(&self) -> &[usize] {
        &self.chain[..self.at[0]]
    }
    /// Length of both segments, in the file's unit.
    pub(super) fn length(&self, tree: &JointTree<'_>) -> f64 {
        tree.distance(self.root(), self.end())
    }
}

fn deviation(value: f64, [mean, deviation]: [f64; 2]) -> f64 {
    0.5 * ((value - mean) / deviation).powi(2)
}

/// Hints of a chain's names. Of joints that say the same the first is meant: `lwrist` before `lhand`, `upperleg01` before
/// `upperleg02`.
fn hints_along(tree: &JointTree<'_>, chain: &[usize]) -> Vec<Option<JointHint>> {
    let mut out: Vec<Option<JointHint>> = Vec::with_capacity(chain.len());
    for joint in chain {
        let said = hints::joint(tree.name(*joint));
        let is_repeated = said.is_some() && out.contains(&said);
        out.push(if is_repeated {
            Some(JointHint::Twist)
        } else {
            said
        });
    }
    out
}

/// The cheapest choice of three joints on the limb that hangs from `start`; `None` for chains of fewer joints.
pub(super) fn fit(branches: &Branches<'_>, start: usize, kind: &LimbKind) -> Option<LimbChain> {
    let (tree, children) = (branches.tree, &branches.children);
    let chain = branches.longest(start);
    let mut along = Vec::with_capacity(chain.len());
    let mut sum = 0.0;
    for joint in &chain {
        sum += tree.bone(*joint);
        along.push(sum);
    }
    let hint = hints_along(tree, &chain);
    let has_fingers = |place: usize| {
        children[chain[place]]
            .iter()
            .filter(|c| !children[**c].is_empty())
            .count()
            >= 3
    };
    let cost = |at: [usize; 3]| {
        let [root, hinge, end] = at.map(|k| along[k]);
        let (upper, lower) = (hinge - root, end - hinge);
        if upper.min(lower) <= 1e-3 * sum {
            return f64::INFINITY;
        }
        let both = upper + lower;
        let named = at.iter().zip(kind.hints).map(|(k, wanted)| match hint[*k] {
            Some(said) if said == wanted => -HINT,
            Some(_) => HINT,
            None => 0.0,
        });
        let fingers = if kind.has_fingers && has_fingers(at[2]) {
            FINGERS
        } else {
            0.0
        };
        let [mean, spread] = kind.lower;
        let chord = |a: usize, b: usize| (tree.places[chain[b]] - tree.places[chain[a]]).norm();
        deviation((lower / upper / mean).ln(), [0.0, spread])
            + deviation(1.0 - chord(at[0], at[1]) / upper, [0.0, CROOKED])
            + deviation(1.0 - chord(at[1], at[2]) / lower, [0.0, CROOKED])
            + deviation((sum - end) / both, kind.distal)
            + deviation(root / both, kind.proximal)
            + named.sum::<f64>()
            - fingers
    };
    let n = chain.len().min(MOST);
    let choices =
        (0..n).flat_map(|a| (a + 1..n).flat_map(move |b| (b + 1..n).map(move |c| [a, b, c])));
    let best = choices
        .map(|at| (at, cost(at)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let ([root, _, end], cost) = best;
    let beyond = along[end] + APART * (along[end] - along[root]);
    let after_end = (end + 1..chain.len()).find(|k| along[*k] > beyond);
    cost.is_finite().then(|| LimbChain {
        after_end: after_end.map(|k| chain[k]),
        chain,
        at: best.0,
        cost,
    })
}
