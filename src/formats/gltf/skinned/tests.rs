use super::super::srgb;
use super::animation::continuous;
use super::decoded::{PosedMesh, posed_meshes};
use super::joints::influences;
use super::*;
use crate::gltf::{GlbMesh, parse_gltf};
use nalgebra::UnitQuaternion;
use std::f64::consts::FRAC_PI_2;
use tryon_geometry::math::{P3, P3d, V3, V3d};
use tryon_geometry::mesh::Face;

const AT: &str = "wear.glb";
const FACES: [Face; 1] = [[0, 1, 2]];
const POINTS: [P3; 3] = [
    P3::new(0.0, 2.0, 0.0),
    P3::new(1.0, 2.0, 0.0),
    P3::new(0.0, 2.0, 1.0),
];
const JOINTS: [GlbJoint<'_>; 2] = [
    GlbJoint {
        name: "pelvis",
        parent: None,
        rest: P3d::new(0.0, 0.5, 0.0),
    },
    GlbJoint {
        name: "chest",
        parent: Some(0),
        rest: P3d::new(0.0, 1.0, 0.0),
    },
];

/// A triangle bound to the chest, its last vertex half to the pelvis.
const SHIRT: SkinnedMesh<'_> = SkinnedMesh {
    surface: GlbMesh {
        name: "shirt",
        vertices: &POINTS,
        faces: &FACES,
        uv: &[],
        color: [255; 3],
        texture: &[],
    },
    colors: &[],
    joints: &[[1, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]],
    weights: &[
        [1.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.5, 0.5, 0.0, 0.0],
    ],
    targets: &[
        GlbMorphTarget {
            name: "up",
            deltas: &[V3::new(0.0, 1.0, 0.0); 3],
        },
        GlbMorphTarget {
            name: "ahead",
            deltas: &[V3::new(0.0, 0.0, 2.0); 3],
        },
    ],
    target_weights: &[],
    target_motion: None,
};

/// In one second, the chest turns by a right angle about z and the pelvis shifts by one metre along x.
fn encoded(mesh: SkinnedMesh<'_>) -> Result<Vec<u8>, FormatError> {
    let turn = UnitQuaternion::from_axis_angle(&V3d::z_axis(), FRAC_PI_2);
    let still = UnitQuaternion::identity();
    let motion = GlbJointMotion {
        seconds: &[0.0, 1.0],
        roots: &[P3d::new(0.0, 0.5, 0.0), P3d::new(1.0, 0.5, 0.0)],
        rotations: &[vec![still, still], vec![still, turn]],
    };
    let scene = SkinnedGlb {
        joints: &JOINTS,
        meshes: &[mesh],
        motion: Some(motion),
    };
    encode_skinned_glb(&scene, Path::new(AT))
}

/// The one mesh of [`encoded`] at a time.
fn posed(bytes: &[u8], seconds: f32) -> PosedMesh {
    let mut meshes = posed_meshes(bytes, seconds);
    assert_eq!((meshes.len(), meshes[0].name.as_str()), (1, "shirt"));
    meshes.remove(0)
}

fn assert_near(found: &P3, expected: [f32; 3]) {
    let distance = (found - P3::from(expected)).norm();
    assert!(distance < 1e-6, "{found}, expected {expected:?}");
}

#[test]
fn joints_move_vertices_about_their_rest_positions() {
    let bytes = encoded(SHIRT).expect("encodes");
    let rest = posed(&bytes, 0.0);
    assert_eq!(rest.vertices, POINTS);
    let turned = posed(&bytes, 1.0);
    assert_near(&turned.vertices[0], [0.0, 1.0, 0.0]);
    assert_near(&turned.vertices[1], [0.0, 2.0, 0.0]);
    assert_near(&turned.vertices[2], [0.5, 1.5, 1.0]);
    let half = 0.5f32.sqrt();
    let between = posed(&bytes, 0.5);
    assert_near(&between.vertices[0], [0.5 - half, 1.0 + half, 0.0]);

    let plain = parse_gltf(&bytes, Path::new(AT)).expect("reads");
    assert_eq!(plain.mesh.vertices(), POINTS);
    assert!(plain.parts[0].double_sided);
}

#[test]
fn morph_weights_follow_their_interpolation() {
    let weights = [vec![1.0, 0.0], vec![0.0, 1.0]];
    let lift = |interpolation, seconds| {
        let motion = GlbMorphMotion {
            seconds: &[0.0, 0.5],
            weights: &weights,
            interpolation,
        };
        let bytes = encoded(SkinnedMesh {
            target_motion: Some(motion),
            ..SHIRT
        });
        let p = posed(&bytes.expect("encodes"), seconds).vertices[0];
        [p.y, p.z]
    };
    assert_eq!(lift(GlbInterpolation::Step, 0.0), [3.0, 0.0]);
    assert_eq!(lift(GlbInterpolation::Linear, 0.0), [3.0, 0.0]);
    assert_eq!(lift(GlbInterpolation::Step, 0.25)[1], 0.0);
    assert_eq!(lift(GlbInterpolation::Linear, 0.25)[1], 1.0);
    assert_eq!(lift(GlbInterpolation::Step, 0.5)[1], 2.0);
}

#[test]
fn targets_have_names_and_weights() {
    let mesh = SkinnedMesh {
        target_weights: &[0.5, 0.25],
        ..SHIRT
    };
    let bytes = encoded(mesh).expect("encodes");
    assert_near(&posed(&bytes, 0.0).vertices[0], [0.0, 2.5, 0.5]);
    let length = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
    let json: serde_json::Value =
        serde_json::from_slice(&bytes[20..20 + length]).expect("a JSON chunk");
    let names = &json["meshes"][0]["extras"]["targetNames"];
    assert_eq!(*names, serde_json::json!(["up", "ahead"]));
}

#[test]
fn colors_are_linear_and_keep_every_byte() {
    for bytes in (0..=255u8).collect::<Vec<_>>().chunks(3) {
        let colors = [0, 1, 2].map(|k| [bytes[k % bytes.len()], 0, 255]);
        let mesh = SkinnedMesh {
            colors: &colors,
            ..SHIRT
        };
        let file = encoded(mesh);
        let found = posed(&file.expect("encodes"), 0.0).colors;
        for (color, [r, g, b, a]) in colors.iter().zip(&found) {
            let back = [*r, *g, *b].map(|c| (255.0 * srgb::encoded(c)).round() as u8);
            assert_eq!((back, *a), (*color, 1.0));
        }
    }
}

#[test]
fn influences_are_distinct_and_sum_to_one() {
    let (joints, weights) = influences([3, 5, 3, 9], [0.2, 0.4, 0.4, 0.0]);
    assert_eq!(joints, [3, 5, 0, 0]);
    assert!((weights[0] - 0.6).abs() < 1e-6 && weights[2..] == [0.0, 0.0]);
    let thirds = influences([1, 2, 3, 4], [0.3333, 0.3333, 0.3333, 0.0001]).1;
    assert_eq!(
        thirds.iter().map(|w| f64::from(*w)).sum::<f64>() as f32,
        1.0
    );
}

#[test]
fn rotations_keep_their_sign() {
    let turn = |k: i32| UnitQuaternion::from_axis_angle(&V3d::x_axis(), f64::from(k) * 0.7);
    let found = continuous((0..20).map(turn));
    for pair in found.windows(2) {
        let dot: f32 = (0..4).map(|k| pair[0][k] * pair[1][k]).sum();
        assert!(dot > 0.9, "{pair:?}");
    }
}

#[test]
fn faults_name_mesh_and_array() {
    let fault = |mesh: SkinnedMesh<'_>, words: [&str; 2]| {
        let error = encoded(mesh).expect_err("a fault").to_string();
        assert!(words.iter().all(|w| error.contains(w)), "{error}");
    };
    let mut mesh = SHIRT;
    mesh.colors = &[[0; 3]];
    fault(mesh, ["`shirt`.colors", "expected 3"]);

    mesh = SHIRT;
    mesh.joints = &[[2, 0, 0, 0]; 3];
    fault(mesh, ["vertex 0", "joint 2"]);

    mesh = SHIRT;
    mesh.weights = &[[0.5, 0.4, 0.0, 0.0]; 3];
    fault(mesh, ["vertex 0", "sum one"]);
    mesh.weights = &[[f32::NAN; 4]; 3];
    fault(mesh, ["`shirt`.weights", "vertex 0"]);

    mesh = SHIRT;
    mesh.target_weights = &[1.0];
    fault(mesh, ["`shirt`.targets", "expected 2"]);
    mesh.target_weights = &[];
    mesh.target_motion = Some(GlbMorphMotion {
        seconds: &[0.5, 0.5],
        weights: &[],
        interpolation: GlbInterpolation::Linear,
    });
    fault(mesh, ["`shirt`.target_motion", "ascend"]);
}
