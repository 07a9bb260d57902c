//! Pose (root transform and joint angles) and forward kinematics.

use super::{JointMotion, RestBody, Skeleton};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{Body, Camera, Rigid, exp_so3, log_so3};

/// Pose of a body in frame `F` (the depth camera unless said otherwise).
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Pose<F = Camera> {
    /// Rest coordinates to `F`, before any joint moves.
    pub root: Rigid<F, Body>,
    /// Joint angles in the order of [`Skeleton::dof_offset`], radians: one for a hinge, a rotation vector for a ball.
    pub angles: Vec<f64>,
}

impl<F> Clone for Pose<F> {
    fn clone(&self) -> Self {
        Self {
            root: self.root,
            angles: self.angles.clone(),
        }
    }
}
impl<F> PartialEq for Pose<F> {
    fn eq(&self, o: &Self) -> bool {
        self.root == o.root && self.angles == o.angles
    }
}
impl<F> std::fmt::Debug for Pose<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pose")
            .field("root", &self.root)
            .field("angles", &self.angles)
            .finish()
    }
}

/// Bone transforms of a posed body, rest coordinates to posed coordinates.
#[derive(Clone, Debug, Default)]
pub struct BoneTransforms {
    /// Skinning transforms, shape `[joints]`.
    pub bones: Vec<Isometry3<f64>>,
    /// Posed joint positions, shape `[joints]`.
    pub joints: Vec<Point3<f64>>,
}

impl<F> Pose<F> {
    /// The rest pose at `root`.
    pub fn rest(skeleton: &Skeleton, root: Rigid<F, Body>) -> Self {
        Self {
            root,
            angles: vec![0.0; skeleton.dofs()],
        }
    }
    /// The same pose in frame `G`, in which `F` lies at `g_from_f`.
    #[must_use]
    pub fn transformed<G>(&self, g_from_f: &Rigid<G, F>) -> Pose<G> {
        Pose {
            root: *g_from_f * self.root,
            angles: self.angles.clone(),
        }
    }
    /// Local rotation vector of a joint (axis × angle, rest frame).
    pub fn rotation_vector(&self, skeleton: &Skeleton, joint: usize) -> Vector3<f64> {
        let at = skeleton.dof_offset(joint);
        match &skeleton.joints()[joint].motion {
            JointMotion::Fixed => Vector3::zeros(),
            JointMotion::Hinge { axis, .. } => Vector3::from(*axis) * self.angles[at],
            JointMotion::Ball { .. } => {
                Vector3::new(self.angles[at], self.angles[at + 1], self.angles[at + 2])
            }
        }
    }
    /// Rotations of the joints relative to their parents, of joint 0 relative to `F`, shape `[joints]`.
    pub fn local_rotations(&self, skeleton: &Skeleton) -> Vec<UnitQuaternion<f64>> {
        let local = |j| exp_so3(&self.rotation_vector(skeleton, j));
        let mut out: Vec<_> = (0..skeleton.len()).map(local).collect();
        if let Some(root) = out.first_mut() {
            *root = self.root.iso().rotation * *root;
        }
        out
    }
    /// Forward kinematics (eq. 2): transforms of all bones of the personalised rest body.
    pub fn bones(&self, skeleton: &Skeleton, rest: &RestBody, out: &mut BoneTransforms) {
        out.bones.clear();
        out.joints.clear();
        for (j, joint) in skeleton.joints().iter().enumerate() {
            let parent = joint.parent.map_or(*self.root.iso(), |p| out.bones[p]);
            let pivot = rest.joints[j];
            let rotation = exp_so3(&self.rotation_vector(skeleton, j));
            // T(p) R T(−p): rotates about the joint's rest position, so no inverse bind matrix is needed.
            let local = Isometry3::from_parts(
                Translation3::from(pivot.coords - rotation * pivot.coords),
                rotation,
            );
            out.bones.push(parent * local);
            out.joints.push(parent * pivot);
        }
    }
    /// Sets the angles of a joint by name; ignores names the skeleton lacks and extra values.
    pub fn set(&mut self, skeleton: &Skeleton, joint: &str, values: &[f64]) {
        if let Some(j) = skeleton.index(joint) {
            let at = skeleton.dof_offset(j);
            let n = skeleton.joints()[j].motion.dofs().min(values.len());
            self.angles[at..at + n].copy_from_slice(&values[..n]);
        }
    }
    /// Turns the upper arms to `angle` rad below the horizontal, to the sides; a skeleton without them keeps its pose.
    pub fn lower_arms(&mut self, skeleton: &Skeleton, rest: &RestBody, angle: f64) {
        for (side, s) in [("left", 1.0), ("right", -1.0)] {
            let down = Vector3::new(s * angle.cos(), -angle.sin(), 0.0);
            self.turn_arm(skeleton, rest, side, &down);
        }
    }
    /// Turns the upper arm of a side (`left`, `right`) to a direction of the rest frame as seen from the trunk; a skeleton
    /// without it keeps its pose.
    pub fn turn_arm(
        &mut self,
        skeleton: &Skeleton,
        rest: &RestBody,
        side: &str,
        direction: &Vector3<f64>,
    ) {
        let [shoulder, elbow] =
            ["shoulder", "elbow"].map(|n| skeleton.index(&format!("{side}_{n}")));
        let (Some(shoulder), Some(elbow)) = (shoulder, elbow) else {
            return;
        };
        let along = rest.joints[elbow] - rest.joints[shoulder];
        let turn = UnitQuaternion::rotation_between(&along, direction);
        let at = skeleton.dof_offset(shoulder);
        if let (Some(turn), Some(angles)) = (turn, self.angles.get_mut(at..at + 3)) {
            angles.copy_from_slice(log_so3(&turn).as_slice());
        }
    }
    /// Moves every angle into its limits.
    pub fn clamp_to_limits(&mut self, skeleton: &Skeleton) {
        for (a, l) in self.angles.iter_mut().zip(skeleton.limits()) {
            *a = a.clamp(l[0], l[1]);
        }
    }
    /// Pose at share `t` of the way to `other`: joints along the shortest arc, joint 0 of `rest` along a line.
    #[must_use]
    pub fn towards(&self, other: &Self, skeleton: &Skeleton, rest: &RestBody, t: f64) -> Self {
        let slerp = |p: &UnitQuaternion<f64>, q: &UnitQuaternion<f64>| {
            p * exp_so3(&(log_so3(&(p.inverse() * q)) * t))
        };
        let lerp = |(x, y): (&f64, &f64)| x + (y - x) * t;
        let mut angles: Vec<f64> = self.angles.iter().zip(&other.angles).map(lerp).collect();
        for (j, joint) in skeleton.joints().iter().enumerate() {
            if matches!(joint.motion, JointMotion::Ball { .. }) {
                let at = skeleton.dof_offset(j);
                let [p, q] = [self, other].map(|pose| exp_so3(&pose.rotation_vector(skeleton, j)));
                angles[at..at + 3].copy_from_slice(log_so3(&slerp(&p, &q)).as_slice());
            }
        }

        let pivot = rest.joints[0];
        let [from, to] = [self, other].map(|pose| pose.root.point(&pivot).coords);
        let rotation = slerp(&self.root.iso().rotation, &other.root.iso().rotation);
        let translation = from + (to - from) * t - rotation * pivot.coords;
        Self {
            root: Rigid::from_parts(translation, rotation),
            angles,
        }
    }
    /// Has finite numbers only.
    pub fn is_finite(&self) -> bool {
        self.root.is_finite() && self.angles.iter().all(|a| a.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decoded_glb::posed_meshes;
    use crate::{BodyShape, SkinWeights, embedded, skin};
    use nalgebra::distance;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use std::path::Path;
    use tryon_formats::gltf::{
        GlbInterpolation, GlbJoint, GlbJointMotion, GlbMesh, GlbMorphMotion, GlbMorphTarget,
        SkinnedGlb, SkinnedMesh, encode_skinned_glb,
    };
    use tryon_geometry::math::{P3, V3, World};
    use tryon_geometry::mesh::Face;
    use tryon_geometry::par::Par;

    /// Times of the poses.
    const SECONDS: [f64; 3] = [0.0, 0.04, 0.08];

    /// Poses over time of a rest surface that has displacements of its own at each time.
    struct Clip<'a> {
        skeleton: &'a Skeleton,
        rest: &'a RestBody,
        weights: &'a SkinWeights,
        faces: &'a [Face],
        poses: Vec<Pose<World>>,
        /// Shape `[times][vertices]`.
        frames: Vec<Vec<V3>>,
    }

    impl Clip<'_> {
        /// Fills poses, within the limits of joints, and displacements at random.
        fn randomise(&mut self, rng: &mut Pcg64Mcg) {
            for _ in SECONDS {
                let mut vector = |size: f64| Vector3::from_fn(|_, _| rng.random_range(-size..size));
                let root = Rigid::from_parts(vector(2.0), exp_so3(&vector(1.5)));
                let mut pose = Pose::rest(self.skeleton, root);
                for (angle, [lo, hi]) in pose.angles.iter_mut().zip(self.skeleton.limits()) {
                    *angle = lo + (hi - lo) * rng.random::<f64>();
                }
                self.poses.push(pose);
                let mut delta = || V3::from_fn(|_, _| rng.random_range(-0.02..0.02));
                let frame = self.rest.vertices.iter().map(|_| delta()).collect();
                self.frames.push(frame);
            }
        }

        /// The clip as glTF: the body with its displacements, and its bare rest surface.
        fn glb(&self) -> Vec<u8> {
            let joints: Vec<GlbJoint<'_>> = self
                .skeleton
                .joints()
                .iter()
                .zip(&self.rest.joints)
                .map(|(joint, rest)| GlbJoint {
                    name: &joint.name,
                    parent: joint.parent,
                    rest: *rest,
                })
                .collect();
            let roots = self
                .poses
                .iter()
                .map(|p| p.root.point(&self.rest.joints[0]));
            let roots: Vec<_> = roots.collect();
            let rotations = self.poses.iter().map(|p| p.local_rotations(self.skeleton));
            let rotations: Vec<_> = rotations.collect();
            let names = ["frame 0", "frame 1", "frame 2"];
            let targets: Vec<GlbMorphTarget<'_>> = names
                .iter()
                .zip(&self.frames)
                .map(|(name, deltas)| GlbMorphTarget { name, deltas })
                .collect();
            let one_a_frame = [
                vec![1.0, 0.0, 0.0],
                vec![0.0, 1.0, 0.0],
                vec![0.0, 0.0, 1.0],
            ];

            let bare = SkinnedMesh {
                surface: GlbMesh {
                    name: "bare",
                    vertices: &self.rest.vertices,
                    faces: self.faces,
                    uv: &[],
                    color: [200, 150, 120],
                    texture: &[],
                },
                colors: &[],
                joints: &self.weights.joints,
                weights: &self.weights.weights,
                targets: &[],
                target_weights: &[],
                target_motion: None,
            };
            let displaced = SkinnedMesh {
                surface: GlbMesh {
                    name: "displaced",
                    ..bare.surface
                },
                targets: &targets,
                target_motion: Some(GlbMorphMotion {
                    seconds: &SECONDS,
                    weights: &one_a_frame,
                    interpolation: GlbInterpolation::Step,
                }),
                ..bare
            };
            let scene = SkinnedGlb {
                joints: &joints,
                meshes: &[displaced, bare],
                motion: Some(GlbJointMotion {
                    seconds: &SECONDS,
                    roots: &roots,
                    rotations: &rotations,
                }),
            };
            encode_skinned_glb(&scene, Path::new("clip.glb")).expect("encodes")
        }

        /// Skinned vertices of a rest surface at a time.
        fn skinned(&self, time: usize, rest: &[P3]) -> Vec<P3> {
            let (mut bones, mut out) = (BoneTransforms::default(), Vec::new());
            self.poses[time].bones(self.skeleton, self.rest, &mut bones);
            skin(Par::Seq, rest, self.weights, &bones, &mut out);
            out
        }
    }

    #[test]
    fn a_pose_on_the_way_to_another_starts_and_ends_at_them_and_turns_evenly() {
        let template = embedded::template();
        let (skeleton, rest) = (
            template.skeleton(),
            template.personalise(&Default::default()),
        );
        let turned = |angle: f64, height: f64| {
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
            let pelvis = Vector3::new(0.0, height, 0.0);
            let root = Rigid::from_parts(pelvis - rotation * rest.joints[0].coords, rotation);
            let mut pose = Pose::<World>::rest(skeleton, root);
            pose.set(skeleton, "left_shoulder", &[0.0, 0.0, -angle]);
            pose.set(skeleton, "left_elbow", &[angle]);
            pose
        };
        let (a, b) = (turned(0.2, 0.0), turned(1.2, 0.5));
        let joints = |pose: &Pose<World>| {
            let mut bones = BoneTransforms::default();
            pose.bones(skeleton, &rest, &mut bones);
            bones.joints
        };
        let apart = |p: &Pose<World>, q: &Pose<World>| {
            let (p, q) = (joints(p), joints(q));
            let pairs = p.iter().zip(&q);
            pairs.map(|(p, q)| distance(p, q)).fold(0.0, f64::max)
        };
        assert!(apart(&a.towards(&b, skeleton, &rest, 0.0), &a) < 1e-12);
        assert!(apart(&a.towards(&b, skeleton, &rest, 1.0), &b) < 1e-12);
        // About one axis the half-way pose is that of half the angle.
        let middle = a.towards(&b, skeleton, &rest, 0.5);
        assert!(apart(&middle, &turned(0.7, 0.25)) < 1e-12);
    }

    #[test]
    fn a_skinned_gltf_file_reproduces_poses() {
        let template = embedded::template();
        let shape = BodyShape {
            coefficients: vec![1.5, -1.0],
            ..BodyShape::default()
        };
        let mut clip = Clip {
            skeleton: template.skeleton(),
            rest: &template.personalise(&shape),
            weights: template.weights(),
            faces: template.mesh().faces(),
            poses: Vec::new(),
            frames: Vec::new(),
        };
        clip.randomise(&mut Pcg64Mcg::seed_from_u64(7));

        let bytes = clip.glb();
        for (time, seconds) in SECONDS.iter().enumerate() {
            let rest = &clip.rest.vertices;
            let moved = rest.iter().zip(&clip.frames[time]).map(|(p, d)| p + d);
            let moved: Vec<P3> = moved.collect();
            let found = posed_meshes(&bytes, *seconds as f32);
            assert_eq!(found.len(), 2);
            for (mesh, rest) in found.iter().zip([&moved, rest]) {
                let expected = clip.skinned(time, rest);
                assert_eq!(mesh.vertices.len(), expected.len());
                for (i, (p, q)) in mesh.vertices.iter().zip(&expected).enumerate() {
                    let error = distance(p, q);
                    assert!(error < 1e-5, "{}, vertex {i}: {error} m", mesh.name);
                }
            }
        }
    }
}
