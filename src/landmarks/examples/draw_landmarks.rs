//! Landmarks drawn over the pictures of a recording, and what they say: one line of JSON a frame.
//!
//! `cargo run --release -p tryon-landmarks --example draw_landmarks -- target/landmarks.onnx RECORDING OUT`
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::Path;
use std::time::Instant;
use tryon_formats::image::write_png_rgb;
use tryon_formats::open_recording;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::V3;
use tryon_landmarks::{LandmarkLifter, Landmarker, PoseLandmarks};

/// Pairs of landmarks that a line joins.
const BONES: [[usize; 2]; 18] = [
    [11, 12],
    [11, 13],
    [13, 15],
    [12, 14],
    [14, 16],
    [11, 23],
    [12, 24],
    [23, 24],
    [23, 25],
    [25, 27],
    [24, 26],
    [26, 28],
    [27, 31],
    [28, 32],
    [15, 19],
    [16, 20],
    [7, 2],
    [8, 5],
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, recording, out] = arguments.as_slice() else {
        return Err("draw_landmarks MODEL RECORDING OUT".into());
    };
    let mut landmarker = Landmarker::open(model)?;
    let mut source = open_recording(Path::new(recording))?;
    let mut lifter = LandmarkLifter::new(source.calibration().clone());
    std::fs::create_dir_all(out)?;
    while let Some(frame) = source.next_frame()? {
        let Some(color) = &frame.color else { continue };
        let start = Instant::now();
        let Some(pose) = landmarker.find(color)? else {
            println!("{{\"frame\": {}, \"person\": null}}", frame.sequence);
            continue;
        };
        let found_ms = start.elapsed().as_secs_f64() * 1e3;
        let lifted = lifter.lift(&frame.depth, &pose)?;
        let all_ms = start.elapsed().as_secs_f64() * 1e3;
        let yaw = lifted.trunk.yaw(&V3::new(0.0, -1.0, 0.0));
        let yaw = yaw.map_or("null".to_owned(), |yaw| format!("{:.0}", yaw.to_degrees()));
        println!(
            "{{\"frame\": {}, \"presence\": {:.3}, \"yaw_if_level\": {yaw}, \"joints\": {}, \"find_ms\": {found_ms:.1}, \
             \"lift_ms\": {:.1}, \"pixels\": {:?}}}",
            frame.sequence,
            pose.presence,
            lifted.joints.iter().flatten().count(),
            all_ms - found_ms,
            pose.landmarks.map(|l| l.pixel)
        );
        let file = Path::new(out).join(format!("{:06}.png", frame.sequence));
        write_png_rgb(&file, &drawn(color, &pose))?;
    }
    Ok(())
}

/// Bones in green where both ends are likely visible, else in red; the person's left shoulder in blue.
fn drawn(image: &ColorImage, pose: &PoseLandmarks) -> ColorImage {
    let mut image = image.clone();
    for bone in BONES {
        let [a, b] = bone.map(|k| pose.landmarks[k]);
        let is_seen = [a, b].iter().all(|l| l.visibility.min(l.presence) > 0.5);
        let color = if is_seen { [0, 255, 0] } else { [255, 0, 0] };
        for step in 0..=200 {
            let t = step as f32 / 200.0;
            let at = [0, 1].map(|c| a.pixel[c] * (1.0 - t) + b.pixel[c] * t);
            dot(&mut image, at, 1, color);
        }
    }
    dot(&mut image, pose.landmarks[0].pixel, 4, [255, 255, 0]);
    dot(&mut image, pose.landmarks[11].pixel, 5, [0, 0, 255]);
    image
}

/// Square of a colour, within the picture.
fn dot(image: &mut ColorImage, at: [f32; 2], radius: i32, color: [u8; 3]) {
    let (width, height) = (image.width() as i32, image.height() as i32);
    let [u, v] = at.map(|c| c.round() as i32);
    for y in (v.saturating_sub(radius)).max(0)..(v.saturating_add(radius + 1)).min(height) {
        for x in (u.saturating_sub(radius)).max(0)..(u.saturating_add(radius + 1)).min(width) {
            let pixel = 3 * (y * width + x) as usize;
            image.data_mut()[pixel..pixel + 3].copy_from_slice(&color);
        }
    }
}
