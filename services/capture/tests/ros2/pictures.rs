//! Pictures and calibrations against those that were serialised, and what is said where there are none.

use crate::cameras::{Cameras, PATIENCE, next, numbers};
use std::time::Instant;
use tryon_capture_service::open_with;
use tryon_kit::bus::free_tcp_endpoint;
use tryon_kit::config::Ros2Config;

/// Largest difference of two decoders of one JPEG, levels: the standard leaves their arithmetic open.
const JPEG: i32 = 2;

#[test]
fn pictures_are_those_that_were_serialised_under_both_forms_of_keys() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    for (camera, difference) in [
        ("raw", 0),
        ("metres", JPEG),
        ("small", JPEG),
        ("bridged", 0),
    ] {
        let mut source = cameras.open(camera);
        let (mut seen, mut last, begun) = ([false; 4], 0, Instant::now());
        while seen != [true; 4] {
            assert!(begun.elapsed() < PATIENCE, "{camera}: {seen:?}");
            let frame = next(&mut source);
            let k = cameras.picture(camera, &frame);
            assert!(frame.time_ns > last, "{camera}: times grow");
            last = frame.time_ns;
            // On a busy machine colour may be too late.
            let Some(color) = frame.color else { continue };
            let want = numbers(&cameras.expected[camera]["pictures"][k]["color"]);
            let pixels = color.data().iter().zip(&want);
            let worst = pixels.map(|(a, b)| (i32::from(*a) - *b as i32).abs()).max();
            assert!(
                worst.is_some_and(|w| w <= difference),
                "{camera}: {worst:?}"
            );
            seen[k] = true;
        }
        let calibration = source.calibration();
        let (depth, color) = (calibration.depth, calibration.color.expect("its own"));
        assert_eq!((depth.width, depth.fx, depth.cy), (16, 20.5, 5.25));
        assert_eq!((color.height, color.fy, color.cx), (32, 43.5, 23.75));
        let to_color = calibration.color_from_depth.iso().translation.vector;
        // Of one camera alone the transforms are known; optical frames have x to the right and y down.
        let want = match camera {
            "raw" => [-0.025, 0.002, 0.0],
            _ => [0.0; 3],
        };
        let off = to_color.iter().zip(want).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12, "{camera}: {to_color}");
    }
}

#[test]
fn who_configures_is_told_what_there_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let refused = |source: &str, network: &Ros2Config| {
        open_with(source, None, network)
            .err()
            .expect("refused")
            .to_string()
    };
    let e = refused("ros2:/camera/depth/image_rect_raw", &cameras.network);
    assert!(e.starts_with("ros2:/camera/depth/image_rect_raw: "), "{e}");
    for named in [
        "/camera/depth/camera_info",
        "`/raw/depth/image_raw`",
        "domain 0",
        "`/bridged/color/image_raw`",
    ] {
        assert!(e.contains(named), "{named}: {e}");
    }
    assert!(
        !e.contains("tf_static") && !e.contains("`/raw/depth/camera_info`"),
        "{e}"
    );
    let nowhere = Ros2Config {
        connect: vec![free_tcp_endpoint().expect("a port")],
        ..cameras.network.clone()
    };
    let e = refused(&cameras.source("raw"), &nowhere);
    assert!(e.contains(&nowhere.connect[0]), "{e}");
}
