//! Proposed places of a template's joints, from the part network.

use crate::fit::FitScratch;
use crate::model::part_classes::kind_of;
use crate::model::{NECK_CLASS, PART_CLASSES, PartClasses, PartKind, TrackerModel};
use crate::registration::residual::JointTarget;
use crate::segment::part_network::JointProposal;
use crate::settings::ProposalSettings;
use tryon_body::parts::BodySide;
use tryon_geometry::math::P3;

/// A place for the middle of two joints, or of one joint twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProposedAnchor {
    /// Joints of the template.
    pub joints: [usize; 2],
    /// Class that proposes it.
    pub class: u8,
    /// Place, camera frame, metres.
    pub position: P3,
    /// Confidence, 0 to 1.
    pub weight: f32,
}

/// Proposals of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointProposals {
    /// Heaviest first within a class.
    pub anchors: Vec<ProposedAnchor>,
}

impl JointProposals {
    /// Proposals for the anchors of a template. The halves of the head become one place.
    pub fn new(
        classes: &PartClasses,
        proposals: &[JointProposal],
        settings: &ProposalSettings,
    ) -> Self {
        let mut anchors = Vec::with_capacity(proposals.len());
        for p in proposals {
            let Some(joints) = classes.anchor(p.class) else {
                continue;
            };
            anchors.push(ProposedAnchor {
                joints,
                class: p.class,
                position: p.position,
                weight: p.weight,
            });
        }
        join_heads(&mut anchors, settings);
        Self { anchors }
    }
    /// The proposals of the opposite facing: left and right change places.
    pub fn flipped(&self, classes: &PartClasses) -> Self {
        let head = PartKind::Head.class(BodySide::Left);
        let mut anchors = self.anchors.clone();
        for a in anchors
            .iter_mut()
            .filter(|a| ![NECK_CLASS, head].contains(&a.class))
        {
            a.class ^= 1;
            a.joints = classes.anchor(a.class).unwrap_or(a.joints);
        }
        anchors.sort_by(|a, b| a.class.cmp(&b.class).then(b.weight.total_cmp(&a.weight)));
        Self { anchors }
    }
    /// For each class the heavy proposal nearest to its anchor among the scratch's bones; none for the arm of a detected hand.
    pub(crate) fn targets(&self, model: &TrackerModel, scratch: &FitScratch) -> Vec<JointTarget> {
        let settings = &model.config.start.proposals;
        let joints = &scratch.bones.joints;
        use PartKind::{Elbow, Forearm, Hand, UpperArm};
        let is_held = |class: u8| {
            let arm = kind_of(class).filter(|k| matches!(k.0, UpperArm | Elbow | Forearm | Hand));
            arm.is_some_and(|(_, side)| scratch.terms.hands[side as usize].is_some())
        };
        let of_class = |class: u8| {
            let [a, b] = model.part_classes.anchor(class)?;
            let now = model.part_classes.anchor_of(class, joints)?;
            let heavy = self.of_class(class).filter(|p| p.1 > settings.heavy);
            let (position, weight) = heavy
                .map(|(p, w)| (p.cast::<f64>(), f64::from(w)))
                .min_by(|x, y| (x.0 - now).norm().total_cmp(&(y.0 - now).norm()))?;
            // The place of a joint is carried by the bone above it.
            let bone = if a == b { model.parents[a]? } else { a };
            Some(JointTarget {
                joints: [a, b],
                bone,
                position,
                weight,
            })
        };
        let open = (0..PART_CLASSES as u8).filter(|class| !is_held(*class));
        open.filter_map(of_class).collect()
    }
    /// Places of a class's anchor, heaviest first.
    pub fn of_class(&self, class: u8) -> impl Iterator<Item = (P3, f32)> + '_ {
        let own = self.anchors.iter().filter(move |a| a.class == class);
        own.map(|a| (a.position, a.weight))
    }
}

/// Replaces both halves of the head by their weighted middle under the left class; a lone half stays.
fn join_heads(anchors: &mut Vec<ProposedAnchor>, settings: &ProposalSettings) {
    let class = |side| PartKind::Head.class(side);
    let [left, right] = [class(BodySide::Left), class(BodySide::Right)];
    let first = |c: u8| anchors.iter().position(|a| a.class == c);
    if let (Some(l), Some(r)) = (first(left), first(right)) {
        let (a, b) = (anchors[l], anchors[r]);
        if (a.position - b.position).norm() < settings.head {
            let sum = (a.weight + b.weight).max(f32::MIN_POSITIVE);
            anchors[l].position = a.position + (b.position - a.position) * (b.weight / sum);
            anchors[l].weight = a.weight.max(b.weight);
            anchors.remove(r);
        }
    }
    for a in anchors.iter_mut().filter(|a| a.class == right) {
        a.class = left;
    }
    anchors.sort_by(|a, b| a.class.cmp(&b.class).then(b.weight.total_cmp(&a.weight)));
}
