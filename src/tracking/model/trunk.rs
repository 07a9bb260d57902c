//! The trunk as a column that arms do not enter.

use super::limb::Limb;
use tryon_body::parts::{EllipticColumn, EllipticSection, TrunkFrame};
use tryon_body::{BodyShape, BoneTransforms, Template};

/// Trunk between the hips and the shoulders.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trunk {
    /// Left and right shoulder.
    shoulders: [usize; 2],
    /// Half axes of the section across and to the front, and its centre before the line from pelvis to shoulders, as
    /// shares of the distance between the shoulders.
    half: [f64; 2],
    front: f64,
    /// Share of the section that counts as inside.
    slack: f64,
}

impl Trunk {
    /// The trunk of a template with these arms, root joint at the pelvis; `None` for one without arms.
    pub(crate) fn new(template: &Template, arms: &[Option<Limb>; 2], slack: f64) -> Option<Self> {
        let shoulders = [arms[0].as_ref()?.root, arms[1].as_ref()?.root];
        let rest = template.personalise(&BodyShape::default()).joints;
        let frame = TrunkFrame::new(rest[0], shoulders.map(|j| rest[j]))?;
        let skin = frame.skin(template, template.mesh().vertices());
        let section = EllipticSection::around(&skin);
        Some(Self {
            shoulders,
            half: section.half.map(|h| h / frame.width),
            front: section.front / frame.width,
            slack,
        })
    }

    /// The column of a posed body; `None` where its shoulders meet its pelvis.
    pub(crate) fn column(&self, bones: &BoneTransforms) -> Option<EllipticColumn> {
        let shoulders = self.shoulders.map(|j| bones.joints[j]);
        let frame = TrunkFrame::new(bones.joints[0], shoulders)?;
        Some(EllipticColumn {
            base: frame.pelvis + frame.axes[2] * (self.front * frame.width),
            axes: frame.axes,
            half: self.half.map(|h| self.slack * h * frame.width),
            height: frame.height,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::limb;
    use crate::settings::ModelSettings;
    use tryon_body::{Pose, embedded};
    use tryon_geometry::math::{Body, Camera, Rigid};

    #[test]
    fn arms_at_rest_are_outside_and_a_point_in_the_chest_is_inside() {
        let template = embedded::template();
        let arms = limb::arms(&template, &ModelSettings::default());
        let trunk = Trunk::new(&template, &arms, 0.65).expect("a trunk");
        let pose = Pose::rest(template.skeleton(), Rigid::<Camera, Body>::identity());
        let mut bones = BoneTransforms::default();
        pose.bones(
            template.skeleton(),
            &template.personalise(&Default::default()),
            &mut bones,
        );
        let column = trunk.column(&bones).expect("a column");
        let [across, front] = column.half;
        assert!(
            (0.1..0.2).contains(&across) && (0.07..0.15).contains(&front),
            "{column:?}"
        );
        let middle = column.base + column.axes[1] * (0.5 * column.height);
        assert!(
            column
                .inside(&(middle + column.axes[2] * (0.5 * front)))
                .is_some()
        );
        for arm in arms.iter().flatten() {
            assert_eq!(column.inside(&arm.hand(&bones)), None);
        }
    }
}
