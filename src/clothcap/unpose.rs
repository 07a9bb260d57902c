//! Unposing (eq. 8): rest positions that pose blend shapes and blend skinning take to given posed ones.

use nalgebra::{Matrix4, Point3};
use tryon_body::{BoneTransforms, SkinWeights, Template};
use tryon_geometry::math::P3;

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

/// Rest positions of posed vertices of a template, before its pose blend shapes (Bₚ of eq. 8); `nodes` gives the vertex of
/// each.
pub fn unpose_shaped(
    template: &Template,
    bones: &BoneTransforms,
    nodes: impl Iterator<Item = usize> + Clone,
    posed: &[P3],
) -> Vec<P3> {
    let mut rest = unpose(template.weights(), bones, nodes.clone(), posed);
    if let Some(offsets) = template.pose_offsets(bones) {
        let all = rest.iter_mut().zip(nodes);
        all.for_each(|(p, v)| *p -= offsets.of(v));
    }
    rest
}

/// Rest positions of posed vertices by blend skinning alone; `nodes` gives the body vertex of each. Where the blend is
/// singular, the bone of largest weight decides.
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
    use tryon_body::{BodyShape, Pose, PoseShapes, embedded};
    use tryon_geometry::math::{Rigid, World};
    use tryon_geometry::par::Par;

    /// Largest distance of unposed vertices from those that were posed, metres.
    fn round_trip(template: &Template) -> f32 {
        let rest = template.personalise(&BodyShape::default());
        let mut pose = Pose::<World>::rest(template.skeleton(), Rigid::identity());
        pose.set(template.skeleton(), "left_shoulder", &[0.3, -0.6, 0.8]);
        pose.set(template.skeleton(), "right_knee", &[1.2]);
        let mut bones = BoneTransforms::default();
        pose.bones(template.skeleton(), &rest, &mut bones);
        let mut posed = Vec::new();
        template.pose_vertices(Par::Seq, &rest.vertices, &bones, &mut posed);
        let back = unpose_shaped(template, &bones, 0..posed.len(), &posed);
        let errors = back.iter().zip(&rest.vertices).map(|(a, b)| (a - b).norm());
        errors.fold(0.0, f32::max)
    }

    #[test]
    fn unposing_undoes_posing() {
        let worst = round_trip(&embedded::template());
        assert!(worst < 2e-6, "{worst}");
    }

    #[test]
    fn unposing_undoes_pose_blend_shapes() {
        let template = (*embedded::template()).clone();
        let (n, j) = (template.mesh().vertices().len(), template.skeleton().len());
        let values = 0..n * 27 * (j - 1);
        let directions = values.map(|k| 0.01 * (k as f32).sin()).collect();
        let shapes = PoseShapes::new(n, j, directions).expect("sizes fit");
        let worst = round_trip(&template.with_pose_shapes(shapes).expect("sizes fit"));
        assert!(worst < 2e-6, "{worst}");
    }
}
