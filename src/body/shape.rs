//! Personal shape: coefficients, bone scales and surface displacements, applied to a template.

use super::Template;
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{P3, V3};

/// Shape of a subject relative to the template. Default: the template itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyShape {
    /// Coefficients of [`super::ShapeSpace`], standard deviations; missing ones are zero.
    pub coefficients: Vec<f64>,
    /// Scale of the bone from each joint's parent to the joint, shape `[joints]`; empty means all one. Eq. 19.
    pub bone_scales: Vec<f64>,
    /// Displacement of each vertex along its rest normal, metres; empty means none. Eq. 13.
    pub displacements: Vec<f32>,
}

/// The template personalised, still in the rest pose.
#[derive(Clone, Debug, Default)]
pub struct RestBody {
    /// Vertices including displacements, metres, shape `[vertices]`.
    pub vertices: Vec<P3>,
    /// Vertices without displacements, shape `[vertices]`.
    pub base: Vec<P3>,
    /// Unit normals of `base` (displacements never feed back into them; paper, section 3.3).
    pub normals: Vec<V3>,
    /// Joint positions, shape `[joints]`.
    pub joints: Vec<Point3<f64>>,
}

impl Template {
    /// Applies shape coefficients, bone scales (differential bone coordinates, eq. 18–20, in the rest pose)
    /// and displacements. Missing entries of `shape` count as neutral.
    pub fn personalise(&self, shape: &BodyShape) -> RestBody {
        let all: Vec<u32> = (0..self.mesh().vertices().len() as u32).collect();
        let (mut vertices, joints) = self.personalise_some(shape, &all);
        let normals = self.normals(&vertices);
        let base = vertices.clone();
        for (p, (n, &d)) in vertices
            .iter_mut()
            .zip(normals.iter().zip(&shape.displacements))
        {
            *p += n * d;
        }
        RestBody {
            vertices,
            base,
            normals,
            joints,
        }
    }

    /// Some vertices of [`Template::personalise`]'s `base`, in the order of `which` (indices within the mesh), and all
    /// joints, metres.
    pub fn personalise_some(
        &self,
        shape: &BodyShape,
        which: &[u32],
    ) -> (Vec<P3>, Vec<Point3<f64>>) {
        let mut vertices: Vec<P3> = which
            .iter()
            .map(|&i| self.mesh().vertices()[i as usize])
            .collect();
        let mut joints: Vec<Point3<f64>> =
            self.skeleton().joints().iter().map(|j| j.rest).collect();
        if let Some(space) = self.shape_space() {
            for (d, &c) in shape
                .coefficients
                .iter()
                .enumerate()
                .take(space.vertices.len())
            {
                if c != 0.0 {
                    let c32 = c as f32;
                    let offsets = which.iter().map(|&i| space.vertices[d][i as usize]);
                    vertices
                        .iter_mut()
                        .zip(offsets)
                        .for_each(|(p, o)| *p += o * c32);
                    joints
                        .iter_mut()
                        .zip(&space.joints[d])
                        .for_each(|(p, o)| *p += o * c);
                }
            }
        }
        if shape.bone_scales.iter().any(|s| *s != 1.0) {
            self.scale_bones(&shape.bone_scales, which, &mut vertices, &mut joints);
        }
        (vertices, joints)
    }

    /// Stretches each bone along itself. A vertex moves with the foot of its perpendicular on each controlling
    /// bone (γ of eq. 18), so that cross-sections keep their size.
    fn scale_bones(
        &self,
        scales: &[f64],
        which: &[u32],
        vertices: &mut [P3],
        joints: &mut [Point3<f64>],
    ) {
        let skeleton = self.skeleton();
        let scale = |j: usize| scales.get(j).copied().unwrap_or(1.0);
        let old = joints.to_vec();
        for (j, joint) in skeleton.joints().iter().enumerate() {
            if let Some(p) = joint.parent {
                joints[j] = joints[p] + (old[j] - old[p]) * scale(j);
            }
        }
        let w = self.weights();
        for (&i, v) in which.iter().zip(vertices) {
            let i = i as usize;
            let mut offset = Vector3::zeros();
            for k in 0..4 {
                let weight = f64::from(w.weights[i][k]);
                if weight == 0.0 {
                    continue;
                }
                let j = usize::from(w.joints[i][k]);
                let mut foot = joints[j] - old[j];
                if let Some(c) = skeleton.primary_child(j) {
                    let d = old[c] - old[j];
                    // Clamped: beyond its ends a bone's neighbourhood moves rigidly.
                    let t = ((v.cast::<f64>() - old[j]).dot(&d)
                        / d.norm_squared().max(f64::MIN_POSITIVE))
                    .clamp(0.0, 1.0);
                    foot += d * (t * (scale(c) - 1.0));
                }
                offset += foot * weight;
            }
            *v += offset.cast::<f32>();
        }
    }
}
