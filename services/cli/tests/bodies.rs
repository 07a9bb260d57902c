//! Bodies of others on the command line: unit and axes by option.
#![allow(clippy::unwrap_used, missing_docs)]

use npyz::WriterBuilder;
use npyz::npz::NpzWriter;
use std::path::Path;
use std::process::Command;
use tryon::formats::image::{write_png_depth, write_png_rgb};
use tryon::formats::npz::read_smpl;
use tryon::formats::shared_data;
use tryon::geometry::camera::{ColorImage, DepthImage};

/// Exit code and words of a command.
fn tryon(args: &[&str]) -> (Option<i32>, String) {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon"));
    // Software Vulkan writes a warning without a desktop session.
    let c = c.args(args).env("XDG_RUNTIME_DIR", std::env::temp_dir());
    let out = c.output().expect("starts");
    let words = [out.stdout, out.stderr].concat();
    (
        out.status.code(),
        String::from_utf8_lossy(&words).into_owned(),
    )
}

/// A copy of a body's npz with other lengths, without the names of its joints.
fn write_scaled(body: &Path, copy: &Path, scale: f64) {
    let arrays = read_smpl(body).unwrap();
    let mut file = NpzWriter::create(copy).unwrap();
    let mut add = |name: &str, shape: &[usize], values: Vec<f64>| {
        let shape: Vec<u64> = shape.iter().map(|n| *n as u64).collect();
        let array = file.array::<f64>(name, Default::default()).unwrap();
        let mut array = array.default_dtype().shape(&shape).begin_nd().unwrap();
        array.extend(values).unwrap();
        array.finish().unwrap();
    };
    let (n, j) = (arrays.vertices.len(), arrays.parents.len());
    let skin = arrays.vertices.iter().flatten();
    let corners = arrays.faces.iter().flatten();
    let parents = arrays.parents.iter();
    let parents = parents.map(|p| p.map_or(-1.0, |p| p as f64));
    let weights = arrays.weights.iter().map(|w| f64::from(*w));
    let joints = arrays.joints.iter().flatten();
    add(
        "v_template",
        &[n, 3],
        skin.map(|c| f64::from(*c) * scale).collect(),
    );
    add(
        "f",
        &[arrays.faces.len(), 3],
        corners.map(|v| f64::from(*v)).collect(),
    );
    add(
        "kintree_table",
        &[2, j],
        parents.chain((0..j).map(|k| k as f64)).collect(),
    );
    add("weights", &[n, j], weights.collect());
    add("J", &[j, 3], joints.map(|c| c * scale).collect());
}

/// A body in inches: of a person, or of a child in centimetres.
#[test]
fn commands_that_read_a_body_take_the_options_that_its_refusal_names() {
    let Some(metres) = shared_data("body/makehuman_smpl_layout/subject_f_avg.npz") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    let (body, out, input) = (at("inches.npz"), at("out"), at("depth_1.png"));
    write_scaled(&metres, Path::new(&body), 1.0 / 0.0254);
    let wall = DepthImage::new(64, 48, vec![2000; 64 * 48]).unwrap();
    write_png_depth(Path::new(&input), &wall).unwrap();
    let color = ColorImage::filled(64, 48, [90, 120, 150]);
    write_png_rgb(&dir.path().join("color_1.png"), &color).unwrap();

    let camera = at("camera.json");
    let lens = r#"{"width": 64, "height": 48, "fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5, "depth_scale": 1000}"#;
    std::fs::write(&camera, lens).unwrap();

    let labels = at("labels");
    let source = ["--input", &input, "--camera", &camera, "--out", &out];
    let track = [&["track"][..], &source].concat();
    let run = ["run", "--garment", "tshirt", "--still-frames", "1"];
    let run = [&run[..], &source].concat();
    let segment = vec!["clothcap", "segment", "--scans", &input, "--out", &labels];
    for command in [&track, &run, &segment] {
        let (code, words) = tryon(&[&command[..], &["--body", &body]].concat());
        assert_eq!(code, Some(1), "{words}");
        assert!(words.contains("`--body-unit inch`"), "{words}");
        let (_, words) = tryon(&[&command[..], &["--body", &body, "--body-unit", "inch"]].concat());
        assert!(
            words.contains("in inch") && !words.contains("--body-unit"),
            "{words}"
        );
    }
    let (_, words) = tryon(&[&run[..], &["--garment-body", &body]].concat());
    assert!(words.contains("`--garment-body-unit inch`"), "{words}");
    let (_, words) = tryon(&["import", &body]);
    assert!(words.contains("`--unit inch`"), "{words}");
    let (code, words) = tryon(&["import", &body, "--unit", "inch"]);
    assert!(code == Some(0) && words.contains("body: "), "{words}");
    let (code, words) = tryon(&[&track[..], &["--body-unit", "inch"]].concat());
    assert_eq!(code, Some(2), "a unit without its file: {words}");
}
