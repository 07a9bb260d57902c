//! From a recording to a picture: the person in it, dressed.
//!
//! ```text
//! cargo run --release --example hello_mirror -- RECORDING [GARMENT [OUT.png]]
//! ```

use std::path::Path;
use tryon::body::embedded;
use tryon::formats::image::write_png_rgb;
use tryon::formats::open_recording;
use tryon::mirror::{Choice, Mirror};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let input = args.next().ok_or("the path of a recording is missing")?;
    let garment = args.next().unwrap_or_else(|| "tshirt".into());
    let out = args.next().unwrap_or_else(|| "hello_mirror.png".into());

    let mut recording = open_recording(Path::new(&input))?;
    let choices = vec![Choice::library(&garment, None)?];
    let mut mirror = Mirror::new(embedded::template(), recording.calibration(), choices);

    let mut picture = None;
    while let Some(frame) = recording.next_frame()? {
        let seen = mirror.step(&frame)?;
        if seen.is_dressed {
            picture = Some(seen.picture);
        }
    }

    let picture = picture.ok_or("nobody was dressed")?;
    Ok(write_png_rgb(Path::new(&out), &picture)?)
}
