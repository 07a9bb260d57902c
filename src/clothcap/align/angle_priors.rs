//! Priors of joint angles: near the start, and spine, neck and head straight.

use tryon_body::Template;
use tryon_body::parts::BodySegment;

/// Standard deviations of joint angles from those of the start, radians: of joints of the spine, collars, hands and feet,
/// and of the others.
const ANGLES: [f64; 2] = [0.35, 1.2];
/// Standard deviations of joint angles from those of the rest pose, radians: of neck and head, and of the spine. Hair is wider
/// than a face: without them, heads of one-sided scans turn aside by 90°.
const STRAIGHT: [f64; 2] = [0.12, 0.35];

/// Precisions of joint angles about those of the rest pose, shape `[angles]`; see [`STRAIGHT`].
pub(super) fn straight_precisions(template: &Template) -> Vec<f64> {
    use BodySegment::*;
    let skeleton = template.skeleton();
    let mut out = vec![0.0; skeleton.dofs()];
    for (j, joint) in skeleton.joints().iter().enumerate() {
        let deviation = match template.parts().segment(j) {
            Neck | Head => STRAIGHT[0],
            Abdomen | Chest => STRAIGHT[1],
            _ => continue,
        };
        let at = skeleton.dof_offset(j);
        out[at..at + joint.motion.dofs()].fill(deviation.powi(-2));
    }
    out
}

/// Standard deviations of joint angles about those of the start, radians, shape `[angles]`.
pub(super) fn angle_deviations(template: &Template) -> Vec<f64> {
    use BodySegment::*;
    let skeleton = template.skeleton();
    let mut out = vec![ANGLES[1]; skeleton.dofs()];
    for (j, joint) in skeleton.joints().iter().enumerate() {
        let segment = template.parts().segment(j);
        let is_stiff = matches!(
            segment,
            Abdomen | Chest | Neck | Head | Collar | Hand | Fingers | Foot | Toes
        );
        let at = skeleton.dof_offset(j);
        for slot in &mut out[at..at + joint.motion.dofs()] {
            *slot = ANGLES[usize::from(!is_stiff)];
        }
    }
    out
}
