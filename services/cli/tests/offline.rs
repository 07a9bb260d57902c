//! Offline simulations from outside: their files, and what a resumed one is.
#![allow(clippy::unwrap_used, missing_docs)]

use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Output};
use tryon::formats::gltf::read_glb;
use tryon::formats::npy::read_npy;

fn tryon(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tryon"));
    command.args(args).output().expect("starts")
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The offline simulation of a hanging square for `seconds`, in `folder`; bytes of positions.npy and animation.glb.
fn offline(folder: &Path, seconds: f64, flags: &[&str]) -> [Vec<u8>; 2] {
    std::fs::create_dir_all(folder).unwrap();
    let scene = json!({
        "mesh_obj": "v 0 1 0\nv 0.1 1 0\nv 0.1 1 0.1\nv 0 1 0.1\nf 1 2 3\nf 1 3 4\n",
        "pinned_vertices": [0, 1],
        "material": {
            "area_density_kg_m2": 0.2, "thickness_m": 4e-4, "young_membrane_N_m": 500.0, "poisson": 0.3,
            "bending_rigidity_N_m": 1e-5, "friction": 0.3
        },
        "gravity": [0.0, -9.81, 0.0], "duration_s": seconds, "output_fps": 60.0
    });
    let file = folder.join("scene.json");
    std::fs::write(&file, scene.to_string()).unwrap();
    let (file, out) = (file.display().to_string(), folder.display().to_string());
    let mut args = vec![
        "simulate", "--scene", &file, "--out", &out, "--solver", "offline",
    ];
    args.extend(flags);
    let run = tryon(&args);
    assert!(run.status.success(), "{}", errors(&run));
    ["positions.npy", "animation.glb"].map(|name| std::fs::read(folder.join(name)).unwrap())
}

#[test]
fn an_offline_simulation_resumes_to_the_same_bits() {
    let dir = tempfile::tempdir().unwrap();
    let whole = offline(&dir.path().join("whole"), 0.2, &[]);

    let parts = dir.path().join("parts");
    let state = dir.path().join("state").display().to_string();
    offline(&parts, 0.1, &["--checkpoint", &state]);
    let resumed = offline(&parts, 0.2, &["--checkpoint", &state, "--resume"]);
    assert_eq!(resumed, whole);

    let args = ["simulate", "--scene", "a.json", "--out", "b"];
    let refused = tryon(&[&args[..], &["--checkpoint", &state]].concat());
    assert_eq!(refused.status.code(), Some(1));
    let why = errors(&refused);
    assert!(why.contains("--checkpoint needs --solver offline"), "{why}");
}

/// A skirt on the synthetic person in the first `frames` frames of `input`, in `folder`; bytes of positions.npy, body.npy and
/// outfit.glb.
fn worn(input: &str, folder: &Path, frames: usize, flags: &[&str]) -> [Vec<u8>; 3] {
    let (out, frames) = (folder.display().to_string(), frames.to_string());
    let mut args = vec!["run", "--input", input, "--garment", "skirt", "--out", &out];
    args.extend([
        "--frames",
        &frames,
        "--solver",
        "offline",
        "--vertices",
        "0",
    ]);
    args.extend(flags);
    let run = tryon(&args);
    assert!(run.status.success(), "{}", errors(&run));
    ["positions.npy", "body.npy", "outfit.glb"]
        .map(|name| std::fs::read(folder.join(name)).unwrap())
}

/// Number of morph targets of each mesh of a binary glTF, by its name.
fn morph_targets(glb: &[u8]) -> Vec<(String, usize)> {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let file: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let meshes = file["meshes"].as_array().unwrap().iter();
    let count = |m: &Value| m["primitives"][0]["targets"].as_array().unwrap().len();
    meshes
        .map(|m| (m["name"].as_str().unwrap().to_owned(), count(m)))
        .collect()
}

#[test]
fn a_worn_garment_is_animated_on_its_body_and_resumes_to_the_same_bits() {
    /// Frames of the recording: the person is dressed in the 15th.
    const FRAMES: [usize; 2] = [16, 18];
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("still.mcap").display().to_string();
    let source = ["--source", "synth:still", "--seconds", "0.6"];
    let recorded = tryon(&[&["record", "--out", &input][..], &source].concat());
    assert!(recorded.status.success(), "{}", errors(&recorded));
    let folder = dir.path().join("whole");
    let whole = worn(&input, &folder, FRAMES[1], &[]);

    let (shape, body) = read_npy(&folder.join("body.npy")).unwrap();
    let (cloth, _) = read_npy(&folder.join("positions.npy")).unwrap();
    let (frames, vertices) = (shape[0] as usize, shape[1] as usize);
    assert!(frames > 2 && shape[0] == cloth[0], "{shape:?} {cloth:?}");
    let expected = ["skirt", "body"].map(|name| (name.to_owned(), frames));
    assert_eq!(morph_targets(&whole[2]), expected);
    let glb = read_glb(&folder.join("outfit.glb")).unwrap();
    let (skin, points) = (&glb.parts[1], glb.mesh.vertices());
    assert!(skin.names.group == "body" && skin.color != glb.parts[0].color);
    let drawn = &points[points.len() - vertices..];
    let flat: Vec<f32> = drawn.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    assert_eq!(flat, body[..3 * vertices], "the first frame");
    assert_ne!(flat, body[body.len() - 3 * vertices..], "the last frame");
    // Cloth on the person: within the reach of a skirt from the skin.
    for p in &points[..points.len() - vertices] {
        let far = drawn.iter().all(|q| (p - q).norm() > 0.3);
        assert!(!far, "{p} is off the body");
    }

    let parts = dir.path().join("parts");
    let state = dir.path().join("state").display().to_string();
    worn(&input, &parts, FRAMES[0], &["--checkpoint", &state]);
    let flags = ["--checkpoint", &state, "--resume"];
    let resumed = worn(&input, &parts, FRAMES[1], &flags);
    assert!(resumed == whole, "other bits");
}
