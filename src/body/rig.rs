//! A skeleton for a bare mesh: joints and skinning weights from a template that has been fitted to it.

use super::{
    BodyError, BoneTransforms, Joint, JointMotion, RestBody, Skeleton, SkinWeights, Template,
};
use crate::math::P3;
use crate::mesh::{Topology, TriMesh, vertex_normals};
use crate::par::Par;
use crate::spatial::PointTree;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Template vertices further than this from a mesh vertex say nothing about it, metres: a template that lies on the
/// mesh is within 5 cm even where hair or shoes stand off.
const REACH: f32 = 0.15;
/// Normals that differ by more than this cosine belong to another side: the inside of the other thigh, the chest
/// behind an arm.
const SAME_SIDE: f32 = 0.3;
/// Rounds of averaging over neighbours: nearest vertices jump, skin bends gradually.
const SMOOTHING: usize = 4;

/// Makes a template of `mesh` (y up, facing +z, metres), whose rest pose is the mesh as it is. `fitted` is `template`
/// posed on it: the bones that put it there and its vertices, both in the mesh's frame.
///
/// Hinges keep their axes and ranges, counted from the mesh's pose; balls are free, for their limits are boxes in the
/// template's own rest pose and mean nothing in another.
///
/// # Errors
/// Names the first vertex with no part of the fitted template near it, or what is wrong with the mesh.
pub fn rig(
    name: &str,
    mesh: TriMesh,
    template: &Template,
    bones: &BoneTransforms,
    fitted: &RestBody,
) -> Result<Template, BodyError> {
    let array = |array: &str, got: usize, expected: usize| BodyError::Array {
        array: array.into(),
        why: format!("{got} entries for {expected}"),
    };
    let joints = template.skeleton().joints();
    if bones.joints.len() != joints.len() || bones.bones.len() != joints.len() {
        return Err(array("bones", bones.joints.len(), joints.len()));
    }
    if fitted.vertices.len() != template.mesh().vertices().len() {
        return Err(array(
            "fitted",
            fitted.vertices.len(),
            template.mesh().vertices().len(),
        ));
    }
    let skeleton = Skeleton::new(
        joints
            .iter()
            .enumerate()
            .map(|(j, joint)| Joint {
                rest: bones.joints[j],
                motion: turned(&joint.motion, &bones.bones[j].rotation),
                ..joint.clone()
            })
            .collect(),
    )?;
    let topology = Topology::new(&mesh)?;
    let (mut own, mut theirs) = (Vec::new(), Vec::new());
    vertex_normals(
        Par::Seq,
        mesh.vertices(),
        mesh.faces(),
        topology.vertex_faces(),
        &mut own,
    );
    let t = template.mesh();
    vertex_normals(
        Par::Seq,
        &fitted.vertices,
        t.faces(),
        template.topology().vertex_faces(),
        &mut theirs,
    );
    // Six numbers would need another tree; a step back along the normal keeps the other side of a limb further away.
    let shifted: Vec<P3> = fitted
        .vertices
        .iter()
        .zip(&theirs)
        .map(|(p, n)| p + n * (REACH * SAME_SIDE))
        .collect();
    let tree = PointTree::new(&shifted);
    let mut rows = Vec::with_capacity(own.len());
    for (vertex, (p, n)) in mesh.vertices().iter().zip(&own).enumerate() {
        let Some((near, _)) = tree.nearest(&(p + n * (REACH * SAME_SIDE)), REACH) else {
            return Err(BodyError::Vertex {
                vertex,
                why: "no part of the fitted template is near it".into(),
            });
        };
        let w = template.weights();
        let mut row = vec![0.0; joints.len()];
        for k in 0..4 {
            row[usize::from(w.joints[near][k])] += f64::from(w.weights[near][k]);
        }
        rows.push(row);
    }
    for _ in 0..SMOOTHING {
        rows = (0..rows.len())
            .map(|i| {
                let around = topology.vertex_neighbours().row(i);
                let share = 1.0 / (1 + around.len()) as f64;
                let mut row = rows[i].clone();
                for j in around {
                    row.iter_mut()
                        .zip(&rows[*j as usize])
                        .for_each(|(a, b)| *a += b);
                }
                row.iter_mut().for_each(|a| *a *= share);
                row
            })
            .collect();
    }
    let weights = SkinWeights::from_rows(
        rows.into_iter()
            .map(|row| row.into_iter().enumerate().collect()),
    )?;
    Template::new(name, mesh, skeleton, weights, None)
}

/// A joint's motion where its bone has been turned by `q`.
fn turned(motion: &JointMotion, q: &nalgebra::UnitQuaternion<f64>) -> JointMotion {
    match motion {
        JointMotion::Fixed => JointMotion::Fixed,
        JointMotion::Hinge { axis, limits } => JointMotion::Hinge {
            axis: (q * Vector3::from(*axis)).normalize().into(),
            limits: *limits,
        },
        JointMotion::Ball { .. } => JointMotion::Ball {
            limits: [[-PI, PI]; 3],
        },
    }
}
