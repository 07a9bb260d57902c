//! Pose blend shapes in one pose, and posing with them.

use super::pose_features::push_features;
use super::pose_shapes::PoseShapes;
use super::skinning::{MovedRest, skin_moved};
use super::{BoneTransforms, Skeleton, Template};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par::{self, Par};

/// Features below which a joint is not turned: offsets of a nanometre. Larger values drop small corrections.
const NEGLIGIBLE: f32 = 1e-6;

/// Pose blend shapes of a template in one pose.
#[derive(Clone, Debug)]
pub struct PoseOffsets<'a> {
    shapes: &'a PoseShapes,
    features: Vec<f32>,
}

impl PoseOffsets<'_> {
    /// Rest offset of a vertex, metres.
    pub fn of(&self, vertex: usize) -> V3 {
        let mut rows = self.shapes.rows(vertex).chunks_exact(self.features.len());
        V3::from_fn(|_, _| rows.next().map_or(0.0, |row| dot(row, &self.features)))
    }

    /// Rest offsets of all vertices, metres, shape `[vertices]`.
    pub fn all(&self, par: Par) -> Vec<V3> {
        let mut out = Vec::new();
        par::map_into(par, self.shapes.vertices(), 256, &mut out, |v| self.of(v));
        out
    }
}

/// Product with eight running sums, so that it is vector operations.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 8;
    let ((a, rest_a), (b, rest_b)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0f32; LANES];
    for (p, q) in a.iter().zip(b) {
        for k in 0..LANES {
            sums[k] += p[k] * q[k];
        }
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(p, q)| p * q).sum();
    sums.iter().sum::<f32>() + rest
}

/// Features of all joints but the root, shape `[features]`; `None` where no joint but the root is turned.
fn features(shapes: &PoseShapes, skeleton: &Skeleton, bones: &BoneTransforms) -> Option<Vec<f32>> {
    let moving = skeleton.joints().iter().enumerate().skip(1);
    let mut out = Vec::with_capacity(shapes.features());
    for (j, joint) in moving.take(shapes.turned_joints()) {
        let rotation = match joint.parent {
            Some(p) => bones.bones[p].rotation.inverse() * bones.bones[j].rotation,
            None => bones.bones[j].rotation,
        };
        push_features(shapes.feature(), &rotation, &mut out);
    }
    out.iter().any(|v| v.abs() > NEGLIGIBLE).then_some(out)
}

impl Template {
    /// Pose blend shapes in a pose; `None` for a template without, and where they vanish.
    pub fn pose_offsets(&self, bones: &BoneTransforms) -> Option<PoseOffsets<'_>> {
        let shapes = self.pose_shapes()?;
        let features = features(shapes, self.skeleton(), bones)?;
        Some(PoseOffsets { shapes, features })
    }

    /// Poses `rest` vertices of the whole template: pose blend shapes, then linear blend skinning (Pons-Moll et al. 2017,
    /// eq. 1 and 2). Shapes `[vertices]`, metres. Without pose blend shapes this is [`super::skin`] and costs the same.
    pub fn pose_vertices(&self, par: Par, rest: &[P3], bones: &BoneTransforms, out: &mut Vec<P3>) {
        let offsets = self.pose_offsets(bones).map(|o| o.all(par));
        let offsets = offsets.unwrap_or_default();
        let rest = MovedRest {
            vertices: rest,
            offsets: &offsets,
        };
        skin_moved(par, rest, self.weights(), bones, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BodyShape, Pose, embedded, skin};
    use nalgebra::{Matrix3, Matrix4, Point3, Vector3};
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tryon_formats::PoseFeature;
    use tryon_geometry::math::{Rigid, World, exp_so3};

    const SIZE: f32 = 0.01;

    /// Embedded body with directions at random, of up to a centimetre an entry.
    fn with_random_shapes(size: f32, feature: PoseFeature) -> Template {
        let template = (*embedded::template()).clone();
        let (n, j) = (template.mesh().vertices().len(), template.skeleton().len());
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let values = 0..n * 3 * feature.count() * (j - 1);
        let directions = values.map(|_| size * rng.random_range(-1.0..1.0f32));
        let shapes = PoseShapes::new([n, j], feature, directions.collect()).expect("sizes fit");
        template.with_pose_shapes(shapes).expect("sizes fit")
    }

    fn bent(template: &Template) -> (Pose<World>, BoneTransforms) {
        let root = Rigid::from_parts(Vector3::new(0.3, 0.1, -0.2), exp_so3(&Vector3::y()));
        let mut pose = Pose::<World>::rest(template.skeleton(), root);
        pose.set(template.skeleton(), "left_shoulder", &[0.3, -0.6, 0.8]);
        pose.set(template.skeleton(), "right_knee", &[1.2]);
        let mut bones = BoneTransforms::default();
        let rest = template.personalise(&BodyShape::default());
        pose.bones(template.skeleton(), &rest, &mut bones);
        (pose, bones)
    }

    /// Features by the published formulas from the axis-angle vector θ: vec(R − I) of SMPL; (θ/|θ| sin ½|θ|, cos ½|θ| − 1) of
    /// STAR.
    fn published(feature: PoseFeature, theta: Vector3<f64>) -> Vec<f64> {
        match feature {
            PoseFeature::Matrix => {
                let change = nalgebra::Rotation3::from_scaled_axis(theta).into_inner();
                let change = change - Matrix3::identity();
                (0..9).map(|k| change[(k / 3, k % 3)]).collect()
            }
            PoseFeature::Quaternion => {
                let angle = theta.norm();
                let axis = theta / angle.max(1e-12);
                let axis = axis * (0.5 * angle).sin();
                vec![axis.x, axis.y, axis.z, (0.5 * angle).cos() - 1.0]
            }
        }
    }

    #[test]
    fn posed_vertices_follow_the_published_formulas() {
        check_published(PoseFeature::Matrix);
        check_published(PoseFeature::Quaternion);
    }

    /// v = Σ w G (v̄ + posedirs · features), term by term in f64, G from products of 4 × 4 transforms relative to the parent.
    fn check_published(feature: PoseFeature) {
        let template = with_random_shapes(SIZE, feature);
        let (pose, bones) = bent(&template);
        let rest = template.personalise(&BodyShape::default());
        let skeleton = template.skeleton();
        let turn = |j: usize| {
            let v = pose.rotation_vector(skeleton, j);
            nalgebra::Rotation3::from_scaled_axis(v).into_inner()
        };
        let mut global: Vec<Matrix4<f64>> = Vec::new();
        let mut features = Vec::new();
        for (j, joint) in skeleton.joints().iter().enumerate() {
            let before = joint
                .parent
                .map_or(Vector3::zeros(), |p| rest.joints[p].coords);
            let mut local = Matrix4::identity();
            local.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn(j));
            let step = rest.joints[j].coords - before;
            local.fixed_view_mut::<3, 1>(0, 3).copy_from(&step);
            let above = joint
                .parent
                .map_or(pose.root.iso().to_homogeneous(), |p| global[p]);
            global.push(above * local);
            if j > 0 {
                features.extend(published(feature, pose.rotation_vector(skeleton, j)));
            }
        }
        let mut posed = Vec::new();
        template.pose_vertices(Par::Seq, &rest.vertices, &bones, &mut posed);
        let shapes = template.pose_shapes().expect("given");
        let mut moved = 0.0f64;
        for (v, found) in posed.iter().enumerate().step_by(37) {
            let rows = shapes.rows(v);
            let offset = Vector3::from_fn(|c, _| {
                let row = &rows[c * features.len()..(c + 1) * features.len()];
                row.iter()
                    .zip(&features)
                    .map(|(d, r)| f64::from(*d) * r)
                    .sum()
            });
            moved = moved.max(offset.norm());
            let at = rest.vertices[v].coords.cast::<f64>() + offset;
            let mut sum = Vector3::zeros();
            for k in 0..4 {
                let j = usize::from(template.weights().joints[v][k]);
                let about = Point3::from(at - rest.joints[j].coords);
                let w = f64::from(template.weights().weights[v][k]);
                sum += global[j].transform_point(&about).coords * w;
            }
            let error = (sum - found.coords.cast()).norm();
            assert!(error < 1e-5, "vertex {v}: {error} m");
        }
        assert!(moved > 0.005, "{moved}");
    }

    #[test]
    fn vanishing_shapes_give_the_bits_of_blend_skinning() {
        let zero = with_random_shapes(0.0, PoseFeature::Matrix);
        let some = with_random_shapes(SIZE, PoseFeature::Quaternion);
        let none = embedded::template();
        let rest = zero.personalise(&BodyShape::default()).vertices;
        let posed = |template: &Template, bones: &BoneTransforms| {
            let mut out = Vec::new();
            template.pose_vertices(Par::Seq, &rest, bones, &mut out);
            out
        };
        let (_, bones) = bent(&zero);
        let mut skinned = Vec::new();
        skin(Par::Seq, &rest, zero.weights(), &bones, &mut skinned);
        assert_eq!(posed(&zero, &bones), skinned);
        assert!(none.pose_offsets(&bones).is_none());
        assert_eq!(posed(&none, &bones), skinned);
        // At rest every rotation is the identity, whatever the root's is.
        let root = Rigid::from_parts(Vector3::x(), exp_so3(&Vector3::z()));
        let pose = Pose::<World>::rest(some.skeleton(), root);
        let mut bones = BoneTransforms::default();
        let body = some.personalise(&BodyShape::default());
        pose.bones(some.skeleton(), &body, &mut bones);
        assert!(some.pose_offsets(&bones).is_none());
    }

    #[test]
    fn shapes_of_another_body_are_refused() {
        let other = PoseShapes::new([1, 2], PoseFeature::Matrix, vec![0.0; 27]).expect("sizes fit");
        let template = (*embedded::template()).clone();
        assert!(template.with_pose_shapes(other).is_err());
    }
}
