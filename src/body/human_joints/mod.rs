//! A person's joints in a tree of any rig: two pairs of like chains are the legs and the arms, by their lengths; the rest
//! between them is the trunk. Names settle ties.

mod hints;
mod limb;
mod sides;
mod tree;

pub use limb::LimbChain;
pub use sides::{SideBasis, SideEvidence};
pub use tree::JointTree;

use limb::{ARM, LEG, fit};
use tree::Branches;

/// Logarithm of the ratio of two limbs' lengths up to which they are a pair: real skeletons differ by a few per cent.
const UNLIKE: f64 = 0.12;
/// Length of a limb over the longest way in the tree, at least.
const SHORTEST: f64 = 0.2;
/// Arms over legs (shoulder to wrist, hip to ankle), and standard deviation of its logarithm (Drillis and Contini 1966).
const ARM_TO_LEG: [f64; 2] = [0.68, 0.15];
/// Trunk over legs, and standard deviation of its logarithm.
const TRUNK_TO_LEG: [f64; 2] = [0.6, 0.4];
/// Cost of a tree in which the arms are not below the legs' joint, and of one without a head.
const MISPLACED: f64 = 2.0;
/// Pairs of one kind that are tried, the best first; rigs of people have three.
const MOST_PAIRS: usize = 32;
/// Cost from which on no person is found: three standard deviations in four ratios.
const MOST: f64 = 18.0;

/// A person's joints, as indices into a tree. The first of each pair is on one side, left or right, until
/// [`HumanJoints::sided`].
#[derive(Clone, Debug, PartialEq)]
pub struct HumanJoints {
    /// Joint that legs and spine hang from.
    pub pelvis: usize,
    /// From the pelvis (exclusive) to the joint that the arms hang from, and on to the neck (exclusive).
    pub spine: Vec<usize>,
    /// First joint of the chain that ends in the head, if it has more than one.
    pub neck: Option<usize>,
    /// Joint of the head.
    pub head: Option<usize>,
    /// Top of the head: an end point in line with it.
    pub head_top: Option<usize>,
    /// Legs.
    pub legs: [LimbChain; 2],
    /// Arms.
    pub arms: [LimbChain; 2],
}

/// Two like chains that hang from one joint.
struct LimbPair {
    parent: usize,
    limbs: [LimbChain; 2],
}

impl LimbPair {
    fn cost(&self) -> f64 {
        0.5 * (self.limbs[0].cost + self.limbs[1].cost)
    }
    fn length(&self, tree: &JointTree<'_>) -> f64 {
        0.5 * (self.limbs[0].length(tree) + self.limbs[1].length(tree))
    }
    fn is_apart(&self, other: &Self, tree: &JointTree<'_>) -> bool {
        let starts = |pair: &Self| [pair.limbs[0].chain[0], pair.limbs[1].chain[0]];
        let (own, others) = (starts(self), starts(other));
        let nested = |a: usize, b: usize| tree.is_above(a, b) || tree.is_above(b, a);
        own.iter().all(|a| others.iter().all(|b| !nested(*a, *b)))
    }
}

fn deviation(value: f64, [mean, deviation]: [f64; 2]) -> f64 {
    0.5 * ((value / mean).ln() / deviation).powi(2)
}

impl HumanJoints {
    /// Finds the joints of a person.
    ///
    /// # Errors
    /// The limb that is missing, in words.
    pub fn find(tree: &JointTree<'_>) -> Result<Self, String> {
        let branches = Branches::new(tree);
        let legs = pairs(&branches, &LEG);
        let arms = pairs(&branches, &ARM);
        let mut best: Option<(f64, &LimbPair, &LimbPair)> = None;
        for leg in &legs {
            for arm in arms.iter().filter(|arm| arm.is_apart(leg, tree)) {
                let cost = body_cost(&branches, leg, arm);
                if best.as_ref().is_none_or(|b| cost < b.0) {
                    best = Some((cost, leg, arm));
                }
            }
        }
        let wanted = "expected two legs (hip, knee, ankle) and two arms (shoulder, elbow, wrist), each pair of like lengths on one joint";
        let (cost, legs, arms) = best.ok_or_else(|| {
            let found = legs.len();
            format!(
                "no person in {} joints: {found} pairs of like chains; {wanted}",
                tree.len()
            )
        })?;
        if cost > MOST {
            return Err(format!(
                "no person in {} joints: the nearest is {cost:.0} off in proportions (at most {MOST}); {wanted}",
                tree.len()
            ));
        }
        Ok(Self::between(&branches, legs, arms))
    }

    /// The joints between legs and arms, and the head.
    fn between(branches: &Branches<'_>, legs: &LimbPair, arms: &LimbPair) -> Self {
        let tree = branches.tree;
        let head = head_chain(branches, legs, arms);
        let mut spine = tree.way(legs.parent, arms.parent);
        if let Some(start) = head.first() {
            let from = tree.parents[*start].unwrap_or(arms.parent);
            spine.extend(tree.way(arms.parent, from));
        }
        let skull = skull(branches, &head);
        let neck = head.first().copied().filter(|_| skull > 0);
        let top = head.get(skull + 1..).and_then(<[usize]>::last).copied();
        let is_top =
            |joint: &usize| branches.children[*joint].is_empty() && head.len() == skull + 2;
        let mut out = Self {
            pelvis: legs.parent,
            spine,
            neck,
            head: head.get(skull).copied(),
            head_top: top.filter(is_top),
            legs: legs.limbs.clone(),
            arms: arms.limbs.clone(),
        };
        if !sides::is_same_side(&out, tree.places) {
            out.arms.swap(0, 1);
        }
        out
    }
}

/// Pairs of like chains with a common parent, the best first.
fn pairs(branches: &Branches<'_>, kind: &limb::LimbKind) -> Vec<LimbPair> {
    let longest = branches.depths.iter().copied().fold(0.0, f64::max);
    let is_long = |c: &&usize| branches.reach(**c) > SHORTEST * longest;
    let mut out = Vec::new();
    for (parent, children) in branches.children.iter().enumerate() {
        let limbs: Vec<LimbChain> = children
            .iter()
            .filter(is_long)
            .filter_map(|c| fit(branches, *c, kind))
            .collect();
        for (i, a) in limbs.iter().enumerate() {
            for b in &limbs[i + 1..] {
                let [p, q] = [a, b].map(|limb| limb.length(branches.tree));
                if (p / q).ln().abs() < UNLIKE {
                    let limbs = [a.clone(), b.clone()];
                    out.push(LimbPair { parent, limbs });
                }
            }
        }
    }
    out.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    out.truncate(MOST_PAIRS);
    out
}

fn body_cost(branches: &Branches<'_>, legs: &LimbPair, arms: &LimbPair) -> f64 {
    let tree = branches.tree;
    let leg = legs.length(tree);
    let trunk = tree.distance(legs.parent, arms.parent).max(1e-3 * leg);
    let is_below = tree.is_above(legs.parent, arms.parent);
    let has_head = !head_chain(branches, legs, arms).is_empty();
    legs.cost()
        + arms.cost()
        + deviation(arms.length(tree) / leg, ARM_TO_LEG)
        + deviation(trunk / leg, TRUNK_TO_LEG)
        + if is_below { 0.0 } else { MISPLACED }
        + if has_head { 0.0 } else { MISPLACED }
}

/// The longest chain without a limb that hangs from the arms' joint, or from the nearest one below the pelvis that has one.
fn head_chain(branches: &Branches<'_>, legs: &LimbPair, arms: &LimbPair) -> Vec<usize> {
    let tree = branches.tree;
    let limbs = [&legs.limbs, &arms.limbs];
    let is_limb = |joint: usize| {
        let mut starts = limbs
            .iter()
            .flat_map(|pair| pair.iter().map(|l| l.chain[0]));
        starts.any(|s| tree.is_above(joint, s))
    };
    let mut at = Some(arms.parent);
    while let Some(joint) = at {
        let free = branches.children[joint]
            .iter()
            .copied()
            .filter(|c| !is_limb(*c));
        let hinted = |c: &usize| {
            let hint = hints::joint(tree.name(*c));
            matches!(hint, Some(hints::JointHint::Neck | hints::JointHint::Head))
        };
        let farther = |a: &usize, b: &usize| {
            (hinted(a).cmp(&hinted(b))).then(branches.reach(*a).total_cmp(&branches.reach(*b)))
        };
        if let Some(start) = free.max_by(farther) {
            return branches.longest(start);
        }
        at = tree.parents[joint].filter(|_| joint != legs.parent);
    }
    Vec::new()
}

/// Place of the skull's joint in the chain from neck to the top of the head: named so, the first that branches (jaw and eyes),
/// the one before an end point, or the last.
fn skull(branches: &Branches<'_>, chain: &[usize]) -> usize {
    let tree = branches.tree;
    let named = chain
        .iter()
        .position(|j| hints::joint(tree.name(*j)) == Some(hints::JointHint::Head));
    let branching = chain.iter().position(|j| branches.children[*j].len() > 1);
    let is_end = |j: &usize| {
        let name = tree.name(*j).to_ascii_lowercase();
        ["nub", "site", "top", "tip", "end"]
            .iter()
            .any(|e| name.ends_with(e))
    };
    let last = chain.len().saturating_sub(1);
    let before_end = chain
        .last()
        .filter(|j| is_end(j))
        .map(|_| last.saturating_sub(1));
    named.or(branching).or(before_end).unwrap_or(last)
}

#[cfg(test)]
mod tests;
