//! Independent evaluation of a skinned `.glb` for tests: animation, node hierarchy, morph targets, skinning.

use ::gltf::animation::Interpolation;
use ::gltf::animation::util::ReadOutputs;
use ::gltf::{Gltf, Node};
use nalgebra::{Matrix4, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tryon_geometry::math::P3;

/// Mesh at one time of the animation.
pub(crate) struct PosedMesh {
    /// Its name.
    pub(crate) name: String,
    /// Skinned vertices in the world (m).
    pub(crate) vertices: Vec<P3>,
    /// Linear colours with opacity; empty without COLOR_0.
    pub(crate) colors: Vec<[f32; 4]>,
}

/// Moving properties of one node.
#[derive(Clone)]
struct NodeValues {
    translation: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    weights: Vec<f32>,
}

/// Skinned meshes of a file at a time, in the order of its nodes.
pub(crate) fn posed_meshes(bytes: &[u8], seconds: f32) -> Vec<PosedMesh> {
    let file = Gltf::from_slice(bytes).expect("valid glTF");
    let mut values: Vec<NodeValues> = file.nodes().map(|n| rest_values(&n)).collect();
    for animation in file.animations() {
        for channel in animation.channels() {
            animate(&file, &channel, seconds, &mut values);
        }
    }

    let mut world = vec![Matrix4::identity(); values.len()];
    let scene = file.default_scene().expect("a scene");
    for root in scene.nodes() {
        place(&root, &Matrix4::identity(), &values, &mut world);
    }
    let meshes = file.nodes().filter(|n| n.mesh().is_some());
    meshes
        .map(|n| posed_mesh(&file, &n, &values[n.index()].weights, &world))
        .collect()
}

fn rest_values(node: &Node<'_>) -> NodeValues {
    let (translation, [x, y, z, w], _) = node.transform().decomposed();
    NodeValues {
        translation: Vector3::from(translation).cast(),
        rotation: UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z).cast()),
        weights: node
            .mesh()
            .and_then(|m| m.weights().map(<[f32]>::to_vec))
            .unwrap_or_default(),
    }
}

/// Sets the property of a channel.
fn animate(
    file: &Gltf,
    channel: &::gltf::animation::Channel<'_>,
    seconds: f32,
    values: &mut [NodeValues],
) {
    let reader = channel.reader(|_| file.blob.as_deref());
    let times: Vec<f32> = reader.read_inputs().expect("times").collect();
    let after = times.iter().position(|t| *t > seconds);
    let next = after.unwrap_or(times.len() - 1);
    let last = after.map_or(next, |k| k.saturating_sub(1));
    let step = (times[next] - times[last]).max(f32::MIN_POSITIVE);
    let share = match channel.sampler().interpolation() {
        Interpolation::Linear => (seconds - times[last]) / step,
        _ => 0.0,
    };
    let share = share.clamp(0.0, 1.0);

    let node = &mut values[channel.target().node().index()];
    match reader.read_outputs().expect("values") {
        ReadOutputs::Translations(rows) => {
            let rows: Vec<_> = rows.map(|v| Vector3::from(v).cast::<f64>()).collect();
            node.translation = rows[last].lerp(&rows[next], f64::from(share));
        }
        ReadOutputs::Rotations(rows) => {
            let rows: Vec<_> = rows.into_f32().collect();
            assert!(rows.iter().all(|q| (norm(q) - 1.0).abs() < 1e-6));
            let [a, b] = [last, next].map(|k| {
                let [x, y, z, w] = rows[k].map(f64::from);
                UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
            });
            node.rotation = a.slerp(&b, f64::from(share));
        }
        ReadOutputs::MorphTargetWeights(rows) => {
            let rows: Vec<f32> = rows.into_f32().collect();
            let targets = rows.len() / times.len();
            let weight = |k: usize, row: usize| rows[row * targets + k];
            node.weights = (0..targets)
                .map(|k| (1.0 - share) * weight(k, last) + share * weight(k, next))
                .collect();
        }
        ReadOutputs::Scales(_) => panic!("joints are rigid"),
    }
}

fn norm(q: &[f32; 4]) -> f32 {
    q.iter().map(|c| c * c).sum::<f32>().sqrt()
}

/// Transforms of a node and its children to the world.
fn place(node: &Node<'_>, above: &Matrix4<f64>, values: &[NodeValues], world: &mut [Matrix4<f64>]) {
    let v = &values[node.index()];
    let local = Translation3::from(v.translation).to_homogeneous() * v.rotation.to_homogeneous();
    let here = above * local;
    world[node.index()] = here;
    for child in node.children() {
        place(&child, &here, values, world);
    }
}

/// Morphs and skins a mesh; its node's own transform has no effect (glTF 2.0, section 3.7.3.3).
fn posed_mesh(
    file: &Gltf,
    node: &Node<'_>,
    target_weights: &[f32],
    world: &[Matrix4<f64>],
) -> PosedMesh {
    let blob = |_: ::gltf::Buffer<'_>| file.blob.as_deref();
    let (mesh, skin) = (node.mesh().expect("a mesh"), node.skin().expect("a skin"));
    let inverse = skin.reader(blob).read_inverse_bind_matrices();
    let inverse = inverse.expect("inverse bind matrices");
    let joints = skin.joints().zip(inverse);
    let bones: Vec<Matrix4<f64>> = joints
        .map(|(joint, m)| world[joint.index()] * Matrix4::from(m).cast::<f64>())
        .collect();

    let primitive = mesh.primitives().next().expect("a primitive");
    let reader = primitive.reader(blob);
    let positions = reader.read_positions().expect("positions");
    let mut rest: Vec<Point3<f64>> = positions.map(|p| Point3::from(p).cast()).collect();
    for ((deltas, _, _), weight) in reader.read_morph_targets().zip(target_weights) {
        let deltas = deltas.expect("deltas");
        for (p, d) in rest.iter_mut().zip(deltas) {
            *p += Vector3::from(d).cast::<f64>() * f64::from(*weight);
        }
    }

    let joints = reader.read_joints(0).expect("JOINTS_0").into_u16();
    let weights = reader.read_weights(0).expect("WEIGHTS_0").into_f32();
    let vertices = rest.iter().zip(joints.zip(weights)).map(|(p, (j, w))| {
        let blended: Matrix4<f64> = (0..4)
            .map(|k| bones[usize::from(j[k])] * f64::from(w[k]))
            .sum();
        blended.transform_point(p).cast()
    });
    PosedMesh {
        name: mesh.name().unwrap_or_default().to_owned(),
        vertices: vertices.collect(),
        colors: reader
            .read_colors(0)
            .map(|c| c.into_rgba_f32().collect())
            .unwrap_or_default(),
    }
}
