//! OpenNI 2 by its own dummy driver, which draws a disc that moves: pixel for pixel.

use std::path::{Path, PathBuf};
use tryon_devices::{DeviceOptions, Family, Stream, list, open, open_with};

const SIZE: [i32; 2] = [320, 240];

/// A calibration of the dummy, which states none; skips loudly without the library.
fn calibration(folder: &Path) -> Option<DeviceOptions> {
    if let Err(why) = tryon_devices::check("openni") {
        assert!(std::env::var_os("TRYON_REQUIRE_ALL").is_none(), "{why}");
        eprintln!("SKIPPED: {why}");
        return None;
    }
    let camera = folder.join("camera.json");
    let text =
        r#"{"width": 320, "height": 240, "fx": 285.0, "fy": 285.0, "cx": 159.5, "cy": 119.5}"#;
    std::fs::write(&camera, text).expect("written");
    Some(DeviceOptions {
        camera: Some(camera),
    })
}

/// Centre of the disc in the image of a number, from 1: it bounces off the borders.
fn center(number: u64, mut at: [i32; 2], mut step: [i32; 2]) -> [i32; 2] {
    for _ in 1..number {
        for k in 0..2 {
            at[k] += step[k];
            if at[k] < step[k].abs() || at[k] > SIZE[k] - 1 - step[k].abs() {
                step[k] = -step[k];
            }
        }
    }
    at
}

/// True within the disc.
fn is_inside([x, y]: [i32; 2], [u, v]: [i32; 2]) -> bool {
    let near = |a: i32, c: i32| (c - 10..c + 10).contains(&a);
    near(x, u) && near(y, v) && (x - u) * (x - u) + (y - v) * (y - v) < 70
}

fn depth(number: u64, [x, y]: [i32; 2]) -> u16 {
    if y == 0 {
        2000
    } else if is_inside([x, y], center(number, [0, 0], [1, 1])) {
        (1000 + (x - y) * 3) as u16
    } else {
        0
    }
}

fn color(number: u64, [x, y]: [i32; 2]) -> [u8; 3] {
    let share = |a: i32, side: i32| (255.0 * (f64::from(a) / f64::from(side))) as u8;
    let mut rgb = [0; 3];
    if is_inside([x, y], center(number, [160, 120], [-3, 1])) {
        rgb = [
            share(x, SIZE[0]),
            share(y, SIZE[1]),
            share(SIZE[0] - x, SIZE[0]),
        ];
    }
    if [x, y] == [0, 0] {
        rgb[2] = 255;
    }
    rgb
}

fn pixels() -> impl Iterator<Item = [i32; 2]> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]))
}

#[test]
fn frames_are_those_that_the_driver_draws() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(options) = calibration(folder.path()) else {
        return;
    };
    let mut with_color = 0;
    for _ in 0..2 {
        let mut source = open_with("openni:Dummy", &options).expect("opened");
        assert_eq!(source.calibration().depth.fx, 285.0);
        let mut last = 0;
        for _ in 0..25 {
            let frame = source.next_frame().expect("a frame").expect("endless");
            // Its time is 33 ms times its number.
            let number = frame.time_ns / 33_000_000;
            assert!(
                number > last && frame.time_ns.is_multiple_of(33_000_000),
                "{}",
                frame.time_ns
            );
            last = number;
            let expected: Vec<u16> = pixels().map(|p| depth(number, p)).collect();
            assert!(frame.depth.data() == expected, "depth of image {number}");
            if let Some(rgb) = frame.color {
                let expected: Vec<u8> = pixels().flat_map(|p| color(number, p)).collect();
                assert!(rgb.data() == expected, "colour of image {number}");
                with_color += 1;
            }
        }
    }
    // Its threads count by themselves: on a busy machine colour falls behind depth, and has another time.
    assert!(with_color >= 3, "{with_color}");
    // Known from now on, by its place: it states no serial number.
    let report = list().into_iter().find(|r| r.family == Family::Openni);
    let devices = report.expect("each family").devices.expect("its library");
    let dummy = devices
        .iter()
        .find(|d| d.serial == "Dummy")
        .expect("listed");
    assert_eq!(dummy.name, "Table Tennis");
    let modes: Vec<_> = dummy
        .modes
        .iter()
        .map(|m| (m.stream, m.width, m.height, m.rate))
        .collect();
    assert_eq!(
        modes,
        [
            (Stream::Depth, 320, 240, 30.0),
            (Stream::Color, 320, 240, 30.0)
        ]
    );
}

#[test]
fn what_is_missing_is_said_with_the_way_around() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(options) = calibration(folder.path()) else {
        return;
    };
    let fault = |source: &str, options: &DeviceOptions| {
        open_with(source, options)
            .err()
            .expect("refused")
            .to_string()
    };
    // Neither registration nor fields of view.
    let unstated = fault("openni:Oz", &DeviceOptions::default());
    assert!(
        unstated.starts_with("openni:Oz: `camera`: ") && unstated.contains("camera.json"),
        "{unstated}"
    );
    let absent = open("openni:17120110193")
        .err()
        .expect("refused")
        .to_string();
    assert!(
        absent.starts_with("openni:17120110193: not plugged in; "),
        "{absent}"
    );
    let large = folder.path().join("large.json");
    let text = std::fs::read_to_string(options.camera.expect("written")).expect("read");
    std::fs::write(&large, text.replace("320", "640")).expect("written");
    let of = |camera: PathBuf| DeviceOptions {
        camera: Some(camera),
    };
    let size = fault("openni:PingPong", &of(large));
    assert!(
        size.contains("(320, 240)") && size.contains("(640, 240)"),
        "{size}"
    );
    let none = fault("openni:PingPong", &of(folder.path().join("none.json")));
    assert!(none.contains("none.json"), "{none}");
}
