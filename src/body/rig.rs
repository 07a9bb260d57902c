//! Rigging of a bare mesh: joints and skinning weights from a template that has been fitted to it.

use super::settings::RigSettings;
use super::{
    BodyError, BoneTransforms, Joint, JointMotion, RestBody, Skeleton, SkinSearch, SkinWeights,
    Template,
};
use nalgebra::Vector3;
use std::f64::consts::PI;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::smoothing::mean;
use tryon_geometry::mesh::{Topology, TriMesh, vertex_normals};
use tryon_geometry::par::Par;

/// Passes of smoothing of the weights: nearest vertices jump, skin bends gradually.
const SMOOTHING: usize = 4;

/// Makes a template of `mesh` (y up, facing +z, metres), whose rest pose is the mesh as it is. `fitted` is `template`
/// posed on it: the bones that put it there and its vertices, both in the mesh's frame.
///
/// Hinges keep their axes and ranges, counted from the mesh's pose. Balls are free: their limits are boxes in the
/// template's own rest pose and mean nothing in another.
///
/// # Errors
/// Names the first vertex with no part of the fitted template near it, or the fault of the mesh.
pub fn rig(
    name: &str,
    mesh: TriMesh,
    template: &Template,
    bones: &BoneTransforms,
    fitted: &RestBody,
) -> Result<Template, BodyError> {
    let check = |array: &str, got: usize, expected: usize| match got == expected {
        true => Ok(()),
        false => Err(BodyError::Array {
            array: array.into(),
            why: format!("{got} entries for {expected}"),
        }),
    };
    let joints = template.skeleton().joints();
    check("bones", bones.joints.len(), joints.len())?;
    check("bones", bones.bones.len(), joints.len())?;
    let vertices = template.mesh().vertices().len();
    check("fitted", fitted.vertices.len(), vertices)?;
    let posed = joints.iter().enumerate().map(|(j, joint)| Joint {
        rest: bones.joints[j],
        motion: turned(&joint.motion, &bones.bones[j].rotation),
        ..joint.clone()
    });
    let skeleton = Skeleton::new(posed.collect())?;
    let topology = Topology::new(&mesh)?;
    let mut rows = nearest_weights(&mesh, &topology, template, fitted)?;
    for _ in 0..SMOOTHING {
        rows = (0..rows.len())
            .filter_map(|i| {
                let around = topology.vertex_neighbours().row(i).iter();
                mean(std::iter::once(&rows[i]).chain(around.map(|v| &rows[*v as usize])))
            })
            .collect();
    }
    let rows = rows.into_iter();
    let weights = SkinWeights::from_rows(rows.map(|row| row.into_iter().enumerate().collect()))?;
    Template::new(name, mesh, skeleton, weights, None)
}

/// Weights of the nearest vertex of the fitted template on the same side, shape `[vertices][joints]`.
fn nearest_weights(
    mesh: &TriMesh,
    topology: &Topology,
    template: &Template,
    fitted: &RestBody,
) -> Result<Vec<Vec<f64>>, BodyError> {
    let settings = RigSettings::default();
    let skin = SkinSearch::new(template, &fitted.vertices, settings.reach * settings.shift);
    let mut normals = Vec::new();
    let (vertices, around) = (mesh.vertices(), topology.vertex_faces());
    vertex_normals(Par::Seq, vertices, mesh.faces(), around, &mut normals);
    let row = |(vertex, (p, normal)): (usize, (&P3, &V3))| {
        let Some((near, _)) = skin.nearest(p, normal, settings.reach) else {
            return Err(BodyError::Vertex {
                vertex,
                why: "no part of the fitted template is near it".into(),
            });
        };
        let row = template.weights().row(near, template.skeleton().len());
        Ok(row.into_iter().map(f64::from).collect())
    };
    vertices.iter().zip(&normals).enumerate().map(row).collect()
}

/// Motion of a joint after a turn of its bone by `q`.
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
