//! The program from outside: its output, its files and its exit codes.
#![allow(clippy::unwrap_used, missing_docs, clippy::print_stdout)]

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tryon::formats::image::{write_png_depth, write_png_rgb};
use tryon::geometry::camera::{ColorImage, DepthImage};

fn tryon(args: &[&str]) -> Output {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon"));
    // Software Vulkan writes a warning without a desktop session.
    c.args(args)
        .env("XDG_RUNTIME_DIR", std::env::temp_dir())
        .output()
        .expect("starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The error of a command that must fail without a panic, one line.
#[track_caller]
fn refused(args: &[&str]) -> String {
    let out = tryon(args);
    let err = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{args:?}: {err}");
    assert!(!err.contains("panicked"), "{args:?}: {err}");
    err.trim().to_owned()
}

const SIZE: (u32, u32) = (64, 48);

/// A recording of `n` frames of an empty wall, 2 m away.
fn recording(folder: &Path, n: usize) -> PathBuf {
    let camera = json!({"width": SIZE.0, "height": SIZE.1, "fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 23.5, "depth_scale": 1000});
    std::fs::create_dir_all(folder.join("depth")).unwrap();
    std::fs::create_dir_all(folder.join("rgb")).unwrap();
    std::fs::write(folder.join("camera.json"), camera.to_string()).unwrap();
    let depth = DepthImage::new(SIZE.0, SIZE.1, vec![2000; (SIZE.0 * SIZE.1) as usize]).unwrap();
    let color = ColorImage::filled(SIZE.0, SIZE.1, [90, 120, 150]);
    let (mut depths, mut colors) = (String::new(), String::new());
    for i in 0..n {
        write_png_depth(&folder.join(format!("depth/{i}.png")), &depth).unwrap();
        write_png_rgb(&folder.join(format!("rgb/{i}.png")), &color).unwrap();
        depths += &format!("{} depth/{i}.png\n", i as f64 / 30.0);
        colors += &format!("{} rgb/{i}.png\n", i as f64 / 30.0);
    }
    std::fs::write(folder.join("depth.txt"), depths).unwrap();
    std::fs::write(folder.join("rgb.txt"), colors).unwrap();
    folder.to_owned()
}

fn lines(file: &Path) -> Vec<Value> {
    std::fs::read_to_string(file)
        .unwrap()
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect()
}

#[test]
fn each_command_explains_itself() {
    for command in [
        "demo",
        "up",
        "run",
        "track",
        "simulate",
        "fine",
        "composite",
        "import",
        "export",
        "record",
        "replay",
        "doctor",
    ] {
        let out = tryon(&[command, "--help"]);
        assert!(
            out.status.success() && text(&out.stdout).contains("Usage: tryon"),
            "{command}"
        );
    }
    let out = tryon(&["dance"]);
    assert!(
        out.status.code() == Some(2) && text(&out.stderr).contains("dance"),
        "{}",
        text(&out.stderr)
    );
}

#[test]
fn bad_input_names_its_file_and_field() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    let out = at("out.jsonl");
    let track = |input: &str| refused(&["track", "--input", input, "--out", &out]);

    let missing = track(&at("nowhere"));
    assert!(
        missing.contains("nowhere") && missing.matches("No such file").count() <= 1,
        "{missing}"
    );
    std::fs::create_dir(dir.path().join("empty")).unwrap();
    assert!(track(&at("empty")).contains("camera.json"));

    let nan = recording(&dir.path().join("nan"), 1).join("camera.json");
    std::fs::write(
        &nan,
        std::fs::read_to_string(&nan)
            .unwrap()
            .replace("60.0", "NaN"),
    )
    .unwrap();
    assert!(track(&at("nan")).contains("camera.json"));
    recording(&dir.path().join("focal"), 1);
    let focal = dir.path().join("focal/camera.json");
    std::fs::write(
        &focal,
        std::fs::read_to_string(&focal)
            .unwrap()
            .replace("\"fx\":60.0", "\"fx\":-1"),
    )
    .unwrap();
    let e = track(&at("focal"));
    assert!(e.contains("camera.json") && e.contains("fx"), "{e}");

    std::fs::write(
        dir.path().join("huge.mcap"),
        [&b"\x89MCAP0\r\n\x01"[..], &u64::MAX.to_le_bytes()].concat(),
    )
    .unwrap();
    assert!(track(&at("huge.mcap")).contains("huge.mcap"));
    let hole = at("hole.obj");
    std::fs::write(&hole, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n").unwrap();
    let e = refused(&["import", &hole]);
    assert!(
        e.contains("hole.obj") && e.contains("face 1") && e.contains('9'),
        "{e}"
    );
    let e = refused(&[
        "run",
        "--input",
        &at("focal"),
        "--garment",
        "cape",
        "--out",
        &at("run"),
    ]);
    assert!(e.contains("cape") && e.contains("tshirt"), "{e}");
    let e = refused(&[
        "track",
        "--input",
        &at("nowhere"),
        "--body",
        &hole,
        "--out",
        &out,
    ]);
    assert!(e.contains("nowhere") || e.contains("hole.obj"), "{e}");
}

#[test]
fn a_bad_frame_costs_only_itself() {
    let dir = tempfile::tempdir().unwrap();
    let input = recording(&dir.path().join("rec"), 4);
    let cut = input.join("depth/1.png");
    let bytes = std::fs::read(&cut).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let other = DepthImage::new(32, 24, vec![2000; 32 * 24]).unwrap();
    write_png_depth(&input.join("depth/2.png"), &other).unwrap();
    let file = dir.path().join("out.jsonl");
    let out = tryon(&[
        "track",
        "--input",
        &input.display().to_string(),
        "--out",
        &file.display().to_string(),
    ]);
    let err = text(&out.stderr);
    assert!(
        err.contains("depth/1.png") && err.contains("depth/2.png") && !err.contains("panicked"),
        "{err}"
    );
    assert!(
        err.contains("64") && err.contains("32"),
        "both sizes are named: {err}"
    );
    let frames: Vec<u64> = lines(&file)
        .iter()
        .map(|l| l["frame"].as_u64().unwrap())
        .collect();
    assert!(
        frames.contains(&0) && frames.contains(&3),
        "good frames are answered: {frames:?}"
    );
    assert!(
        lines(&file).iter().all(|l| l["status"] != "tracking"),
        "nobody is there"
    );
}

/// Simulates a square of 0.1 m that hangs from two corners, into `out` below `dir`. Membrane stiffness in N/m.
fn simulate_square(dir: &Path, stiffness: f64) -> Output {
    std::fs::write(
        dir.join("sheet.obj"),
        "v 0 1 0\nv 0.1 1 0\nv 0.1 0.9 0\nv 0 0.9 0\nf 1 2 3\nf 1 3 4\n",
    )
    .unwrap();
    let scene = json!({
        "mesh": "sheet.obj", "pinned_vertices": [0, 1],
        "material": {"area_density_kg_m2": 0.2, "thickness_m": 4e-4, "young_membrane_N_m": stiffness, "poisson": 0.3,
            "bending_rigidity_N_m": 1e-5, "friction": 0.3},
        "gravity": [0.0, -9.81, 0.0], "duration_s": 0.2, "output_fps": 60.0
    });
    let file = dir.join("scene.json");
    std::fs::write(&file, scene.to_string()).unwrap();
    let (scene, out) = (file.display().to_string(), dir.join("out"));
    let out = out.display().to_string();
    tryon(&["simulate", "--scene", &scene, "--out", &out])
}

#[test]
fn cloth_too_stiff_for_its_substeps_is_said_to_be_softened() {
    let dir = tempfile::tempdir().unwrap();
    let run = simulate_square(dir.path(), 1e12);
    let said = text(&run.stderr);
    assert!(
        run.status.success() && said.contains("% of its stiffness") && said.contains("offline"),
        "{said}"
    );
}

#[test]
fn cloth_in_a_scene_file_hangs_from_its_pins() {
    let dir = tempfile::tempdir().unwrap();
    let run = simulate_square(dir.path(), 500.0);
    assert!(run.status.success(), "{}", text(&run.stderr));
    assert!(!text(&run.stderr).contains("stiffness"));
    let out = dir.path().join("out");
    let report: Value =
        serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(
        (report["frames"].as_u64(), report["vertices"].as_u64()),
        (Some(13), Some(4))
    );
    let npy = std::fs::read(out.join("positions.npy")).unwrap();
    let values: Vec<f32> = npy[npy.len() - 13 * 4 * 12..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    let last = &values[12 * 12..];
    assert!(
        (last[1] - 1.0).abs() < 1e-4 && (last[4] - 1.0).abs() < 1e-4,
        "pins hold: {last:?}"
    );
    // Half the weight (9.81 · 0.2 · 0.01 N) on 0.1 m of 500 N/m: stretched by far less than a millimetre.
    assert!(
        (last[7] - 0.9).abs() < 2e-3 && (last[10] - 0.9).abs() < 2e-3,
        "it hangs as long as it is: {last:?}"
    );
}

#[test]
fn the_demo_leaves_pictures_and_its_report() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().display().to_string();
    // A slow camera, so that the unoptimised chain keeps up beside other tests.
    let run = tryon(&[
        "demo",
        "--headless",
        "--seconds",
        "20",
        "--fps",
        "6",
        "--garment",
        "tshirt",
        "--listen",
        "127.0.0.1:0",
        "--out",
        &out,
    ]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let report: Value =
        serde_json::from_slice(&std::fs::read(dir.path().join("report.json")).unwrap()).unwrap();
    println!("{report:#}");
    for key in [
        "frames_in",
        "frames_out",
        "drops",
        "rate",
        "latency_ms",
        "stages_ms",
        "skipped",
        "peak_memory_bytes",
    ] {
        assert!(!report[key].is_null(), "{key} is missing in {report:#}");
    }
    let pictures = std::fs::read_dir(dir.path()).unwrap().filter(|e| {
        e.as_ref()
            .unwrap()
            .path()
            .extension()
            .is_some_and(|x| x == "png")
    });
    assert!(pictures.count() >= 1, "pictures");
}

#[test]
fn what_is_recorded_can_be_tracked_and_converted() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    let run = |args: &[&str]| {
        let out = tryon(args);
        assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
        text(&out.stdout)
    };
    run(&[
        "record",
        "--source",
        "synth:still",
        "--seconds",
        "0.5",
        "--out",
        &at("a.mcap"),
    ]);
    run(&["import", &at("a.mcap"), "--out", &at("folder")]);
    for input in ["a.mcap", "folder"] {
        run(&["track", "--input", &at(input), "--out", &at("out.jsonl")]);
        let all = lines(&dir.path().join("out.jsonl"));
        assert_eq!(all.len(), 15, "{input}");
        let last = &all[14];
        assert!(
            last["joints"].as_object().unwrap().len() >= 19
                && last["residual_mm"].as_f64().unwrap() < 20.0,
            "{last}"
        );
    }
    run(&["export", "tshirt", "--out", &at("shirt.obj")]);
    assert!(run(&["import", &at("shirt.obj")]).contains("closed: false"));
    run(&["export", "body", "--out", &at("body.glb")]);
    assert!(run(&["import", &at("body.glb")]).contains("closed: true"));
}

#[test]
fn a_box_starts_from_its_file_and_drains_at_a_signal() {
    use std::io::{BufRead, BufReader, Read, Write};
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("box.toml");
    let free = || {
        std::net::TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap()
    };
    let bus = free();
    let mut config = format!("[bus]\nlisten = [\"tcp/{bus}\"]\nconnect = [\"tcp/{bus}\"]\n");
    for service in ["capture", "tracking", "cloth", "compositor"] {
        config += &format!("[{service}]\naddress = \"127.0.0.1:0\"\nadmin = \"127.0.0.1:0\"\n");
    }
    std::fs::write(&file, &config).unwrap();
    let file_text = file.display().to_string();
    let checked = tryon(&["up", "--config", &file_text, "--check"]);
    assert!(checked.status.success() && text(&checked.stdout).contains("[compositor]"));

    let mut child = Command::new(env!("CARGO_BIN_EXE_tryon"))
        .args(["up", "--config", &file_text])
        .env("XDG_RUNTIME_DIR", std::env::temp_dir())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(child.stdout.take().unwrap()).lines();
    let mirror = said
        .by_ref()
        .map(Result::unwrap)
        .find_map(|l| l.strip_prefix("mirror: http://").map(str::to_owned));
    let mirror = mirror.expect("an address");
    let (address, token) = mirror.split_once("/#token=").expect("a token");
    assert_eq!(token.split('.').count(), 3);
    let mut page = std::net::TcpStream::connect(address).unwrap();
    write!(
        page,
        "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    )
    .unwrap();
    let mut html = String::new();
    page.read_to_string(&mut html).unwrap();
    assert!(
        html.starts_with("HTTP/1.1 200") && html.contains("<html"),
        "{html}"
    );
    let kill = Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(kill.success() && child.wait().unwrap().success());
    assert_eq!(said.last().unwrap().unwrap(), "ended");

    std::fs::write(&file, config.replace("[cloth]", "[cloth]\nmax_session = 3")).unwrap();
    let refused = tryon(&["up", "--config", &file_text]);
    assert!(refused.status.code() == Some(64) && text(&refused.stderr).contains("max_session"));
}

#[test]
fn tokens_are_made_and_revoked() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).display().to_string();
    let run = |args: &[&str]| tryon(&[&["token"], args].concat());
    let keys = path("keys");
    assert!(run(&["key", "--out", &keys]).status.success());
    assert!(
        !run(&["key", "--out", &keys]).status.success(),
        "never over another key"
    );
    let key = path("keys/issuer.pem");
    let shared = ["--key", &key, "--store", "store"];
    let issue = |more: &[&str]| run(&[&["issue"], &shared[..], more].concat());
    let issued = issue(&["--audience", "compositor", "cloth", "--ttl", "60"]);
    assert_eq!(text(&issued.stdout).trim().split('.').count(), 3);
    let jti = text(&issued.stderr)
        .trim()
        .strip_prefix("jti ")
        .unwrap()
        .to_owned();
    for (wrong, said) in [
        (vec!["--audience", "elsewhere", "--ttl", "60"], "elsewhere"),
        (vec!["--audience", "cloth", "--ttl", "0"], "ttl"),
        (
            vec!["--audience", "cloth", "--ttl", "60", "--camera", "a/b"],
            "--camera a/b",
        ),
        (
            vec!["--audience", "cloth", "--ttl", "60", "--method", "a/b"],
            "--method a/b",
        ),
    ] {
        let refused = issue(&wrong);
        assert!(
            !refused.status.success() && text(&refused.stderr).contains(said),
            "{said}"
        );
    }
    let list = path("revoked");
    std::fs::write(&list, "older").unwrap();
    assert!(run(&["revoke", "--list", &list, &jti]).status.success());
    assert_eq!(
        std::fs::read_to_string(&list).unwrap(),
        format!("older\n{jti}\n")
    );
    let token = text(&issued.stdout).trim().to_owned();
    assert!(
        !run(&["revoke", "--list", &list, &token]).status.success(),
        "a token is no identity"
    );
    let codes = path("codes");
    let enrol = [
        &["enrol"],
        &shared[..],
        &["--camera", "front", "--folder", &codes],
    ]
    .concat();
    let code = text(&run(&enrol).stdout).trim().to_owned();
    assert_eq!(code.len(), "XXXX-XXXX-XXXX".len());
    assert_eq!(std::fs::read_dir(&codes).unwrap().count(), 1);
}

#[test]
fn a_store_has_one_authority_and_strangers_get_certificates_of_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).display().to_string();
    let authority = path("store/authority.pem");
    let made = || {
        assert!(tryon(&["identity", "make", &authority]).status.success());
        std::fs::read_to_string(&authority).unwrap()
    };
    let first = made();
    assert_eq!(made(), first);
    let (authority, out) = (format!("--authority={authority}"), path("router"));
    let out = format!("--out={out}");
    let issue = [
        "identity",
        "issue",
        "router",
        &authority,
        &out,
        "--name=10.0.0.7",
    ];
    assert!(tryon(&issue).status.success());
    let read = |name: &str| std::fs::read_to_string(dir.path().join("router").join(name)).unwrap();
    assert!(first.ends_with(&read("ca.pem")));
    assert!(read("key.pem").starts_with("-----BEGIN PRIVATE KEY-----"));
    let certificate = read("certificate.pem");
    assert!(tryon(&issue).status.success());
    assert_ne!(read("certificate.pem"), certificate, "made anew");

    std::fs::write(path("none.pem"), "none").unwrap();
    let refusal = refused(&["identity", "make", &path("none.pem")]);
    assert!(
        refusal.contains("none.pem") && refusal.contains("private key"),
        "{refusal}"
    );
}

#[test]
fn doctor_knows_the_machine() {
    let out = tryon(&["doctor", "--json"]);
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    let looked_at: Vec<&str> = report
        .as_array()
        .unwrap()
        .iter()
        .map(|r| r["what"].as_str().unwrap())
        .collect();
    for what in ["cores", "memory", "body", "graphics", "port", "shared data"] {
        assert!(looked_at.contains(&what), "{what} is missing in {report:#}");
    }
}

#[test]
fn a_pattern_of_another_make_is_worn_in_a_real_picture() {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let data = std::env::var_os("TRYON_SHARED")
        .map_or(beside, PathBuf::from)
        .join("data");
    let (still, pattern) = (
        "rgbd/depthkit_still",
        "garments/garmentcode_mit/Patterns/shirt_mean_specification.json",
    );
    if let Some(missing) = [still, pattern].iter().find(|p| !data.join(p).exists()) {
        assert!(
            std::env::var_os("TRYON_REQUIRE_ALL").is_none(),
            "{missing} is missing"
        );
        eprintln!("SKIPPED: {missing} is missing");
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().display().to_string();
    let at = |p: &str| data.join(p).display().to_string();
    let run = tryon(&[
        "run",
        "--input",
        &at(still),
        "--garment",
        &at(pattern),
        "--out",
        &out,
        "--still-frames",
        "24",
    ]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let report: Value =
        serde_json::from_slice(&std::fs::read(dir.path().join("report.json")).unwrap()).unwrap();
    assert!(report["dressed_frames"].as_u64().unwrap() > 3, "{report}");
    let read = |p: &Path| tryon::formats::image::read_color(p).unwrap();
    // The subject's red shirt lies under the cream garment.
    let red = |i: &ColorImage| {
        i.data()
            .chunks_exact(3)
            .filter(|p| p[0] > 130 && p[1] < 60 && p[2] < 80)
            .count()
    };
    let (before, after) = (
        read(&data.join(still).join("rgb/000000.png")),
        read(&dir.path().join("frame_000000.png")),
    );
    assert!(
        red(&before) > 5000 && red(&after) * 10 < red(&before) * 7,
        "{} {}",
        red(&before),
        red(&after)
    );

    std::fs::write(dir.path().join("half.json"), "{\"pattern\": {\"panels\": {").unwrap();
    let half = dir.path().join("half.json").display().to_string();
    assert!(
        refused(&[
            "run",
            "--input",
            &at(still),
            "--garment",
            &half,
            "--out",
            &out
        ])
        .contains("half.json")
    );
}
