//! Copies of recordings that are killed on the way and started again.
#![allow(clippy::unwrap_used, clippy::disallowed_methods, missing_docs)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;
use tryon::formats::image::{write_png_depth, write_png_rgb};
use tryon::formats::open_recording;
use tryon::geometry::camera::{ColorImage, DepthImage};

const SIZE: (u32, u32) = (320, 240);
const FRAMES: usize = 60;
/// A frame whose depth image is cut short, and one whose colour is.
const BAD: [usize; 2] = [7, 33];

/// Frames of noise, two of them bad.
fn recording(folder: &Path) -> PathBuf {
    let camera = r#"{"width": 320, "height": 240, "fx": 300.0, "fy": 300.0, "cx": 159.5, "cy": 119.5, "depth_scale": 1000}"#;
    fs::create_dir_all(folder.join("depth")).unwrap();
    fs::create_dir_all(folder.join("rgb")).unwrap();
    fs::write(folder.join("camera.json"), camera).unwrap();
    let mut seed = 1u64;
    let mut noise = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) as u16
    };
    let pixels = (SIZE.0 * SIZE.1) as usize;
    let (mut depths, mut colors) = (String::new(), String::new());
    for i in 0..FRAMES {
        let depth = (0..pixels).map(|_| 500 + noise() % 4000).collect();
        let color = (0..3 * pixels).map(|_| noise() as u8).collect();
        let (depth_file, color_file) = (format!("depth/{i}.png"), format!("rgb/{i}.png"));
        let depth = DepthImage::new(SIZE.0, SIZE.1, depth).unwrap();
        write_png_depth(&folder.join(&depth_file), &depth).unwrap();
        let color = ColorImage::new(SIZE.0, SIZE.1, color).unwrap();
        write_png_rgb(&folder.join(&color_file), &color).unwrap();
        depths += &format!("{} {depth_file}\n", i as f64 / 30.0);
        colors += &format!("{} {color_file}\n", i as f64 / 30.0);
    }
    fs::write(folder.join("depth.txt"), depths).unwrap();
    fs::write(folder.join("rgb.txt"), colors).unwrap();
    for file in [
        format!("depth/{}.png", BAD[0]),
        format!("rgb/{}.png", BAD[1]),
    ] {
        let bytes = fs::read(folder.join(&file)).unwrap();
        fs::write(folder.join(&file), &bytes[..bytes.len() / 2]).unwrap();
    }
    folder.to_owned()
}

fn command(verb: &str, input: &Path, out: &Path) -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon"));
    c.arg(verb).arg(input).arg("--out").arg(out);
    c
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[track_caller]
fn run(c: &mut Command) -> Output {
    let out = c.output().unwrap();
    assert!(out.status.success(), "{c:?}: {}", text(&out.stderr));
    out
}

#[track_caller]
fn refused(c: &mut Command) -> String {
    let out = c.output().unwrap();
    assert_eq!(out.status.code(), Some(1), "{c:?}");
    text(&out.stderr)
}

/// Frames in the journal beside a copy.
fn lines(journal: &Path) -> usize {
    let text = fs::read_to_string(journal).unwrap_or_default();
    text.lines().count().saturating_sub(1)
}

/// Starts a command and waits until its copy has `frames`; it is stopped there, not yet killed.
fn until(c: &mut Command, journal: &Path, frames: usize) -> Child {
    let mut child = c
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while lines(journal) < frames {
        assert!(
            child.try_wait().unwrap().is_none(),
            "ended before frame {frames}"
        );
        std::thread::sleep(Duration::from_micros(200));
    }
    child
}

fn kill(mut child: Child) {
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().code(), None, "killed, not ended");
}

/// All files below a folder or a file itself, with their bytes.
fn contents(path: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    fn collect(path: &Path, root: &Path, out: &mut Vec<(PathBuf, Vec<u8>)>) {
        if path.is_dir() {
            for entry in fs::read_dir(path).unwrap() {
                collect(&entry.unwrap().path(), root, out);
            }
        } else {
            let name = path.strip_prefix(root).unwrap().to_owned();
            out.push((name, fs::read(path).unwrap()));
        }
    }
    let mut out = Vec::new();
    collect(path, path, &mut out);
    out.sort();
    out
}

/// Names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Kills a copy several times; the result and the report are those of one run.
fn killed_copies_are_whole(verb: &str, whole: &str, broken: &str, journal: &str) {
    let dir = tempfile::tempdir().unwrap();
    let input = recording(&dir.path().join("in"));
    let outputs = dir.path().join("out");
    fs::create_dir(&outputs).unwrap();
    let (whole, broken) = (outputs.join(whole), outputs.join(broken));
    let reference = run(&mut command(verb, &input, &whole));
    let counts = |out: &Output| text(&out.stdout).lines().next().map(str::to_owned);
    let report = counts(&reference).unwrap();
    assert!(report.contains("60 frames, 2 of them bad"), "{report}");

    let journal = outputs.join(journal);
    for frames in [1, 9, 10, 37] {
        let before = lines(&journal);
        kill(until(&mut command(verb, &input, &broken), &journal, frames));
        assert!(lines(&journal) >= before.max(frames) && !broken.exists());
    }
    let last = run(&mut command(verb, &input, &broken));
    let said = text(&last.stderr);
    let kept = said.lines().find(|l| l.contains("were in")).unwrap();
    let kept: usize = kept.split(' ').nth(1).unwrap().parse().unwrap();
    assert!((37..FRAMES - 2).contains(&kept), "{said}");
    assert_eq!(counts(&last), Some(report));
    assert!(contents(&whole) == contents(&broken), "other bytes");
    assert_eq!(
        names(&outputs).len(),
        2,
        "nothing else is left: {:?}",
        names(&outputs)
    );
    let mut source = open_recording(&broken).unwrap();
    let frames = std::iter::from_fn(|| source.next_frame().unwrap()).count();
    assert_eq!(frames, FRAMES - 2);
}

#[test]
fn a_killed_import_to_mcap_continues() {
    killed_copies_are_whole("import", "whole.mcap", "broken.mcap", "broken.journal");
}

#[test]
fn a_killed_export_continues() {
    killed_copies_are_whole("export", "whole.mcap", "broken.mcap", "broken.journal");
}

#[test]
fn a_killed_import_to_a_folder_continues() {
    killed_copies_are_whole("import", "whole", "broken.d", "broken.d.journal");
}

#[test]
fn another_recording_or_other_options_do_not_continue_a_copy() {
    let dir = tempfile::tempdir().unwrap();
    let [input, other] = ["in", "other"].map(|name| recording(&dir.path().join(name)));
    let (out, journal) = (dir.path().join("a.mcap"), dir.path().join("a.journal"));
    let import = |input: &Path| command("import", input, &out);
    kill(until(&mut import(&input), &journal, 3));

    let e = refused(&mut import(&other));
    assert!(
        e.contains("a.part.mcap was begun from") && e.contains("choose another --out"),
        "{e}"
    );
    let camera = input.join("camera.json");
    let e = refused(import(&input).arg("--camera").arg(&camera));
    assert!(
        e.contains("camera file changed") || e.contains("other options"),
        "{e}"
    );
    let e = refused(import(&input).args(["--depth-topic", "/depth"]));
    assert!(
        e.contains("other options") && e.contains("a.journal"),
        "{e}"
    );
    let list = fs::read_to_string(input.join("depth.txt")).unwrap();
    fs::write(input.join("depth.txt"), list + "# longer\n").unwrap();
    let e = refused(&mut import(&input));
    assert!(e.contains("before the recording"), "{e}");
    assert!(
        dir.path().join("a.part.mcap").exists() && !out.exists(),
        "nothing is lost"
    );

    // As the message says.
    fs::remove_file(dir.path().join("a.part.mcap")).unwrap();
    fs::remove_file(&journal).unwrap();
    run(&mut import(&input));
    let e = refused(&mut import(&input));
    assert!(e.contains("exists already"), "{e}");
}

#[test]
fn recordings_are_exported_to_mcap_only() {
    let dir = tempfile::tempdir().unwrap();
    let (recording, out) = (dir.path().join("a.mkv"), dir.path().join("a.obj"));
    let e = refused(&mut command("export", &recording, &out));
    assert!(e.contains("a.mkv") && e.contains(".mcap"), "{e}");
}

#[test]
fn files_of_others_are_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    let input = recording(&dir.path().join("in"));
    let part = dir.path().join("a.part.mcap");
    fs::write(&part, "mine").unwrap();
    let e = refused(&mut command("import", &input, &dir.path().join("a.mcap")));
    assert!(e.contains("a.part.mcap"), "{e}");
    assert_eq!(fs::read_to_string(&part).unwrap(), "mine");

    let folder = dir.path().join("b.part");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("mine"), "").unwrap();
    refused(&mut command("import", &input, &dir.path().join("b")));
    assert!(folder.join("mine").exists());
}

#[test]
fn two_imports_do_not_write_one_copy() {
    let dir = tempfile::tempdir().unwrap();
    let input = recording(&dir.path().join("in"));
    let folder = dir.path().join("made/on the way");
    let (out, journal) = (folder.join("a.mcap"), folder.join("a.journal"));
    let first = until(&mut command("import", &input, &out), &journal, 2);
    let e = refused(&mut command("import", &input, &out));
    assert!(e.contains("another import writes this copy"), "{e}");
    kill(first);
    run(&mut command("import", &input, &out));
}
