//! Unposing (eq. 8): rest positions that blend skinning takes to given posed ones.

use crate::body::{BoneTransforms, SkinWeights};
use crate::math::P3;
use nalgebra::{Matrix4, Point3};

/// Least determinant of a vertex's blended transform. Opposite bones blend to nothing where a joint is folded shut.
const FLAT: f64 = 1e-3;

/// Blended transform of a vertex, rest to posed coordinates.
pub fn blended(weights: &SkinWeights, bones: &BoneTransforms, vertex: usize) -> Matrix4<f64> {
    (0..4)
        .filter(|k| weights.weights[vertex][*k] > 0.0)
        .map(|k| {
            let bone = &bones.bones[usize::from(weights.joints[vertex][k])];
            bone.to_homogeneous() * f64::from(weights.weights[vertex][k])
        })
        .sum()
}

/// Rest positions of posed vertices; `nodes` gives the body vertex of each. Where the blend is singular, the bone of
/// largest weight decides.
pub fn unpose(
    weights: &SkinWeights,
    bones: &BoneTransforms,
    nodes: impl Iterator<Item = usize>,
    posed: &[P3],
) -> Vec<P3> {
    nodes
        .zip(posed)
        .map(|(v, p)| {
            let blend = blended(weights, bones, v);
            let p: Point3<f64> = p.cast();
            let inverse = if blend.fixed_view::<3, 3>(0, 0).determinant() > FLAT {
                blend.try_inverse()
            } else {
                None
            };
            let rest = inverse.map_or_else(
                || bones.bones[weights.dominant(v)].inverse() * p,
                |m| m.transform_point(&p),
            );
            rest.cast()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{BodyShape, Pose, embedded, skin};
    use crate::math::{Rigid, World};
    use crate::par::Par;

    #[test]
    fn unposing_undoes_posing() {
        let template = embedded::template();
        let rest = template.personalise(&BodyShape::default());
        let mut pose = Pose::<World>::rest(template.skeleton(), Rigid::identity());
        pose.set(template.skeleton(), "left_shoulder", &[0.3, -0.6, 0.8]);
        pose.set(template.skeleton(), "right_knee", &[1.2]);
        let mut bones = BoneTransforms::default();
        pose.bones(template.skeleton(), &rest, &mut bones);
        let mut posed = Vec::new();
        skin(
            Par::Seq,
            &rest.vertices,
            template.weights(),
            &bones,
            &mut posed,
        );
        let back = unpose(template.weights(), &bones, 0..posed.len(), &posed);
        let worst = back
            .iter()
            .zip(&rest.vertices)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f32::max);
        assert!(worst < 1e-4, "{worst}");
    }
}
