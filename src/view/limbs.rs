//! Body parts by vertex, and the vertices of forearms, hands, face and trunk, on the body template.

use super::arm::ArmAxis;
use super::settings::LimbSettings;
use tryon_body::Template;
use tryon_body::parts::{BodyPart, BodySegment, LimbJoints};
use tryon_geometry::math::{P3, V3};

/// Parts of a template by vertex, for [`super::BodyView`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Limbs {
    pub(super) arms: [Arm; 2],
    /// Front of the face, without brow and chin.
    pub(super) face: Vec<u32>,
    /// Trunk, hips and thighs.
    pub(super) trunk: Vec<u32>,
    /// Part of each vertex, shape `[vertices]`.
    pub(super) parts: Vec<BodyPart>,
    /// Segment of each vertex, shape `[vertices]`.
    pub(super) segments: Vec<BodySegment>,
}

/// Vertices of one arm.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Arm {
    pub(super) forearm: Vec<u32>,
    pub(super) hand: Vec<u32>,
    /// Rings centred at the elbow, the wrist and the finger tips.
    pub(super) rings: [Vec<u32>; 3],
}

impl Limbs {
    /// The limbs of a template whose joints have SMPL's names; empty for others, which disables the detection of hands.
    pub fn of(template: &Template) -> Self {
        let settings = LimbSettings::default();
        let (parts, weights) = (template.parts(), template.weights());
        let vertices = template.mesh().vertices().len();
        let mut out = Self {
            parts: (0..vertices)
                .map(|v| parts.part(weights.dominant(v)))
                .collect(),
            segments: (0..vertices)
                .map(|v| parts.segment(weights.dominant(v)))
                .collect(),
            ..Self::default()
        };
        let sides = [BodyPart::LeftArm, BodyPart::RightArm];
        for (side, arm) in sides.into_iter().zip(&mut out.arms) {
            let Some(joints) = parts.limb(side) else {
                return Self::default();
            };
            *arm = Arm::of(template, side, &joints, &settings);
        }
        use BodySegment::{Abdomen, Chest, Head, Pelvis, Thigh};
        out.face = front_of_face(template, &moved_by(template, |s| s == Head), &settings);
        out.trunk = moved_by(template, |s| [Pelvis, Abdomen, Chest, Thigh].contains(&s));
        out
    }

    /// Part of a vertex.
    pub(super) fn part(&self, vertex: u32) -> Option<BodyPart> {
        self.parts.get(vertex as usize).copied()
    }

    /// Belongs to an arm.
    pub(super) fn is_arm(&self, vertex: u32) -> bool {
        matches!(
            self.part(vertex),
            Some(BodyPart::LeftArm | BodyPart::RightArm)
        )
    }

    /// Made for a body of so many vertices.
    pub(super) fn fits(&self, vertices: usize) -> bool {
        vertices > 0 && self.parts.len() == vertices
    }
}

impl Arm {
    /// Vertices of one side's arm below the elbow, by their dominant joint.
    fn of(template: &Template, side: BodyPart, arm: &LimbJoints, settings: &LimbSettings) -> Self {
        let (joints, parts) = (template.skeleton().joints(), template.parts());
        let rest = template.mesh().vertices();
        let owner = |v: u32| template.weights().dominant(v as usize);
        let [e, w] = [arm.hinge, arm.end].map(|j| joints[j].rest);
        let axis = w - e;
        let share = |v: u32| (rest[v as usize].cast::<f64>() - e).dot(&axis) / axis.norm_squared();
        let is_below = |v: &u32| {
            let joint = owner(*v);
            parts.part(joint) == side && parts.segment(joint) != BodySegment::UpperArm
        };
        let vertices: Vec<u32> = (0..rest.len() as u32).filter(is_below).collect();
        let reach = vertices.iter().map(|&v| share(v)).fold(0.0, f64::max);
        let ring = |at: f64| {
            let near = |v: &u32| (share(*v) - at).abs() < settings.ring;
            vertices.iter().copied().filter(near).collect()
        };
        let rings = [0.0, 1.0, reach].map(ring);
        let is_hand = |v: &u32| parts.segment(owner(*v)) != BodySegment::Forearm;
        let (hand, forearm) = vertices.into_iter().partition(is_hand);
        Self {
            forearm,
            hand,
            rings,
        }
    }

    /// Axis on a posed body; `None` when the arm has no vertices or they are not finite.
    pub(super) fn axis(&self, body: &[P3]) -> Option<ArmAxis> {
        let centre = |ring: &[u32]| {
            let sum: V3 = ring.iter().map(|&v| body[v as usize].coords).sum();
            let p = P3::from(sum / ring.len() as f32);
            p.iter().all(|c| c.is_finite()).then_some(p)
        };
        let [elbow, wrist, tip] = self.rings.each_ref().map(|r| centre(r));
        Some(ArmAxis {
            elbow: elbow?,
            wrist: wrist?,
            tip: tip?,
        })
    }
}

/// Vertices whose dominant joint moves one of these segments.
fn moved_by(template: &Template, is_wanted: impl Fn(BodySegment) -> bool) -> Vec<u32> {
    let segment = |v: u32| {
        template
            .parts()
            .segment(template.weights().dominant(v as usize))
    };
    (0..template.mesh().vertices().len() as u32)
        .filter(|v| is_wanted(segment(*v)))
        .collect()
}

/// Front of the face, without brow and chin, among the vertices of the head.
fn front_of_face(template: &Template, head: &[u32], settings: &LimbSettings) -> Vec<u32> {
    let at = |v: u32| template.mesh().vertices()[v as usize];
    let extent = |axis: usize| {
        head.iter()
            .fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], &v| {
                [lo.min(at(v)[axis]), hi.max(at(v)[axis])]
            })
    };
    let [low, high] = settings.face;
    let ([y0, y1], [z0, z1]) = (extent(1), extent(2));
    let is_face = |v: &u32| {
        let p = at(*v);
        (low..high).contains(&((p.y - y0) / (y1 - y0)))
            && p.z - z0 > settings.face_front * (z1 - z0)
    };
    head.iter().copied().filter(is_face).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn limbs_of_the_embedded_body_are_disjoint_and_mirrored() {
        let template = embedded::template();
        let limbs = Limbs::of(&template);
        assert!(limbs.fits(template.mesh().vertices().len()) && !limbs.fits(0));
        let rest = template.mesh().vertices();
        for (arm, side) in limbs.arms.iter().zip([1.0, -1.0]) {
            assert!(arm.forearm.len() > 50 && arm.hand.len() > 50);
            let own = arm.forearm.iter().chain(&arm.hand);
            assert!(
                own.clone()
                    .all(|&v| limbs.is_arm(v) && side * rest[v as usize].x > 0.0)
            );
            let axis = arm.axis(rest).expect("finite");
            assert!(
                side * axis.elbow.x < side * axis.wrist.x
                    && side * axis.wrist.x < side * axis.tip.x
            );
        }
        let others = limbs.face.iter().chain(&limbs.trunk);
        assert!(!limbs.face.is_empty() && others.copied().all(|v| !limbs.is_arm(v)));
        assert!(!limbs.is_arm(u32::MAX));
    }

    #[test]
    fn an_arm_without_vertices_or_with_broken_ones_has_no_axis() {
        let template = embedded::template();
        assert_eq!(Arm::default().axis(template.mesh().vertices()), None);
        let limbs = Limbs::of(&template);
        let mut broken = template.mesh().vertices().to_vec();
        broken[limbs.arms[0].rings[1][0] as usize].x = f32::NAN;
        assert_eq!(limbs.arms[0].axis(&broken), None);
    }
}
