use super::*;
use crate::RgbdSource;
use crate::image::write_png_depth;
use nalgebra::{UnitQuaternion, Vector3};
use std::fs;
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::Rigid;

const TINY: Intrinsics = Intrinsics {
    width: 4,
    height: 3,
    fx: 5.0,
    fy: 5.5,
    cx: 1.5,
    cy: 1.0,
};

fn frame(i: u64, color: bool) -> RgbdFrame {
    let depth =
        DepthImage::new(4, 3, (0..12).map(|k| 1000 + k + i as u16).collect()).expect("sizes");
    let color = color.then(|| ColorImage::filled(4, 3, [i as u8, 40, 200]));
    RgbdFrame {
        sequence: i,
        time_ns: 1_700_000_000_000_000_000 + i * 33_333_333,
        depth,
        color,
    }
}

fn all(source: &mut dyn RgbdSource) -> Vec<RgbdFrame> {
    std::iter::from_fn(|| source.next_frame().expect("reads")).collect()
}

fn folder_with(camera: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("temporary folder");
    fs::create_dir(dir.path().join("depth")).expect("folder");
    fs::write(dir.path().join("camera.json"), camera).expect("written");
    write_png_depth(&dir.path().join("depth/0.png"), &frame(0, false).depth).expect("written");
    dir
}

fn camera(fx: &str, more: &str) -> String {
    format!(r#"{{"width": 4, "height": 3, "fx": {fx}, "fy": 5, "cx": 1.5, "cy": 1{more}}}"#)
}

fn refusal(dir: &tempfile::TempDir) -> String {
    match RgbdFolder::open(dir.path()) {
        Err(e) => e.to_string(),
        Ok(mut f) => f.next_frame().expect_err("must be refused").to_string(),
    }
}

#[test]
fn written_frames_read_back() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.01, -0.02, 0.005));
    let calibration = Calibration {
        depth: TINY,
        color: Some(TINY),
        color_from_depth: Rigid::from_parts(Vector3::new(0.025, 0.0, 0.001), turn),
    };
    let mut w = RgbdFolderWriter::create(dir.path(), &calibration).expect("created");
    // Colour is missing in the middle.
    let frames: Vec<RgbdFrame> = (0..4).map(|i| frame(i, i != 2)).collect();
    frames.iter().for_each(|f| w.write(f).expect("written"));
    let mut r = crate::open_recording(dir.path()).expect("opens");
    assert_eq!(r.len(), Some(4));
    let k = r.calibration();
    assert_eq!((k.depth, k.color), (TINY, Some(TINY)));
    assert!(
        (k.color_from_depth.inverse() * calibration.color_from_depth)
            .iso()
            .translation
            .vector
            .norm()
            < 1e-12
    );
    let got = all(r.as_mut());
    assert_eq!(got[0], frames[0]);
    assert_eq!(got[3], frames[3]);
    // The neighbour's colour is 33.3 ms away: within the gap.
    assert!(got[2].color.is_some() && got[2].depth == frames[2].depth);
    r.rewind().expect("rewinds");
    assert_eq!(all(r.as_mut()), got);
    assert!(
        RgbdFolderWriter::create(dir.path(), &calibration).is_err(),
        "never writes over a recording"
    );
}

#[test]
fn unlisted_images_sort_at_30_hz_and_scale_to_millimetres() {
    let dir = folder_with(&camera("5", r#", "depth_scale": 10000"#));
    write_png_depth(&dir.path().join("depth/1.png"), &frame(9, false).depth).expect("written");
    let mut f = RgbdFolder::open(dir.path()).expect("opens");
    let got = all(&mut f);
    assert_eq!(
        (got.len(), got[1].time_ns, got[0].depth.data()[3]),
        (2, 33_333_333, 100)
    );
    // Units of a centimetre: 65,535 units exceed 16 bits of millimetres.
    let mut far = DepthImage::new(2, 1, vec![65_535, 100]).expect("sizes");
    depth_to_mm(&mut far, 100.0);
    assert_eq!(far.data(), [0, 1000]);
}

#[test]
fn bad_folders_name_file_and_field() {
    let dir = folder_with(&camera("NaN", ""));
    let e = refusal(&dir);
    assert!(
        e.contains("camera.json") && e.contains("`fx`") && e.contains("finite"),
        "{e}"
    );
    for (text, field) in [
        (camera("-5", ""), "`fx`"),
        (camera("\"five\"", ""), "`fx`"),
        (camera("5", r#", "depth_scale": 0"#), "`depth_scale`"),
        (camera("5", r#", "color": {"width": 4}"#), "`color.height`"),
        (
            camera("5", r#", "color_time_offset_s": 1.5"#),
            "`color_time_offset_s`",
        ),
        (
            camera("5", r#", "color_from_depth": {"translation": [0, 0]}"#),
            "`color_from_depth.translation`",
        ),
        (
            camera(
                "5",
                r#", "color_from_depth": {"translation": [0,0,0], "rotation": [0,0,0,2]}"#,
            ),
            "rotation`",
        ),
        ("[1]".into(), "`json`"),
        ("{\"width\": 4".into(), "`json`"),
        (r#"{"width": 4.5, "height": 3}"#.into(), "`width`"),
    ] {
        let dir = folder_with(&text);
        let e = refusal(&dir);
        assert!(
            e.contains("camera.json") && e.contains(field),
            "{text}: {e}"
        );
    }
    // A picture of another size, a truncated one, none at all.
    let dir = folder_with(&camera("5", "").replace("\"width\": 4", "\"width\": 8"));
    let e = refusal(&dir);
    assert!(
        e.contains("0.png") && e.contains("`depth size`") && e.contains("8×3"),
        "{e}"
    );
    let dir = folder_with(&camera("5", ""));
    let png = dir.path().join("depth/0.png");
    let bytes = fs::read(&png).expect("read");
    fs::write(&png, &bytes[..bytes.len() / 2]).expect("written");
    let e = refusal(&dir);
    assert!(e.contains("0.png") && e.contains("cut short"), "{e}");
    fs::remove_file(&png).expect("removed");
    assert!(refusal(&dir).contains("no depth images"));
    let nothing = tempfile::tempdir().expect("temporary folder");
    assert!(refusal(&nothing).contains("camera.json"));
    // A list that leads elsewhere, and one with a bad line.
    let dir = folder_with(&camera("5", ""));
    fs::write(dir.path().join("depth.txt"), "0.0 ../../etc/passwd\n").expect("written");
    assert!(refusal(&dir).contains("out of the folder"));
    fs::write(
        dir.path().join("depth.txt"),
        "# list\n0.0 depth/0.png\nsoon depth/1.png\n",
    )
    .expect("written");
    assert!(refusal(&dir).contains("`line 3`"));
}

#[test]
fn reading_continues_after_a_bad_frame() {
    let dir = folder_with(&camera("5", ""));
    write_png_depth(&dir.path().join("depth/1.png"), &frame(1, false).depth).expect("written");
    fs::write(dir.path().join("depth/0.png"), b"no picture").expect("written");
    let mut f = RgbdFolder::open(dir.path()).expect("opens");
    assert!(f.next_frame().is_err());
    assert_eq!(f.next_frame().expect("reads").map(|f| f.sequence), Some(1));
    assert!(f.next_frame().expect("ends").is_none());
}

#[test]
fn shared_recordings_open() {
    let Some(root) = crate::shared_data("") else {
        return;
    };
    for (name, frames, color) in [
        ("rgbd/depthkit_still", 1, true),
        ("rgbd/itop_stills", 64, false),
        ("rgbd/itop_still_320x240", 1, false),
        ("sequences/jacks_f_avg_kinect1_room", 180, false),
    ] {
        let mut r = crate::open_recording(&root.join(name)).expect(name);
        assert_eq!(r.len(), Some(frames), "{name}");
        let f = r.next_frame().expect(name).expect(name);
        assert_eq!(f.color.is_some(), color, "{name}");
        let seen = f
            .depth
            .data()
            .iter()
            .filter(|d| (300..8000).contains(*d))
            .count();
        assert!(
            seen * 10 > f.depth.data().len(),
            "{name}: {seen} pixels between 0.3 and 8 m"
        );
    }
}
