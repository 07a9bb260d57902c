//! Replay of a Kinect v1: a recording in fakenect's format, and the library that plays it.

use std::fs;
use std::path::{Path, PathBuf};

/// Pixels of an image.
pub(crate) const PIXELS: usize = 640 * 480;
/// Ticks of the camera's 60 MHz clock from depth to depth, and from depth to its colour.
pub(crate) const PERIOD: u32 = 2_000_000;
pub(crate) const COLOR_DELAY: u32 = 300_000;

/// Folder of the libfreenect that replays, of Debian's libfreenect0.5; skips loudly without it.
pub(crate) fn replay_library() -> Option<PathBuf> {
    let machines = fs::read_dir("/usr/lib").expect("a folder of libraries");
    let folders = machines.filter_map(|m| Some(m.ok()?.path().join("fakenect")));
    let found = folders
        .into_iter()
        .find(|f| f.join("libfreenect.so.0.5").exists());
    if found.is_none() {
        let why = "fakenect is missing: apt-get install libfreenect0.5";
        assert!(std::env::var_os("TRYON_REQUIRE_ALL").is_none(), "{why}");
        eprintln!("SKIPPED: {why}");
    }
    found
}

/// Disparity of a pixel of an image: all depths in reach, some without a reading.
pub(crate) fn disparity(image: u32, pixel: usize) -> u16 {
    let i = pixel as u32 + 977 * image;
    if i.is_multiple_of(11) {
        2047
    } else {
        430 + (i % 560) as u16
    }
}

/// Colour of a pixel of an image.
pub(crate) fn color(image: u32, pixel: usize) -> [u8; 3] {
    [pixel as u8, (pixel / 640) as u8, 40 + 30 * image as u8]
}

/// Writes a recording of `images` images of each stream at 30 Hz, played `rounds` times; the device's clock begins at
/// `ticks` and goes on through all rounds.
pub(crate) fn write_recording(folder: &Path, images: u32, rounds: u32, ticks: u32) {
    for image in 0..images {
        let depth = (0..PIXELS).flat_map(|p| disparity(image, p).to_le_bytes());
        let header = b"P5 640 480 65535\n";
        write(
            &folder.join(format!("depth{image}")),
            header,
            depth.collect(),
        );
        let rgb = (0..PIXELS).flat_map(|p| color(image, p));
        let header = b"P6 640 480 255\n";
        write(&folder.join(format!("rgb{image}")), header, rgb.collect());
    }
    let mut index = String::new();
    let mut add = |name: String, content: String| {
        fs::hard_link(folder.join(content), folder.join(&name)).expect("linked");
        index += &format!("{name}\n");
    };
    for k in 0..images * rounds {
        let (image, seconds) = (k % images, 1000.0 + f64::from(k) / 30.0);
        let ticks = ticks.wrapping_add(PERIOD.wrapping_mul(k));
        let late = (seconds + 0.005, ticks.wrapping_add(COLOR_DELAY));
        add(
            format!("d-{seconds:.6}-{ticks}.pgm"),
            format!("depth{image}"),
        );
        add(
            format!("r-{:.6}-{}.ppm", late.0, late.1),
            format!("rgb{image}"),
        );
    }
    fs::write(folder.join("INDEX.txt"), index).expect("written");
}

fn write(path: &Path, header: &[u8], body: Vec<u8>) {
    fs::write(path, [header, &body].concat()).expect("written");
}
