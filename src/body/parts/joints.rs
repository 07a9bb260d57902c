//! Segments, sides, parts and limbs of the joints: the only reader of joint names.

use crate::Skeleton;

/// Side of the subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodySide {
    /// The subject's left, +x.
    Left,
    /// The subject's right, −x.
    Right,
}

/// Segment of the body that one joint moves, in the terms of biomechanics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodySegment {
    /// Moved by the root.
    Pelvis,
    /// Moved by the lowest joint of the spine.
    Abdomen,
    /// Moved by the upper joints of the spine.
    Chest,
    /// Moved by the base of the neck.
    Neck,
    /// Moved by the base of the skull.
    Head,
    /// Moved by the collar bone.
    Collar,
    /// Moved by the shoulder.
    UpperArm,
    /// Moved by the elbow.
    Forearm,
    /// Moved by the wrist.
    Hand,
    /// Moved by joints of the hand, end point included.
    Fingers,
    /// Moved by the hip.
    Thigh,
    /// Moved by the knee.
    Shin,
    /// Moved by the ankle.
    Foot,
    /// Moved by the ball of the foot, end point included.
    Toes,
}

/// Part of the body that moves by itself: the trunk with the head, or a limb from its ball joint on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyPart {
    /// Pelvis, spine, collars, neck and head.
    Trunk,
    /// Left upper arm to finger tips.
    LeftArm,
    /// Right upper arm to finger tips.
    RightArm,
    /// Left thigh to toes.
    LeftLeg,
    /// Right thigh to toes.
    RightLeg,
}

/// Joints of one limb.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LimbJoints {
    /// Shoulder or hip.
    pub root: usize,
    /// Elbow or knee.
    pub hinge: usize,
    /// Wrist or ankle.
    pub end: usize,
    /// End point of the hand, or ball of the foot; `end` for a skeleton without.
    pub tip: usize,
}

/// Words of a joint's name and the segment it moves, tried in this order (SMPL's names, and common others).
const NAMES: [(&str, BodySegment); 25] = [
    ("index", BodySegment::Fingers),
    ("middle", BodySegment::Fingers),
    ("ring", BodySegment::Fingers),
    ("pinky", BodySegment::Fingers),
    ("finger", BodySegment::Fingers),
    ("thumb", BodySegment::Fingers),
    ("hand", BodySegment::Fingers),
    ("wrist", BodySegment::Hand),
    ("elbow", BodySegment::Forearm),
    ("forearm", BodySegment::Forearm),
    ("shoulder", BodySegment::UpperArm),
    ("arm", BodySegment::UpperArm),
    ("toe", BodySegment::Toes),
    ("foot", BodySegment::Toes),
    ("ankle", BodySegment::Foot),
    ("knee", BodySegment::Shin),
    ("hip", BodySegment::Thigh),
    ("leg", BodySegment::Thigh),
    ("head", BodySegment::Head),
    ("jaw", BodySegment::Head),
    ("neck", BodySegment::Neck),
    ("collar", BodySegment::Collar),
    ("spine1", BodySegment::Abdomen),
    ("spine", BodySegment::Chest),
    ("pelvis", BodySegment::Pelvis),
];

impl BodySegment {
    /// Segment moved by a joint of this name.
    fn of_joint(name: &str) -> Option<Self> {
        NAMES
            .iter()
            .find(|(word, _)| name.contains(word))
            .map(|(_, s)| *s)
    }
    /// Belongs to an arm.
    pub fn is_arm(self) -> bool {
        use BodySegment::*;
        matches!(self, UpperArm | Forearm | Hand | Fingers)
    }
    /// Belongs to a leg.
    pub fn is_leg(self) -> bool {
        use BodySegment::*;
        matches!(self, Thigh | Shin | Foot | Toes)
    }
    /// Is a limb's segment beyond its hinge, with cloth on one side only where it touches the body.
    pub fn is_thin(self) -> bool {
        use BodySegment::*;
        matches!(self, Forearm | Hand | Fingers | Shin | Foot | Toes)
    }
    /// Is bare in most clothes: head, hand or foot.
    pub fn is_extremity(self) -> bool {
        use BodySegment::*;
        matches!(self, Head | Hand | Fingers | Foot | Toes)
    }
}

impl BodyPart {
    /// All of them, in the order of their bits.
    pub const ALL: [Self; 5] = [
        Self::Trunk,
        Self::LeftArm,
        Self::RightArm,
        Self::LeftLeg,
        Self::RightLeg,
    ];

    /// Name in reports and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trunk => "trunk",
            Self::LeftArm => "left arm",
            Self::RightArm => "right arm",
            Self::LeftLeg => "left leg",
            Self::RightLeg => "right leg",
        }
    }

    /// The arm or leg of one side, or the trunk, that a segment belongs to.
    fn of(segment: BodySegment, side: Option<BodySide>) -> Self {
        match (segment, side) {
            (s, Some(BodySide::Left)) if s.is_arm() => Self::LeftArm,
            (s, _) if s.is_arm() => Self::RightArm,
            (s, Some(BodySide::Left)) if s.is_leg() => Self::LeftLeg,
            (s, _) if s.is_leg() => Self::RightLeg,
            _ => Self::Trunk,
        }
    }
    /// Mask with this part only, as in `garment::Region`.
    pub const fn mask(self) -> u8 {
        1 << self as u8
    }
}

/// Segment and side of each joint of a skeleton. A joint with an unknown name moves its parent's segment.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyParts {
    joints: Vec<(BodySegment, Option<BodySide>)>,
    twins: Vec<Option<usize>>,
}

impl BodyParts {
    /// Classifies the joints of a skeleton by their names.
    pub fn new(skeleton: &Skeleton) -> Self {
        let mut joints: Vec<(BodySegment, Option<BodySide>)> = Vec::with_capacity(skeleton.len());
        for joint in skeleton.joints() {
            let parent = joint
                .parent
                .map_or((BodySegment::Pelvis, None), |p| joints[p]);
            let side = match joint.name.as_str() {
                n if n.starts_with("left") => Some(BodySide::Left),
                n if n.starts_with("right") => Some(BodySide::Right),
                _ => None,
            };
            joints.push(BodySegment::of_joint(&joint.name).map_or(parent, |s| (s, side)));
        }
        let twin = |name: &str| {
            let other = match (name.strip_prefix("left"), name.strip_prefix("right")) {
                (Some(rest), _) => format!("right{rest}"),
                (_, Some(rest)) => format!("left{rest}"),
                _ => return None,
            };
            skeleton.index(&other)
        };
        let twins = skeleton.joints().iter().map(|j| twin(&j.name)).collect();
        Self { joints, twins }
    }
    /// Segment that a joint moves.
    pub fn segment(&self, joint: usize) -> BodySegment {
        self.joints[joint].0
    }
    /// Side of a joint; `None` in the middle.
    pub fn side(&self, joint: usize) -> Option<BodySide> {
        self.joints[joint].1
    }
    /// Joint of the same name on the other side.
    pub fn twin(&self, joint: usize) -> Option<usize> {
        self.twins[joint]
    }
    /// Part that a joint moves.
    pub fn part(&self, joint: usize) -> BodyPart {
        BodyPart::of(self.segment(joint), self.side(joint))
    }
    /// Joint at the near end of a segment.
    pub fn joint(&self, segment: BodySegment, side: Option<BodySide>) -> Option<usize> {
        self.joints.iter().position(|j| *j == (segment, side))
    }
    /// Joints of an arm or a leg; `None` for the trunk and for a limb without one of them.
    pub fn limb(&self, limb: BodyPart) -> Option<LimbJoints> {
        use BodySegment::*;
        let (side, segments) = match limb {
            BodyPart::Trunk => return None,
            BodyPart::LeftArm => (BodySide::Left, [UpperArm, Forearm, Hand]),
            BodyPart::RightArm => (BodySide::Right, [UpperArm, Forearm, Hand]),
            BodyPart::LeftLeg => (BodySide::Left, [Thigh, Shin, Foot]),
            BodyPart::RightLeg => (BodySide::Right, [Thigh, Shin, Foot]),
        };
        let [root, hinge, end] = segments.map(|s| self.joint(s, Some(side)));
        let (root, hinge, end) = (root?, hinge?, end?);
        let tip = match segments[2] {
            Hand => self
                .joints
                .iter()
                .rposition(|j| *j == (Fingers, Some(side))),
            _ => self.joint(Toes, Some(side)),
        };
        Some(LimbJoints {
            root,
            hinge,
            end,
            tip: tip.unwrap_or(end),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Joint, JointMotion};

    fn parts(joints: &[(&str, Option<usize>)]) -> BodyParts {
        let joint = |(name, parent): &(&str, Option<usize>)| Joint {
            name: (*name).into(),
            parent: *parent,
            rest: nalgebra::Point3::origin(),
            motion: JointMotion::Fixed,
        };
        BodyParts::new(&Skeleton::new(joints.iter().map(joint).collect()).expect("a tree"))
    }

    #[test]
    fn joints_of_unknown_name_move_their_parents_segment() {
        let p = parts(&[
            ("root", None),
            ("left_elbow", Some(0)),
            ("left_twist", Some(1)),
            ("left_wrist", Some(2)),
            ("tail", Some(0)),
        ]);
        assert_eq!(p.segment(0), BodySegment::Pelvis);
        assert_eq!(p.segment(2), BodySegment::Forearm);
        assert_eq!((p.part(3), p.part(4)), (BodyPart::LeftArm, BodyPart::Trunk));
        assert_eq!(p.limb(BodyPart::LeftArm), None, "it has no shoulder");
    }
}
