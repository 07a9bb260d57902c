//! Points that follow vertices of a posed template, from rest to pose and back (eq. 8 of garments from scans): pose blend
//! shapes, then blend skinning.

use crate::{BoneTransforms, PoseOffsets, SkinWeights, Template};
use nalgebra::{Matrix4, Point3};
use tryon_geometry::math::P3;

/// Least determinant of a blended transform. Opposite bones blend to nothing where a joint is folded shut.
const FLAT: f64 = 1e-3;

/// Skin of a template in a pose.
#[derive(Clone, Debug)]
pub struct PosedSkin<'a> {
    weights: &'a SkinWeights,
    bones: &'a BoneTransforms,
    offsets: Option<PoseOffsets<'a>>,
}

impl<'a> PosedSkin<'a> {
    /// Skin with the template's pose blend shapes.
    pub fn new(template: &'a Template, bones: &'a BoneTransforms) -> Self {
        Self {
            offsets: template.pose_offsets(bones),
            ..Self::blended(template.weights(), bones)
        }
    }

    /// Skin by blend skinning alone.
    pub fn blended(weights: &'a SkinWeights, bones: &'a BoneTransforms) -> Self {
        Self {
            weights,
            bones,
            offsets: None,
        }
    }

    /// Blended transform of a vertex, rest to posed coordinates.
    pub fn transform(&self, vertex: usize) -> Matrix4<f64> {
        let (joints, weights) = (self.weights.joints[vertex], self.weights.weights[vertex]);
        (0..4)
            .filter(|k| weights[*k] > 0.0)
            .map(|k| {
                let bone = &self.bones.bones[usize::from(joints[k])];
                bone.to_homogeneous() * f64::from(weights[k])
            })
            .sum()
    }

    /// Inverse of a blended transform; `None` where it is singular.
    pub fn inverse(blend: &Matrix4<f64>) -> Option<Matrix4<f64>> {
        let is_sound = blend.fixed_view::<3, 3>(0, 0).determinant() > FLAT;
        is_sound.then(|| blend.try_inverse()).flatten()
    }

    /// Posed places of rest points, metres; `nodes` gives the vertex of each.
    pub fn pose(&self, nodes: impl Iterator<Item = usize>, rest: &[P3]) -> Vec<P3> {
        let posed = |(v, p): (usize, &P3)| {
            let shaped = self.offsets.as_ref().map_or(*p, |o| p + o.of(v)).cast();
            self.transform(v).transform_point(&shaped).cast()
        };
        nodes.zip(rest).map(posed).collect()
    }

    /// Rest places of posed points, metres; `nodes` gives the vertex of each. Where the blend is singular, the bone of
    /// largest weight decides.
    pub fn unpose(&self, nodes: impl Iterator<Item = usize>, posed: &[P3]) -> Vec<P3> {
        let rest = |(v, p): (usize, &P3)| {
            let p: Point3<f64> = p.cast();
            let bone = || self.bones.bones[self.weights.dominant(v)].inverse() * p;
            let back = Self::inverse(&self.transform(v));
            let rest: P3 = back.map_or_else(bone, |m| m.transform_point(&p)).cast();
            self.offsets.as_ref().map_or(rest, |o| rest - o.of(v))
        };
        nodes.zip(posed).map(rest).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BodyShape, Pose, PoseShapes, embedded};
    use tryon_formats::PoseFeature;
    use tryon_geometry::math::{Rigid, World};
    use tryon_geometry::par::Par;

    /// Largest distances of posed vertices from those of the template, and of unposed ones from those that were posed,
    /// metres.
    fn round_trip(template: &Template) -> [f32; 2] {
        let rest = template.personalise(&BodyShape::default());
        let mut pose = Pose::<World>::rest(template.skeleton(), Rigid::identity());
        pose.set(template.skeleton(), "left_shoulder", &[0.3, -0.6, 0.8]);
        pose.set(template.skeleton(), "right_knee", &[1.2]);
        let mut bones = BoneTransforms::default();
        pose.bones(template.skeleton(), &rest, &mut bones);
        let mut posed = Vec::new();
        template.pose_vertices(Par::Seq, &rest.vertices, &bones, &mut posed);
        let skin = PosedSkin::new(template, &bones);
        let there = skin.pose(0..posed.len(), &rest.vertices);
        let back = skin.unpose(0..posed.len(), &posed);
        [(there, &posed), (back, &rest.vertices)].map(|(a, b)| {
            let errors = a.iter().zip(b).map(|(a, b)| (a - b).norm());
            errors.fold(0.0, f32::max)
        })
    }

    #[test]
    fn unposing_undoes_posing() {
        let worst = round_trip(&embedded::template());
        assert!(worst.iter().all(|e| *e < 2e-6), "{worst:?}");
    }

    #[test]
    fn unposing_undoes_pose_blend_shapes() {
        let template = (*embedded::template()).clone();
        let (n, j) = (template.mesh().vertices().len(), template.skeleton().len());
        let values = 0..n * 27 * (j - 1);
        let directions = values.map(|k| 0.01 * (k as f32).sin()).collect();
        let shapes = PoseShapes::new([n, j], PoseFeature::Matrix, directions).expect("sizes fit");
        let worst = round_trip(&template.with_pose_shapes(shapes).expect("sizes fit"));
        assert!(worst.iter().all(|e| *e < 2e-6), "{worst:?}");
    }
}
