//! Bodies in other layouts, units, axes and hands: each is the same body, or refused with the option that says it.

use super::*;
use nalgebra::Matrix3;
use tryon_formats::mesh_frame::{MeshFrame, upright_rotation};
use tryon_formats::npz::{SmplArrays, read_smpl};
use tryon_formats::{MeshAxis, shared_data};

fn makehuman() -> Option<SmplArrays> {
    let path = shared_data("body/makehuman_smpl_layout/template.npz")?;
    Some(read_smpl(path).expect("readable"))
}

/// The arrays after a linear map, as another program writes them.
fn mapped(arrays: &SmplArrays, map: Matrix3<f64>) -> SmplArrays {
    let mut out = arrays.clone();
    let single = |p: &mut [f32; 3]| {
        *p = (map * Vector3::from(p.map(f64::from)))
            .map(|c| c as f32)
            .into()
    };
    out.vertices.iter_mut().for_each(single);
    out.shape_directions.iter_mut().flatten().for_each(single);
    out.joints
        .iter_mut()
        .for_each(|p| *p = (map * Vector3::from(*p)).into());
    out
}

fn nameless(arrays: &SmplArrays) -> SmplArrays {
    SmplArrays {
        has_names: false,
        joint_names: Vec::new(),
        ..arrays.clone()
    }
}

fn read(arrays: SmplArrays, stated: MeshFrame) -> Result<BodyFile, String> {
    body_of_arrays("body", arrays, &stated).map_err(|e| e.to_string())
}

/// Largest distance of joints and skin from the body as it is in our frame, metres.
fn miss(found: &BodyFile, right: &SmplArrays) -> f64 {
    let joints = found.template.skeleton().joints().iter().zip(&right.joints);
    let joints = joints.map(|(j, r)| (j.rest - Point3::from(*r)).norm());
    let skin = found.template.mesh().vertices().iter().zip(&right.vertices);
    let skin = skin.map(|(p, r)| f64::from((p - P3::from(*r)).norm()));
    joints.chain(skin).fold(0.0, f64::max)
}

#[test]
fn every_unit_and_every_axis_is_the_same_body() {
    let Some(right) = makehuman() else { return };
    for up in MeshAxis::ALL {
        for facing in MeshAxis::ALL {
            let Some(turn) = upright_rotation(up, facing) else {
                continue;
            };
            for (k, scale) in [1.0, 10.0, 100.0, 1000.0].into_iter().enumerate() {
                let file = mapped(&right, turn.transpose() * scale);
                let file = if k % 2 == 0 { file } else { nameless(&file) };
                let body = read(file, MeshFrame::default()).expect("a body");
                let far = miss(&body, &right);
                assert!(far < 1e-5, "{up} up, facing {facing}, times {scale}: {far}");
                let names = body.template.skeleton().joints()[..22]
                    .iter()
                    .map(|j| &j.name);
                assert!(names.eq(&right.joint_names));
                assert!(body.template.mesh().volume() > 0.05);
                let is_own = (up, facing, scale) == (MeshAxis::Y, MeshAxis::Z, 1.0);
                assert_eq!(body.notes.is_empty(), is_own, "{:?}", body.notes);
            }
        }
    }
}

#[test]
fn mirrored_inverted_and_misnamed_bodies_are_put_right() {
    let Some(right) = makehuman() else { return };
    let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    let mirrored = read(mapped(&right, mirror), MeshFrame::default()).expect("a body");
    assert!(miss(&mirrored, &right) < 1e-5 && mirrored.notes[0].contains("mirrored"));
    let mut inverted = right.clone();
    inverted.faces.iter_mut().for_each(|f| f.swap(0, 2));
    let inverted = read(inverted, MeshFrame::default()).expect("a body");
    assert!(inverted.template.mesh().volume() > 0.05 && inverted.notes[0].contains("inwards"));
    let mut misnamed = right.clone();
    for name in &mut misnamed.joint_names {
        *name = match (name.strip_prefix("left_"), name.strip_prefix("right_")) {
            (Some(part), _) => format!("right_{part}"),
            (_, Some(part)) => format!("left_{part}"),
            _ => continue,
        };
    }
    let misnamed = read(misnamed, MeshFrame::default()).expect("a body");
    let s = misnamed.template.skeleton();
    assert!(s.joints()[s.index("left_hip").expect("named")].rest.x > 0.05);
}

#[test]
fn pose_blend_shapes_turn_with_the_body() {
    let Some(mut right) = makehuman() else { return };
    let features = 9 * (right.parents.len() - 1);
    let count = right.vertices.len() * 3 * features;
    right.pose_directions.of_pose = (0..count)
        .map(|k| ((k * 7919) % 1009) as f32 * 1e-6)
        .collect();
    let turn =
        upright_rotation("z".parse().expect("axis"), "-y".parse().expect("axis")).expect("square");
    let (back, scale) = (turn.transpose(), 100.0);
    // The file's directions by the definition: its offsets are back · offset, its rotations back · R · backᵀ.
    let mut file = mapped(&right, back * scale);
    let block = |v: usize, c: usize, j: usize| {
        let at = (v * 3 + c) * features + 9 * j;
        Matrix3::from_row_slice(&right.pose_directions.of_pose[at..at + 9]).map(f64::from)
    };
    for v in (0..right.vertices.len()).step_by(997) {
        for j in 0..features / 9 {
            for c in 0..3 {
                let sum: Matrix3<f64> = (0..3).map(|k| block(v, k, j) * back[(c, k)]).sum();
                let entries = back * sum * back.transpose() * scale;
                let at = (v * 3 + c) * features + 9 * j;
                for (k, e) in entries.transpose().iter().enumerate() {
                    file.pose_directions.of_pose[at + k] = *e as f32;
                }
            }
        }
    }
    let body = read(file, MeshFrame::default()).expect("a body");
    let plain = read(right.clone(), MeshFrame::default()).expect("a body");
    let mut pose = crate::Pose::<tryon_geometry::math::Body>::rest(
        plain.template.skeleton(),
        tryon_geometry::math::Rigid::identity(),
    );
    pose.set(
        plain.template.skeleton(),
        "left_shoulder",
        &[0.4, -0.3, 0.7],
    );
    let mut bones = crate::BoneTransforms::default();
    let rest = plain.template.personalise(&crate::BodyShape::default());
    pose.bones(plain.template.skeleton(), &rest, &mut bones);
    let [a, b] = [&plain, &body].map(|f| f.template.pose_offsets(&bones).expect("bent"));
    for v in (0..right.vertices.len()).step_by(997) {
        assert!(
            (a.of(v) - b.of(v)).norm() < 1e-6,
            "{v}: {} {}",
            a.of(v),
            b.of(v)
        );
    }
}

#[test]
fn units_and_axes_that_contradict_the_body_are_refused_with_the_option() {
    let Some(right) = makehuman() else { return };
    let inches = mapped(&right, Matrix3::identity() / 0.0254);
    let why = read(inches.clone(), MeshFrame::default()).expect_err("a child of 67 cm or a person");
    assert!(
        why.contains("--unit cm") && why.contains("--unit inch"),
        "{why}"
    );
    let stated = MeshFrame {
        metres_per_unit: Some(0.0254),
        ..MeshFrame::default()
    };
    assert!(miss(&read(inches, stated).expect("a body"), &right) < 1e-5);
    let wrong_up = MeshFrame {
        up: "-y".parse().ok(),
        ..MeshFrame::default()
    };
    assert!(
        read(right.clone(), wrong_up)
            .expect_err("head below feet")
            .contains("--up y")
    );
    let wrong_way = MeshFrame {
        facing: "-z".parse().ok(),
        ..MeshFrame::default()
    };
    assert!(
        read(right.clone(), wrong_way)
            .expect_err("back to front")
            .contains("--facing z")
    );
    let lean = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), 0.7).into_inner();
    assert!(
        read(mapped(&right, lean), MeshFrame::default())
            .expect_err("leans")
            .contains("upright")
    );
    let mut open = right.clone();
    open.faces.truncate(right.faces.len() * 3 / 4);
    assert!(
        read(open, MeshFrame::default())
            .expect_err("open")
            .contains("open along")
    );
}

/// SMPL-X without names (`shared/data/reports/smplx_joint_order/make.py`): jaw and eyes follow the head, fingers the wrists.
#[test]
fn jaw_and_eyes_are_no_hands() {
    let Some(right) = makehuman() else { return };
    let body = read(smplx(&right), MeshFrame::default()).expect("a body");
    let s = body.template.skeleton();
    let names: Vec<&str> = s.joints()[..25].iter().map(|j| j.name.as_str()).collect();
    assert!(names[..22].iter().eq(&right.joint_names));
    assert_eq!(names[22..], ["jaw", "left_eye", "right_eye"]);
    let tip = s.joints()[s.index("left_hand_end").expect("named")].rest;
    let wrist = s.joints()[s.index("left_wrist").expect("named")].rest;
    assert!(
        (0.1..0.25).contains(&(tip - wrist).norm()) && tip.x > wrist.x,
        "{tip} from {wrist}"
    );
    assert!(
        s.joints()[25..55]
            .iter()
            .all(|j| j.name.contains("_finger_"))
    );
}

fn smplx(right: &SmplArrays) -> SmplArrays {
    let mut out = nameless(right);
    let (n, j) = (right.vertices.len(), right.parents.len());
    let at = |k: usize| Vector3::from(right.joints[k]);
    let head = at(15);
    for offset in [[0.0, 0.0, 0.05], [0.03, 0.07, 0.08], [-0.03, 0.07, 0.08]] {
        out.parents.push(Some(15));
        out.joints.push((head + Vector3::from(offset)).into());
    }
    for wrist in [20, 21] {
        let along = (at(wrist) - at(right.parents[wrist].unwrap_or(0))).normalize();
        for finger in 0..5 {
            let mut parent = wrist;
            for k in 0..3 {
                let across = Vector3::new(0.0, 0.0, (f64::from(finger) - 2.0) * 0.015);
                out.joints
                    .push((at(wrist) + along * (0.06 + 0.025 * f64::from(k)) + across).into());
                out.parents.push(Some(parent));
                parent = out.parents.len() - 1;
            }
        }
    }
    let all = out.parents.len();
    out.weights = vec![0.0; n * all];
    for v in 0..n {
        out.weights[v * all..v * all + j].copy_from_slice(&right.weights[v * j..(v + 1) * j]);
    }
    out.shape_directions = Vec::new();
    out.joint_regressor = Vec::new();
    out
}
