//! Classes of body parts: from the vertices of a template, and back to its joints.

use crate::segment::part_network::CLASSES;
use tryon_body::Template;
use tryon_body::parts::{BodyPart, BodySegment, BodySide};
use tryon_geometry::math::P3d;

/// Number of classes: thirteen pairs and the neck.
pub const PART_CLASSES: usize = CLASSES;
/// The neck's class; of all others the even ones are left, the odd ones right.
pub const NECK_CLASS: u8 = 26;

/// Kind of a paired class, in the order of the classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// Half of the head.
    Head,
    /// About the shoulder joint.
    Shoulder,
    /// Between shoulder and elbow.
    UpperArm,
    /// About the elbow.
    Elbow,
    /// Between elbow and wrist.
    Forearm,
    /// From the wrist on.
    Hand,
    /// Half of the upper trunk.
    Chest,
    /// Half of the lower trunk.
    Belly,
    /// About the hip joint.
    Hip,
    /// Between hip and knee.
    Thigh,
    /// About the knee.
    Knee,
    /// Between knee and ankle.
    Shank,
    /// From the ankle on.
    Foot,
}

impl PartKind {
    /// All of them, in the order of the classes.
    pub const ALL: [Self; 13] = [
        Self::Head,
        Self::Shoulder,
        Self::UpperArm,
        Self::Elbow,
        Self::Forearm,
        Self::Hand,
        Self::Chest,
        Self::Belly,
        Self::Hip,
        Self::Thigh,
        Self::Knee,
        Self::Shank,
        Self::Foot,
    ];
    /// Class of this kind on one side.
    pub const fn class(self, side: BodySide) -> u8 {
        2 * self as u8 + side as u8
    }
}

/// Kind and side of a class; `None` for the neck and for numbers that are no class.
pub fn kind_of(class: u8) -> Option<(PartKind, BodySide)> {
    let kind = PartKind::ALL.get(usize::from(class) / 2)?;
    let side = if class.is_multiple_of(2) {
        BodySide::Left
    } else {
        BodySide::Right
    };
    Some((*kind, side))
}

/// Name of a class, for tables.
pub fn class_name(class: u8) -> String {
    match kind_of(class) {
        Some((kind, side)) => format!("{side:?} {kind:?}").to_lowercase(),
        None => "neck".into(),
    }
}

/// Share of a bone from its near end within which the skin belongs to that joint, and to the far one.
const NEAR_JOINT: [f64; 2] = [0.25, 0.80];
/// Distance from shoulder or hip within which skin of the trunk belongs to that joint, metres.
const GIRDLE: f64 = 0.10;
/// Height of the border between chest and belly, as a share of the way from the pelvis to the neck.
const WAIST: f64 = 0.45;

/// Classes of one template.
#[derive(Clone, Debug, PartialEq)]
pub struct PartClasses {
    of_vertex: Vec<u8>,
    anchors: Vec<Option<[usize; 2]>>,
}

/// Rest geometry that the classes of vertices depend on.
struct RestLandmarks<'a> {
    template: &'a Template,
    rest: Vec<P3d>,
    pelvis: P3d,
    neck: P3d,
}

/// Share of the way from `a` to `b` of the foot of a point's perpendicular.
fn along(p: &P3d, a: &P3d, b: &P3d) -> f64 {
    let d = b - a;
    (p - a).dot(&d) / d.norm_squared().max(f64::MIN_POSITIVE)
}

impl RestLandmarks<'_> {
    /// Class of a vertex whose dominant joint is `joint`.
    fn class(&self, joint: usize, p: &P3d) -> u8 {
        use BodySegment::*;
        let parts = self.template.parts();
        let (segment, own) = (parts.segment(joint), parts.side(joint));
        let half = if p.x >= self.pelvis.x {
            BodySide::Left
        } else {
            BodySide::Right
        };
        let side = own.unwrap_or(half);
        let share = |from: BodySegment, to: BodySegment| match (
            parts.joint(from, Some(side)),
            parts.joint(to, Some(side)),
        ) {
            (Some(a), Some(b)) => along(p, &self.rest[a], &self.rest[b]),
            _ => 0.5,
        };
        let between = |t: f64, kinds: [PartKind; 3]| {
            if t < NEAR_JOINT[0] {
                kinds[0]
            } else if t < NEAR_JOINT[1] {
                kinds[1]
            } else {
                kinds[2]
            }
        };
        let kind = match segment {
            Neck => return NECK_CLASS,
            Head => PartKind::Head,
            UpperArm => {
                let kinds = [PartKind::Shoulder, PartKind::UpperArm, PartKind::Elbow];
                between(share(UpperArm, Forearm), kinds)
            }
            Forearm => {
                let kinds = [PartKind::Elbow, PartKind::Forearm, PartKind::Forearm];
                between(share(Forearm, Hand), kinds)
            }
            Hand | Fingers => PartKind::Hand,
            Thigh => {
                let kinds = [PartKind::Hip, PartKind::Thigh, PartKind::Knee];
                between(share(Thigh, Shin), kinds)
            }
            Shin => {
                let kinds = [PartKind::Knee, PartKind::Shank, PartKind::Shank];
                between(share(Shin, Foot), kinds)
            }
            Foot | Toes => PartKind::Foot,
            Pelvis | Abdomen | Chest | Collar => return self.trunk(p, half),
        };
        kind.class(side)
    }

    /// Class of a vertex of the trunk.
    fn trunk(&self, p: &P3d, side: BodySide) -> u8 {
        let parts = self.template.parts();
        let near = |segment: BodySegment| {
            let joint = parts.joint(segment, Some(side));
            joint.is_some_and(|j| (self.rest[j] - p).norm() < GIRDLE)
        };
        let kind = if near(BodySegment::UpperArm) {
            PartKind::Shoulder
        } else if near(BodySegment::Thigh) {
            PartKind::Hip
        } else if along(p, &self.pelvis, &self.neck) > WAIST {
            PartKind::Chest
        } else {
            PartKind::Belly
        };
        kind.class(side)
    }
}

impl PartClasses {
    /// Classifies the vertices and joints of a template in its rest pose.
    pub fn new(template: &Template) -> Self {
        let joints = template.skeleton().joints();
        let rest: Vec<P3d> = joints.iter().map(|j| j.rest).collect();
        let parts = template.parts();
        let neck = parts.joint(BodySegment::Neck, None).unwrap_or(0);
        let landmarks = RestLandmarks {
            template,
            pelvis: rest[0],
            neck: rest[neck],
            rest,
        };
        let vertices = template.mesh().vertices().iter().enumerate();
        let class = |(v, p): (usize, &tryon_geometry::math::P3)| {
            landmarks.class(template.weights().dominant(v), &p.cast::<f64>())
        };
        let of_vertex = vertices.map(class).collect();
        let anchors = (0..PART_CLASSES as u8).map(|c| anchor(template, c));
        Self {
            of_vertex,
            anchors: anchors.collect(),
        }
    }
    /// Class of each vertex, shape `[vertices]`.
    pub fn of_vertex(&self) -> &[u8] {
        &self.of_vertex
    }
    /// The two joints (often the same one twice) in whose middle a class has its anchor; `None` for a skeleton without
    /// them.
    pub fn anchor(&self, class: u8) -> Option<[usize; 2]> {
        self.anchors.get(usize::from(class)).copied().flatten()
    }
    /// Place of a class's anchor for the posed joints, in their frame, metres.
    pub fn anchor_of(&self, class: u8, joints: &[P3d]) -> Option<P3d> {
        let [a, b] = self.anchor(class)?;
        Some(nalgebra::center(joints.get(a)?, joints.get(b)?))
    }
}

/// Joints of a class's anchor. The hand's is the middle of wrist and fingertips, the head's the middle of the skull.
fn anchor(template: &Template, class: u8) -> Option<[usize; 2]> {
    let parts = template.parts();
    let middle = |segment: BodySegment| parts.joint(segment, None);
    let Some((kind, side)) = kind_of(class) else {
        return middle(BodySegment::Neck).map(|j| [j, j]);
    };
    let limb = |arm: bool| match (arm, side) {
        (true, BodySide::Left) => parts.limb(BodyPart::LeftArm),
        (true, BodySide::Right) => parts.limb(BodyPart::RightArm),
        (false, BodySide::Left) => parts.limb(BodyPart::LeftLeg),
        (false, BodySide::Right) => parts.limb(BodyPart::RightLeg),
    };
    let head_end = || {
        let joints = 0..template.skeleton().len();
        joints
            .rev()
            .find(|j| parts.segment(*j) == BodySegment::Head)
    };
    let (arm, leg) = (limb(true), limb(false));
    Some(match kind {
        PartKind::Head => [middle(BodySegment::Head)?, head_end()?],
        PartKind::Shoulder => [arm?.root; 2],
        PartKind::UpperArm => [arm?.root, arm?.hinge],
        PartKind::Elbow => [arm?.hinge; 2],
        PartKind::Forearm => [arm?.hinge, arm?.end],
        PartKind::Hand => [arm?.end, arm?.tip],
        PartKind::Chest => [arm?.root, middle(BodySegment::Chest)?],
        PartKind::Belly => [leg?.root, middle(BodySegment::Chest)?],
        PartKind::Hip => [leg?.root; 2],
        PartKind::Thigh => [leg?.root, leg?.hinge],
        PartKind::Knee => [leg?.hinge; 2],
        PartKind::Shank => [leg?.hinge, leg?.end],
        PartKind::Foot => [leg?.end; 2],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn classes_of_the_embedded_body_mirror_each_other() {
        let template = embedded::template();
        let classes = PartClasses::new(&template);
        let mut counts = [0usize; PART_CLASSES];
        for c in classes.of_vertex() {
            counts[usize::from(*c)] += 1;
        }
        for pair in counts[..26].chunks_exact(2) {
            // Vertices in the middle are all on one side.
            assert!(
                pair[1] > 50 && pair[0].abs_diff(pair[1]) < 200,
                "{counts:?}"
            );
        }
        assert!(counts[26] > 50);
        let name = |j: usize| template.skeleton().joints()[j].name.as_str();
        let anchor = |k: PartKind| {
            let joints = classes.anchor(k.class(BodySide::Right));
            joints.map(|a| a.map(name))
        };
        assert_eq!(anchor(PartKind::Knee), Some(["right_knee"; 2]));
        assert_eq!(
            anchor(PartKind::Hand),
            Some(["right_wrist", "right_hand_end"])
        );
        assert_eq!(anchor(PartKind::Head), Some(["head", "head_end"]));
        assert_eq!(
            class_name(PartKind::Foot.class(BodySide::Right)),
            "right foot"
        );
        assert_eq!(
            (class_name(NECK_CLASS).as_str(), kind_of(27)),
            ("neck", None)
        );
    }
}
