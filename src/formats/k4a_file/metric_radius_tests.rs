//! Rays beyond the metric radius of a calibration, against k4a's own verdict on each pixel.

use super::calibration::lenses;
use crate::recording::open_recording;
use serde_json::Value;
use std::path::Path;
use tryon_geometry::camera::Lens;

/// A row of an image: its number, the first and the last valid pixel, and the count of valid ones.
type ValidRow = (u32, u32, u32, usize);

/// Bytes of a device's recording.
fn recording() -> Option<Vec<u8>> {
    let path = crate::shared_data("rgbd/k4a_recording/recording.mkv")?;
    Some(std::fs::read(path).expect("read"))
}

/// The attached calibration with other metric radii of depth and colour.
fn calibration(recording: &[u8], radii: [Value; 2]) -> Vec<u8> {
    let start = b"{\"CalibrationInformation\"";
    let at = recording.windows(start.len()).position(|w| w == start);
    let text = &recording[at.expect("attached")..];
    let mut values = serde_json::Deserializer::from_slice(text).into_iter::<Value>();
    let mut file = values.next().expect("a value").expect("JSON");
    for (camera, radius) in radii.into_iter().enumerate() {
        file["CalibrationInformation"]["Cameras"][camera]["MetricRadius"] = radius;
    }
    file.to_string().into_bytes()
}

fn valid_row(lens: &Lens, v: u32) -> ValidRow {
    let k = &lens.intrinsics;
    let is_valid = |u: &u32| {
        let drawn = [(f64::from(*u) - k.cx) / k.fx, (f64::from(v) - k.cy) / k.fy];
        lens.distortion.undistort(drawn).is_some()
    };
    let valid: Vec<u32> = (0..k.width).filter(is_valid).collect();
    let end = |u: Option<&u32>| u.copied().unwrap_or(u32::MAX);
    (v, end(valid.first()), end(valid.last()), valid.len())
}

const NONE: u32 = u32::MAX;

/// Columns for which k4a_calibration_2d_to_3d of libk4a 1.4.2 (pyk4a-bundle 1.5.0) states valid.
#[test]
fn valid_pixels_are_those_of_the_sdk() {
    let Some(bytes) = recording() else {
        return;
    };
    let depth = |radius: f64, size: (u32, u32), rows: &[ValidRow]| {
        let json = calibration(&bytes, [radius.into(), 0.into()]);
        let lenses = lenses(Path::new("a.mkv"), &json, size, None).expect("a calibration");
        for row in rows {
            assert_eq!(valid_row(&lenses.depth, row.0), *row, "{radius} {size:?}");
        }
    };
    depth(
        1.739_999_771_118_164,
        (512, 512),
        &[
            (0, NONE, NONE, 0),
            (64, 102, 422, 321),
            (128, 45, 479, 435),
            (256, 6, 511, 506),
            (384, 36, 488, 453),
            (511, 193, 331, 139),
        ],
    );
    // The SDK's own radius.
    depth(
        0.0,
        (512, 512),
        &[(64, 106, 418, 313), (511, 201, 323, 123)],
    );
    depth(
        0.5,
        (640, 576),
        &[
            (72, NONE, NONE, 0),
            (144, 221, 444, 224),
            (432, 115, 550, 436),
        ],
    );
    depth(1.2, (320, 288), &[(0, 36, 296, 261), (36, 0, 319, 320)]);

    let json = calibration(&bytes, [1.74.into(), 0.7.into()]);
    let both = lenses(Path::new("a.mkv"), &json, (640, 576), Some((1280, 720)));
    let color = both.expect("a calibration").color.expect("colour");
    for row in [
        (0, 390, 888, 499),
        (360, 197, 1081, 885),
        (719, 373, 905, 533),
    ] {
        assert_eq!(valid_row(&color, row.0), row);
    }
}

#[test]
fn frames_have_no_reading_and_no_colour_beyond_the_radius() {
    const STATED: &[u8] = b"\"MetricRadius\":1.7399997711181641";
    const SMALLER: &[u8] = b"\"MetricRadius\":0.5000000000000000";
    let Some(mut bytes) = recording() else {
        return;
    };
    let dir = tempfile::tempdir().expect("temporary folder");
    let read = |name: &str, bytes: &[u8]| {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        let mut source = open_recording(&path).expect("opens");
        let frame = source.next_frame().expect("reads").expect("a frame");
        (source.calibration().depth, frame)
    };
    let (_, whole) = read("whole.mkv", &bytes);
    let at = bytes.windows(STATED.len()).position(|w| w == STATED);
    let at = at.expect("a radius");
    bytes[at..at + SMALLER.len()].copy_from_slice(SMALLER);
    let (k, cut) = read("cut.mkv", &bytes);
    let mut left = 0;
    for v in 0..k.height {
        for u in 0..k.width {
            let ray = [(f64::from(u) - k.cx) / k.fx, (f64::from(v) - k.cy) / k.fy];
            let (u, v) = (u as i32, v as i32);
            let is_inside = ray[0].hypot(ray[1]) < 0.5;
            let expected = if is_inside { whole.depth.at(u, v) } else { 0 };
            assert_eq!(cut.depth.at(u, v), expected, "{u}, {v}");
            left += usize::from(expected > 0);
        }
    }
    assert!(left > 50_000, "{left} readings");
    assert_eq!(cut.color, whole.color, "the radius of the other camera");
}

#[test]
fn radii_that_are_none_are_refused_by_name() {
    let Some(bytes) = recording() else {
        return;
    };
    for bad in [Value::from(-1.0), Value::from("wide")] {
        let json = calibration(&bytes, [bad, 0.into()]);
        let e = lenses(Path::new("a.mkv"), &json, (640, 576), None).expect_err("no radius");
        assert!(
            e.to_string()
                .contains("CALIBRATION_CameraLocationD0.MetricRadius"),
            "{e}"
        );
    }
}
