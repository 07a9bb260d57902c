//! Offline simulations from outside: their files, and what a resumed one is.
#![allow(clippy::unwrap_used, missing_docs)]

use serde_json::json;
use std::path::Path;
use std::process::{Command, Output};

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
