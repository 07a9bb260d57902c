//! Parts of the body that move as one while the subject turns.

use tryon_body::Template;
use tryon_body::parts::BodyPart;

/// Parts of the body that move as one: pelvis, chest, head, arms, legs.
#[derive(Debug)]
pub(super) struct MovingParts {
    of_bone: Vec<usize>,
    /// Joint that ties each part to its parent; the pelvis' own is unused.
    pub(super) joints: Vec<usize>,
    /// Part that each part hangs on; the pelvis' own is unused.
    pub(super) parents: Vec<usize>,
}

impl MovingParts {
    pub(super) fn new(template: &Template) -> Self {
        let skeleton = template.skeleton();
        let limbs = [
            BodyPart::LeftArm,
            BodyPart::RightArm,
            BodyPart::LeftLeg,
            BodyPart::RightLeg,
        ];
        let mut joints = vec![0];
        joints.extend(["spine2", "head"].iter().filter_map(|j| skeleton.index(j)));
        let limbs = limbs.iter().filter_map(|l| template.parts().limb(*l));
        joints.extend(limbs.map(|l| l.root));
        let mut of_bone = vec![0; skeleton.len()];
        for (bone, joint) in skeleton.joints().iter().enumerate() {
            let own = joints.iter().skip(1).position(|j| *j == bone);
            of_bone[bone] = match (own, joint.parent) {
                (Some(k), _) => k + 1,
                (None, Some(parent)) => of_bone[parent],
                (None, None) => 0,
            };
        }
        let parent = |j: &usize| skeleton.joints()[*j].parent.map_or(0, |p| of_bone[p]);
        let parents = joints.iter().map(parent).collect();
        Self {
            of_bone,
            joints,
            parents,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.joints.len()
    }

    pub(super) fn of(&self, bone: usize) -> usize {
        self.of_bone[bone]
    }
}
