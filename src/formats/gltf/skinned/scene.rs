//! Contents of a skinned glTF file: joints, meshes and their motion. Metres, seconds, y up.

use super::super::surface::GlbMesh;
use nalgebra::UnitQuaternion;
use tryon_geometry::math::{P3d, V3};

/// Meshes on one skeleton, and the motion of its joints.
#[derive(Clone, Copy, Debug)]
pub struct SkinnedGlb<'a> {
    /// Skeleton in the rest pose, parents before children, at most 256.
    pub joints: &'a [GlbJoint<'a>],
    /// Body and garments.
    pub meshes: &'a [SkinnedMesh<'a>],
    /// Motion of the joints; without it the meshes stay in the rest pose.
    pub motion: Option<GlbJointMotion<'a>>,
}

/// Joint of the skeleton; in the rest pose its axes are those of the world.
#[derive(Clone, Copy, Debug)]
pub struct GlbJoint<'a> {
    /// Name of its node.
    pub name: &'a str,
    /// Index of the parent, smaller than the joint's own; `None` for joint 0 only.
    pub parent: Option<usize>,
    /// Position in the rest pose, in the coordinates of the meshes.
    pub rest: P3d,
}

/// Rotations of all joints over time, interpolated along great circles.
#[derive(Clone, Copy, Debug)]
pub struct GlbJointMotion<'a> {
    /// Times, ascending from zero or later, shape `[times]`.
    pub seconds: &'a [f64],
    /// Positions of joint 0 in the world, shape `[times]`.
    pub roots: &'a [P3d],
    /// Rotations of the joints relative to their parents, of joint 0 relative to the world, shape `[times][joints]`.
    pub rotations: &'a [Vec<UnitQuaternion<f64>>],
}

/// Mesh that linear blend skinning binds to the joints; morph targets apply before it.
#[derive(Clone, Copy, Debug)]
pub struct SkinnedMesh<'a> {
    /// Surface in the rest pose; normals are computed.
    pub surface: GlbMesh<'a>,
    /// Vertex colours, sRGB, which multiply the base colour in linear light, shape `[vertices]`; empty for none.
    pub colors: &'a [[u8; 3]],
    /// Joints of each vertex, shape `[vertices]`.
    pub joints: &'a [[u8; 4]],
    /// Skinning weights of these joints, sum one, shape `[vertices]`.
    pub weights: &'a [[f32; 4]],
    /// Morph targets; empty for none.
    pub targets: &'a [GlbMorphTarget<'a>],
    /// Weights of the targets without motion, shape `[targets]`; empty for zeros.
    pub target_weights: &'a [f32],
    /// Weights of the targets over time.
    pub target_motion: Option<GlbMorphMotion<'a>>,
}

/// Displacements of a mesh in the rest pose.
#[derive(Clone, Copy, Debug)]
pub struct GlbMorphTarget<'a> {
    /// Its name.
    pub name: &'a str,
    /// Displacements at weight one, shape `[vertices]`.
    pub deltas: &'a [V3],
}

/// Weights of the morph targets of a mesh over time.
///
/// A captured frame as its own target has weight one at its time and zero at all others.
#[derive(Clone, Copy, Debug)]
pub struct GlbMorphMotion<'a> {
    /// Times, ascending from zero or later, shape `[times]`.
    pub seconds: &'a [f64],
    /// Weights, shape `[times][targets]`.
    pub weights: &'a [Vec<f32>],
    /// Weights between two times.
    pub interpolation: GlbInterpolation,
}

/// Values of an animation between two of its times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GlbInterpolation {
    /// The value of the earlier time.
    Step,
    /// Linear interpolation.
    #[default]
    Linear,
}

impl GlbInterpolation {
    /// Its name in glTF.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Step => "STEP",
            Self::Linear => "LINEAR",
        }
    }
}
