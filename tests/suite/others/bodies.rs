//! Bodies of other programs.

use nalgebra::{Matrix3, Point3, Vector3};
use tryon::body::Template;
use tryon::body::import::{BodyFile, body_of_arrays};
use tryon::dressing::SourceBody;
use tryon::formats::mesh_frame::upright_rotation;
use tryon::formats::npz::{SmplArrays, read_smpl};
use tryon::formats::{MeshFrame, shared_data};

/// The shared body in SMPL's layout, without its names.
fn nameless(file: &str) -> Option<SmplArrays> {
    let path = shared_data("body/makehuman_smpl_layout")?.join(file);
    Some(SmplArrays {
        has_names: false,
        joint_names: Vec::new(),
        ..read_smpl(path).expect(file)
    })
}

fn read(arrays: SmplArrays) -> Result<BodyFile, String> {
    body_of_arrays("body", arrays, &MeshFrame::default()).map_err(|e| e.to_string())
}

fn place(template: &Template, joint: &str) -> Point3<f64> {
    let skeleton = template.skeleton();
    skeleton.joints()[skeleton.index(joint).expect(joint)].rest
}

/// As `reports/smplx_joint_order/make.py` makes it: jaw and eyes on the head, three joints in each of five fingers.
fn smplx(base: &SmplArrays) -> SmplArrays {
    let mut out = base.clone();
    let (n, known) = (base.vertices.len(), base.parents.len());
    let mut add = |parent: usize, at: Vector3<f64>| {
        out.parents.push(Some(parent));
        out.joints.push(at.into());
        out.parents.len() - 1
    };
    let at = |joint: usize| Vector3::from(base.joints[joint]);
    for offset in [[0.0, 0.0, 0.05], [0.03, 0.07, 0.08], [-0.03, 0.07, 0.08]] {
        add(15, at(15) + Vector3::from(offset));
    }
    for (wrist, elbow) in [(20, 18), (21, 19)] {
        let along = (at(wrist) - at(elbow)).normalize();
        for finger in 0..5 {
            let across = Vector3::z() * (f64::from(finger) - 2.0) * 0.015;
            let mut parent = wrist;
            for joint in 0..3 {
                parent = add(
                    parent,
                    at(wrist) + along * (0.06 + 0.025 * f64::from(joint)) + across,
                );
            }
        }
    }
    let all = out.parents.len();
    out.weights = vec![0.0; n * all];
    for (row, own) in out
        .weights
        .chunks_exact_mut(all)
        .zip(base.weights.chunks_exact(known))
    {
        row[..known].copy_from_slice(own);
    }
    out.shape_directions = Vec::new();
    out.joint_regressor = Vec::new();
    out
}

/// The report's right value: joints 22 to 24 are jaw and eyes, and `left_hand_end` lies at the left fingertips.
#[test]
fn jaw_and_eyes_of_smplx_are_no_hands() {
    let Some(base) = nameless("template.npz") else {
        return;
    };
    let body = read(smplx(&base)).expect("a body");
    let joints = body.template.skeleton().joints();
    let names: Vec<&str> = joints[22..25].iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["jaw", "left_eye", "right_eye"]);
    let fingertips = base
        .vertices
        .iter()
        .max_by(|a, b| a[0].total_cmp(&b[0]))
        .expect("vertices");
    let far =
        (place(&body.template, "left_hand_end") - Point3::from(fingertips.map(f64::from))).norm();
    assert!(far < 0.05, "{far} m from the fingertips");
}

/// A body that had 59,430 m³, z up and nameless, is one of 59 litres.
#[test]
fn centimetres_and_z_up_are_recognised() {
    for file in [
        "template.npz",
        "subject_f_short_heavy.npz",
        "subject_m_tall.npz",
    ] {
        let Some(base) = nameless(file) else { return };
        let right = read(base.clone()).expect("a body");
        let turn = upright_rotation("z".parse().expect("axis"), "-y".parse().expect("axis"));
        let map: Matrix3<f64> = turn.expect("square").transpose() * 100.0;
        let mut file = base;
        let moved = |p: [f64; 3]| -> [f64; 3] { (map * Vector3::from(p)).into() };
        file.vertices
            .iter_mut()
            .for_each(|p| *p = moved(p.map(f64::from)).map(|c| c as f32));
        file.joints.iter_mut().for_each(|p| *p = moved(*p));
        file.shape_directions = Vec::new();
        let body = read(file).expect("a body");
        let volume = body.template.mesh().volume();
        assert!((volume - right.template.mesh().volume()).abs() < 1e-4 && volume < 0.1);
        for joint in ["head", "left_wrist", "right_foot"] {
            assert!((place(&body.template, joint) - place(&right.template, joint)).norm() < 1e-5);
        }
        let notes = body.notes.join("; ");
        assert!(
            notes.contains("in cm") && notes.contains("z up, facing -y"),
            "{notes}"
        );
    }
}

/// An OBJ of a body in centimetres that faces −z, and one upside down: both stand and face as they should.
#[test]
fn an_obj_body_shows_its_frame() {
    let Some(base) = nameless("subject_f_avg.npz") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    for (name, map, words) in [
        (
            "back",
            [-100.0, 100.0, -100.0],
            "in cm: stature 160.5 is 1.61 m; y up, facing -z",
        ),
        ("upside", [1.0, -1.0, -1.0], "-y up, facing -z"),
    ] {
        let mut text = String::new();
        for v in &base.vertices {
            let [x, y, z] = [0, 1, 2].map(|k| f64::from(v[k]) * map[k]);
            text += &format!("v {x} {y} {z}\n");
        }
        for f in &base.faces {
            let [a, b, c] = f.map(|i| i + 1);
            text += &format!("f {a} {b} {c}\n");
        }
        let path = folder.path().join(format!("{name}.obj"));
        std::fs::write(&path, text).expect("written");
        let body = SourceBody::read(&path).expect("a person");
        assert!(body.description.contains(words), "{}", body.description);
        let stated = MeshFrame {
            facing: "z".parse().ok(),
            ..MeshFrame::default()
        };
        let why = SourceBody::read_in(&path, &stated)
            .expect_err("back to front")
            .to_string();
        assert!(why.contains("--facing -z") && why.contains(name), "{why}");
    }
}
