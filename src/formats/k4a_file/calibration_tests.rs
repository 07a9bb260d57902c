//! Modes of the device and its calibrations.

use super::*;

/// Table of the device's documentation: image, sensor of that scale, first row.
#[test]
fn modes_are_those_of_the_device() {
    for (w, h, sensor_height, row) in [
        (1280, 720, 960.0, 120.0),
        (1920, 1080, 1440.0, 180.0),
        (2560, 1440, 1920.0, 240.0),
        (2048, 1536, 1536.0, 0.0),
        (3840, 2160, 2880.0, 360.0),
        (4096, 3072, 3072.0, 0.0),
    ] {
        let mode = color_mode(w, h).expect("a mode");
        assert_eq!(
            (mode.sensor, mode.crop),
            ([f64::from(w), sensor_height], [0.0, row])
        );
    }
    assert!(color_mode(640, 640).is_none() && depth_mode(640, 480).is_none());
}

/// A 16:9 calibration and the 4:3 one of the same camera give the same lens.
#[test]
fn early_files_state_the_middle_rows() {
    let camera = |center, focal, height| SensorCamera {
        center: [0.5, center],
        focal: [0.48, focal],
        distortion: Distortion::default(),
        sensor: [4096.0, height],
        rotation: UnitQuaternion::identity(),
        translation: Vector3::zeros(),
    };
    let path = Path::new("x.mkv");
    let mode = color_mode(1280, 720).expect("a mode");
    // 1152 and 1966.08 pixels of 2304 rows; 1536 and 1966.08 of 3072.
    let early = camera(0.5, 1966.08 / 2304.0, 2304.0).whole_sensor();
    let early = early
        .lens(path, mode, (1280, 720))
        .expect("a lens")
        .intrinsics;
    let late = camera(0.5, 0.64, 3072.0).whole_sensor();
    let late = late
        .lens(path, mode, (1280, 720))
        .expect("a lens")
        .intrinsics;
    assert!((early.fy - late.fy).abs() < 1e-9 && (early.cy - late.cy).abs() < 1e-9);
    assert!((late.cy - 359.5).abs() < 1e-9 && (late.fy - 614.4).abs() < 1e-9);
}
