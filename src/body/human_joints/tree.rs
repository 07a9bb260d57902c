//! A tree of joints with places, and maybe names, as files have them.

use nalgebra::Point3;

/// Joints of a file in any unit and frame. Shapes `[joints]`; parents come first.
#[derive(Clone, Copy, Debug)]
pub struct JointTree<'a> {
    /// Parent of each joint, `None` for a root.
    pub parents: &'a [Option<usize>],
    /// Places in one pose, any pose: lengths decide.
    pub places: &'a [Point3<f64>],
    /// Names; empty if the file has none.
    pub names: &'a [String],
}

impl JointTree<'_> {
    /// Number of joints.
    pub(super) fn len(&self) -> usize {
        self.parents.len().min(self.places.len())
    }
    /// Name of a joint; empty without.
    pub(super) fn name(&self, joint: usize) -> &str {
        self.names.get(joint).map_or("", String::as_str)
    }
    /// Distance from the parent; 0 for a root.
    pub(super) fn bone(&self, joint: usize) -> f64 {
        self.parents[joint].map_or(0.0, |p| (self.places[joint] - self.places[p]).norm())
    }
    /// `ancestor` is `joint` or above it.
    pub(crate) fn is_above(&self, ancestor: usize, joint: usize) -> bool {
        let mut at = Some(joint);
        while let Some(k) = at {
            if k == ancestor {
                return true;
            }
            at = self.parents[k];
        }
        false
    }
    /// Joints from `from` (exclusive) down to `to` (inclusive); empty unless `from` is above.
    pub(super) fn way(&self, from: usize, to: usize) -> Vec<usize> {
        let mut out = Vec::new();
        let mut at = to;
        while at != from {
            out.push(at);
            match self.parents[at] {
                Some(parent) => at = parent,
                None => return Vec::new(),
            }
        }
        out.reverse();
        out
    }
    /// Length of the way between two joints, over their nearest common ancestor.
    pub(super) fn distance(&self, a: usize, b: usize) -> f64 {
        let mut common = a;
        while !self.is_above(common, b) {
            match self.parents[common] {
                Some(parent) => common = parent,
                None => return (self.places[a] - self.places[b]).norm(),
            }
        }
        let along = |to| {
            self.way(common, to)
                .iter()
                .map(|j| self.bone(*j))
                .sum::<f64>()
        };
        along(a) + along(b)
    }
}

/// A tree with its children and the longest way down from each joint.
#[derive(Debug)]
pub(super) struct Branches<'a> {
    pub(super) tree: &'a JointTree<'a>,
    /// Shape `[joints]`.
    pub(super) children: Vec<Vec<usize>>,
    /// Length of the longest way down, shape `[joints]`.
    pub(super) depths: Vec<f64>,
}

impl<'a> Branches<'a> {
    pub(super) fn new(tree: &'a JointTree<'a>) -> Self {
        let mut children = vec![Vec::new(); tree.len()];
        let mut depths = vec![0.0f64; tree.len()];
        for joint in (0..tree.len()).rev() {
            if let Some(parent) = tree.parents[joint] {
                children[parent].insert(0, joint);
                depths[parent] = depths[parent].max(depths[joint] + tree.bone(joint));
            }
        }
        Self {
            tree,
            children,
            depths,
        }
    }
    /// Length of the longest way down, from the parent of `joint` on.
    pub(super) fn reach(&self, joint: usize) -> f64 {
        self.depths[joint] + self.tree.bone(joint)
    }
    /// Joints of the longest way down, `start` included.
    pub(super) fn longest(&self, start: usize) -> Vec<usize> {
        let mut out = vec![start];
        let mut at = start;
        let farther =
            |a: &usize, b: &usize| self.reach(*a).total_cmp(&self.reach(*b)).then(b.cmp(a));
        while let Some(next) = self.children[at].iter().copied().max_by(farther) {
            out.push(next);
            at = next;
        }
        out
    }
}
