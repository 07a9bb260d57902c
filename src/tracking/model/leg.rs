//! Legs of a template for the floor residual: hip, knee hinge, sole joints with their standing heights.

use crate::registration::residual::FootChain;
use tryon_body::parts::{BodySegment, BodySide};
use tryon_body::{JointMotion, Template};

/// One leg of the template.
#[derive(Clone, Debug)]
pub(crate) struct Leg {
    /// Hip joint.
    pub hip: usize,
    /// Knee joint.
    pub knee: Option<usize>,
    /// Angle of a hinged knee and its limits, radians.
    pub knee_angle: Option<(usize, [f64; 2])>,
    /// Foot, and angles from the hip down.
    pub foot: FootChain,
}

impl Leg {
    /// True for an angle that moves the foot.
    pub(crate) fn moves(&self, angle: usize) -> bool {
        self.foot.angles.contains(&angle)
    }
}

/// The legs of a template; empty for one without.
pub(crate) fn legs(template: &Template) -> Vec<Leg> {
    let skeleton = template.skeleton();
    let Some((lowest, _)) = template.mesh().bounds() else {
        return Vec::new();
    };
    let leg = |side: BodySide| {
        let at = |segment| template.parts().joint(segment, Some(side));
        let (hip, ankle) = (at(BodySegment::Thigh)?, at(BodySegment::Foot)?);
        let height = |j: usize| (j, skeleton.joints()[j].rest.y - f64::from(lowest.y));
        let soles: Vec<_> = std::iter::once(ankle)
            .chain(at(BodySegment::Toes))
            .map(height)
            .collect();
        let moves = |j: usize| soles.iter().any(|(s, _)| skeleton.is_ancestor(j, *s));
        let below = (hip..skeleton.len()).filter(|&j| skeleton.is_ancestor(hip, j) && moves(j));
        let angles =
            below.flat_map(|j| (0..skeleton.joints()[j].motion.dofs()).map(move |k| (j, k)));
        let angles = angles.map(|(j, k)| skeleton.dof_offset(j) + k).collect();
        let knee = at(BodySegment::Shin);
        let knee_angle = knee.and_then(|k| match skeleton.joints()[k].motion {
            JointMotion::Hinge { limits, .. } => Some((skeleton.dof_offset(k), limits)),
            _ => None,
        });
        Some(Leg {
            hip,
            knee,
            knee_angle,
            foot: FootChain { soles, angles },
        })
    };
    [BodySide::Left, BodySide::Right]
        .into_iter()
        .filter_map(leg)
        .collect()
}
