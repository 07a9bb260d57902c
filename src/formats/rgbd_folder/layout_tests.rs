//! Folders as other programs lay them out.

use super::*;
use crate::RecordingOptions;
use crate::image::{write_png_depth, write_png_rgb};
use crate::recording::{open_as_recorded, open_as_recorded_with};
use proptest::prelude::*;
use std::fs;
use std::path::Path;
use tryon_geometry::camera::{ColorImage, DepthImage};

const CAMERA: &str =
    r#"{"width": 4, "height": 3, "fx": 5, "fy": 5, "cx": 1.5, "cy": 1, "depth_scale": 1000}"#;

fn depth(folder: &Path, name: &str, value: u16) {
    fs::create_dir_all(folder.join("depth")).expect("created");
    let image = DepthImage::new(4, 3, vec![value; 12]).expect("sizes");
    write_png_depth(&folder.join("depth").join(name), &image).expect("written");
}

fn color(folder: &Path, file: &str, (w, h): (u32, u32), value: u8) {
    let path = folder.join(file);
    fs::create_dir_all(path.parent().expect("a folder")).expect("created");
    write_png_rgb(&path, &ColorImage::filled(w, h, [value; 3])).expect("written");
}

fn folder(camera: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("temporary folder");
    fs::write(dir.path().join("camera.json"), camera).expect("written");
    dir
}

/// First depth value and first colour of each frame.
fn values(folder: &Path) -> Vec<(u16, Option<u8>)> {
    let mut source = open_as_recorded(folder).expect("opens");
    let frames = std::iter::from_fn(|| source.next_frame().expect("reads"));
    let value = |c: ColorImage| c.data()[0];
    frames
        .map(|f| (f.depth.at(0, 0), f.color.map(value)))
        .collect()
}

fn refusal(folder: &Path) -> String {
    open_as_recorded(folder)
        .err()
        .expect("must be refused")
        .to_string()
}

#[test]
fn names_sort_as_numbers_and_colour_pairs_by_them() {
    let dir = folder(CAMERA);
    for i in [0u16, 2, 9, 10, 100] {
        depth(dir.path(), &format!("{i}.png"), i + 1);
    }
    for i in [2u8, 10, 100] {
        color(dir.path(), &format!("color/frame_{i:05}.png"), (4, 3), i);
    }
    let expected = [
        (1, None),
        (3, Some(2)),
        (10, None),
        (11, Some(10)),
        (101, Some(100)),
    ];
    assert_eq!(values(dir.path()), expected);
    color(dir.path(), "rgb/0.png", (4, 3), 0);
    let e = refusal(dir.path());
    assert!(e.contains("`rgb, color`") && e.contains("both"), "{e}");
}

#[test]
fn one_depth_image_is_a_recording_with_its_colour_beside_it() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let (image, camera) = (
        dir.path().join("depth/Depth_7.png"),
        dir.path().join("k.json"),
    );
    depth(dir.path(), "Depth_7.png", 1234);
    let e = refusal(&image);
    assert!(e.contains("--camera camera.json"), "{e}");
    fs::write(
        &camera,
        CAMERA.replace('}', r#", "color_time_offset_s": 0.01}"#),
    )
    .expect("written");
    let options = RecordingOptions {
        camera: Some(camera),
        ..RecordingOptions::default()
    };
    let open = || open_as_recorded_with(&image, &options);
    let mut alone = open().expect("opens");
    let noted = alone.untaken().join("; ");
    assert!(
        noted.contains("color_7.png") && noted.contains("offset"),
        "{noted}"
    );
    let frame = alone.next_frame().expect("reads").expect("a frame");
    assert_eq!((frame.depth.at(3, 2), frame.color), (1234, None));
    assert!(alone.next_frame().expect("ends").is_none());

    color(dir.path(), "depth/rgb_7.png", (4, 3), 99);
    let frame = open().expect("opens").next_frame().expect("reads");
    assert_eq!(frame.and_then(|f| f.color).map(|c| c.data()[0]), Some(99));
    color(dir.path(), "depth/color_7.png", (4, 3), 98);
    let e = open().err().expect("ambiguous").to_string();
    assert!(e.contains("rgb_7.png") && e.contains("color_7.png"), "{e}");
}

#[test]
fn names_that_are_times_are_times() {
    let dir = folder(CAMERA);
    depth(dir.path(), "1305031102.160407.png", 1);
    depth(dir.path(), "1305031102.226738.png", 2);
    color(dir.path(), "rgb/1305031102.175304.png", (4, 3), 1);
    color(dir.path(), "rgb/1305031102.211214.png", (4, 3), 2);
    color(dir.path(), "rgb/1305031102.243211.png", (4, 3), 3);
    assert_eq!(values(dir.path()), [(1, Some(1)), (2, Some(2))]);
}

#[test]
fn the_time_offset_of_colour_counts_in_pairing() {
    let late = r#"1000, "color_time_offset_s": -0.016}"#;
    let dir = folder(&CAMERA.replace("1000}", late));
    depth(dir.path(), "1305031102.160407.png", 1);
    depth(dir.path(), "1305031102.226738.png", 2);
    for (i, time) in [".175304", ".211214", ".243211"].iter().enumerate() {
        let name = format!("rgb/1305031102{time}.png");
        color(dir.path(), &name, (4, 3), i as u8);
    }
    // Taken at .159304, .195214 and .227211.
    assert_eq!(values(dir.path()), [(1, Some(0)), (2, Some(2))]);
    let mut source = open_as_recorded(dir.path()).expect("opens");
    assert!(source.color_time_ns().is_none() && source.untaken().is_empty());
    source.next_frame().expect("reads");
    assert_eq!(source.color_time_ns(), Some(1_305_031_102_159_304_000));

    let dir = folder(&CAMERA.replace("1000}", late));
    depth(dir.path(), "1.png", 1);
    color(dir.path(), "rgb/1.png", (4, 3), 7);
    let mut source = open_as_recorded(dir.path()).expect("opens");
    assert!(source.untaken()[0].contains("color_time_offset_s has no effect"));
    source.next_frame().expect("reads");
    assert_eq!(source.color_time_ns(), None, "nothing states it");
}

#[test]
fn colour_that_nothing_pairs_is_named() {
    let dir = folder(CAMERA);
    depth(dir.path(), "a.png", 1);
    depth(dir.path(), "b.png", 2);
    color(dir.path(), "rgb/x.png", (4, 3), 7);
    let source = open_as_recorded(dir.path()).expect("opens");
    let notes = source.untaken().join("\n");
    assert!(
        notes.contains("rgb: 1 colour images are left out"),
        "{notes}"
    );
    assert_eq!(values(dir.path()), [(1, None), (2, None)]);
}

#[test]
fn depth_scale_is_read_both_ways() {
    let scaled = |scale: &str| folder(&CAMERA.replace("\"depth_scale\": 1000", scale));
    for (scale, mm) in [
        ("\"depth_scale\": 5000", 200),
        ("\"depth_scale\": 0.001", 1000),
        ("\"depth_scale\": 0.00025", 250),
    ] {
        let dir = scaled(scale);
        depth(dir.path(), "0.png", 1000);
        assert_eq!(values(dir.path()), [(mm, None)], "{scale}");
    }
    for bad in ["1", "0.5", "-1000", "1e-320", "1e999"] {
        let dir = scaled(&format!("\"depth_scale\": {bad}"));
        depth(dir.path(), "0.png", 1000);
        let e = refusal(dir.path());
        let names_both = e.contains("units per metre") && e.contains("metres per unit");
        assert!(names_both || e.contains("`json`"), "{bad}: {e}");
    }
}

#[test]
fn distortion_is_stated_for_both_cameras() {
    let color_camera = r#", "distortion": [0.1, -0.2, 0.001, 0.002, 0.3],
        "color": {"width": 8, "height": 6, "fx": 9, "fy": 9, "cx": 4, "cy": 3, "distortion": [0, 0, 0, 0, 0, 0.4, 0, 0]}}"#;
    let dir = folder(&CAMERA.replace('}', color_camera));
    depth(dir.path(), "0.png", 1000);
    let lenses = open_as_recorded(dir.path()).expect("opens").lenses();
    assert_eq!(
        lenses.depth.distortion.radial,
        [0.1, -0.2, 0.3, 0.0, 0.0, 0.0]
    );
    assert_eq!(lenses.depth.distortion.tangential, [0.001, 0.002]);
    let radial = lenses.color.map(|c| c.distortion.radial);
    assert_eq!(radial, Some([0.0, 0.0, 0.0, 0.4, 0.0, 0.0]));
    let e = read_camera(&dir.path().join("camera.json")).expect_err("distorted");
    assert!(e.to_string().contains("`distortion`"), "{e}");
    let dir = folder(&CAMERA.replace('}', r#", "distortion": [1, 2, 3]}"#));
    depth(dir.path(), "0.png", 1000);
    assert!(refusal(dir.path()).contains("`distortion`: 3 coefficients"));
}

#[test]
fn wrong_sizes_are_found_when_opened() {
    let dir = folder(CAMERA);
    depth(dir.path(), "0.png", 1000);
    color(dir.path(), "rgb/0.png", (8, 6), 7);
    let e = refusal(dir.path());
    assert!(e.contains("8×6") && e.contains("`color` section"), "{e}");
}

#[test]
fn icl_nuim_is_refused_by_name() {
    let dir = folder(&CAMERA.replace("\"fy\": 5", "\"fy\": -480"));
    let e = refusal(dir.path());
    assert!(
        e.contains("`fy`") && e.contains("ICL-NUIM") && e.contains("write 480"),
        "{e}"
    );
}

#[test]
fn cameras_come_from_the_folder_the_option_or_the_name() {
    let root = tempfile::tempdir().expect("temporary folder");
    let nameless = root.path().join("recording");
    depth(&nameless, "0.png", 5000);
    assert!(refusal(&nameless).contains("--camera"));
    let options = RecordingOptions {
        camera: Some(root.path().join("own.json")),
        ..RecordingOptions::default()
    };
    fs::write(root.path().join("own.json"), CAMERA).expect("written");
    let source = open_as_recorded_with(&nameless, &options).expect("opens");
    assert_eq!(source.calibration().depth.fx, 5.0);
    fs::write(
        nameless.join("camera.json"),
        CAMERA.replace("\"fx\": 5", "\"fx\": 6"),
    )
    .expect("written");
    let source = open_as_recorded_with(&nameless, &options).expect("opens");
    assert_eq!(source.calibration().depth.fx, 6.0);
    assert!(source.untaken()[0].contains("its own camera.json"));

    let tum = root.path().join("rgbd_dataset_freiburg1_xyz");
    fs::create_dir_all(tum.join("depth")).expect("created");
    let image = DepthImage::new(640, 480, vec![5000; 640 * 480]).expect("sizes");
    write_png_depth(&tum.join("depth/1305031102.160407.png"), &image).expect("written");
    let mut source = open_as_recorded(&tum).expect("opens");
    assert_eq!(source.lenses().depth.distortion.radial[0], 0.262_383);
    let frame = source.next_frame().expect("reads").expect("a frame");
    assert_eq!(
        (frame.depth.at(9, 9), frame.time_ns),
        (1000, 1_305_031_102_160_407_000)
    );
}

proptest! {
    /// `camera.json` and time lists with damage: an error or a folder, never a panic.
    #[test]
    fn damaged_texts_never_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        is_camera in any::<bool>(),
    ) {
        let dir = folder(CAMERA);
        depth(dir.path(), "0.png", 1000);
        let list = "0.000000 depth/0.png\n0.033333 depth/0.png\n";
        fs::write(dir.path().join("depth.txt"), list).expect("written");
        let (name, text) = if is_camera { ("camera.json", CAMERA) } else { ("depth.txt", list) };
        let mut bytes = text.as_bytes().to_vec();
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        fs::write(dir.path().join(name), bytes).expect("written");
        if let Ok(mut source) = open_as_recorded(dir.path()) {
            while !matches!(source.next_frame(), Ok(None)) {}
        }
    }
}

/// Folders after reports of users; the right values are in the README beside them.
#[test]
fn reported_folders_read() {
    let Some(root) = crate::shared_data("reports") else {
        return;
    };
    let read = |name: &str| values(&root.join(name));
    let unpadded = read("folder_unpadded_names");
    let depths: Vec<u16> = unpadded.iter().map(|v| v.0).collect();
    assert!(depths.len() == 12 && depths.is_sorted(), "{depths:?}");
    assert!(unpadded.iter().all(|v| v.1.is_some()));
    assert_eq!(read("folder_scale_metres")[0].0, 1000);
    assert!(read("folder_color_dir").iter().all(|v| v.1.is_some()));
}
