//! Pass one: the captured picture at the output's size, and its depth from the picture's camera.

use super::framing::Stage;
use super::input::Input;
use super::look::linear;
use crate::camera::{ColorImage, DepthImage};
use crate::math::{P3, V3};
use crate::par::{self, Par};
use std::borrow::Cow;

/// Rows resized by one task.
const ROWS: usize = 16;

/// The captured picture at the output's size: copied when sizes agree, else bilinear. Depth in grey where there is no
/// colour.
pub(crate) fn captured(par: Par, input: &Input<'_>, stage: &Stage) -> ColorImage {
    let grey;
    let source = match &input.frame.color {
        Some(color) => color,
        None => {
            grey = grey_depth(&input.frame.depth, stage);
            &grey
        }
    };
    let (width, height) = (stage.camera.width, stage.camera.height);
    if [width, height] == [source.width(), source.height()] {
        return source.clone();
    }
    let mut out = ColorImage::filled(width, height, [0; 3]);
    let columns: Vec<(usize, u32)> = (0..width)
        .map(|u| match tap(stage.color_at(0, u), source.width()) {
            Some((i, w)) => (3 * i, w),
            None => (usize::MAX, 0),
        })
        .collect();
    let stride = 3 * source.width() as usize;
    let row_bytes = 3 * width as usize;
    par::for_chunks(par, out.data_mut(), row_bytes * ROWS, |start, chunk| {
        let mut line = vec![0u16; stride + 3];
        for (k, row) in chunk.chunks_mut(row_bytes).enumerate() {
            let v = (start / row_bytes + k) as u32;
            let Some((i, w)) = tap(stage.color_at(1, v), source.height()) else {
                continue;
            };
            let upper = &source.data()[i * stride..(i + 1) * stride];
            let next = (i + 1).min(source.height() as usize - 1);
            let lower = &source.data()[next * stride..(next + 1) * stride];
            let w = w as u16;
            for ((l, a), b) in line.iter_mut().zip(upper).zip(lower) {
                *l = u16::from(*a) * (128 - w) + u16::from(*b) * w;
            }
            line.copy_within(stride - 3..stride, stride);
            for (pixel, &(i, w)) in row.chunks_exact_mut(3).zip(&columns) {
                if i == usize::MAX {
                    continue;
                }
                for (c, out) in pixel.iter_mut().enumerate() {
                    let (a, b) = (u32::from(line[i + c]), u32::from(line[i + 3 + c]));
                    *out = ((a * (128 - w) + b * w + (1 << 13)) >> 14) as u8;
                }
            }
        }
    });
    out
}

/// First source index and weight (of 128) of the second; `None` outside the image.
fn tap(x: f64, side: u32) -> Option<(usize, u32)> {
    if x < -0.5 || x > f64::from(side) - 0.5 {
        return None;
    }
    let x = x.clamp(0.0, f64::from(side - 1));
    Some((x as usize, (x.fract() * 128.0).round() as u32))
}

/// Without colour there is still a picture to judge the fit by: near is bright.
fn grey_depth(depth: &DepthImage, stage: &Stage) -> ColorImage {
    let mut out = ColorImage::filled(stage.color[0], stage.color[1], [0; 3]);
    let (w, h) = (depth.width() as usize, depth.height() as usize);
    for (v, row) in out
        .data_mut()
        .chunks_exact_mut(3 * stage.color[0] as usize)
        .enumerate()
    {
        for (u, pixel) in row.chunks_exact_mut(3).enumerate() {
            let (x, y) = (
                u * w / stage.color[0] as usize,
                v * h / stage.color[1] as usize,
            );
            let mm = depth.data()[y * w + x];
            pixel.fill(if mm == 0 {
                0
            } else {
                (220 - (u32::from(mm) / 25).min(180)) as u8
            });
        }
    }
    out
}

/// Depth as the picture's camera sees it, millimetres: the sensor's own, or resampled when the colour camera
/// stands elsewhere. A reading lands on the pixels its own footprint covers; the nearest wins.
pub(crate) fn depth_from_picture<'a>(input: &Input<'a>, stage: &Stage) -> Cow<'a, [u16]> {
    let Some(color) = &input.calibration.color else {
        return Cow::Borrowed(input.frame.depth.data());
    };
    let target = stage.depth_camera(color);
    let [width, height] = stage.depth;
    let mut out = vec![0; width as usize * height as usize];
    let depth = &input.frame.depth;
    let source = input
        .calibration
        .depth
        .resized(depth.width(), depth.height());
    let iso: nalgebra::Isometry3<f32> = input.calibration.color_from_depth.iso().cast();
    let rotation = iso.rotation.to_rotation_matrix().into_inner();
    let shift: V3 = iso.translation.vector;
    // Half a footprint of a reading on the target, never less than the gap between two readings.
    let reach = (0.5 * (target.fx / source.fx).max(target.fy / source.fy)) as f32 + 0.25;
    for v in 0..depth.height() {
        for u in 0..depth.width() {
            let mm = depth.data()[(v * depth.width() + u) as usize];
            if mm == 0 {
                continue;
            }
            let p = P3::from(
                rotation
                    * source
                        .unproject(u as f32, v as f32, f32::from(mm) * 1e-3)
                        .coords
                    + shift,
            );
            if p.z <= 0.0 {
                continue;
            }
            let q = target.project(&p);
            let mm = (p.z * 1e3).clamp(1.0, f32::from(u16::MAX)) as u16;
            let range = |x: f32, side: u32| {
                let lo = (x - reach).ceil().max(0.0) as u32;
                lo..((x + reach).floor() + 1.0).clamp(0.0, side as f32) as u32
            };
            for y in range(q.y, height) {
                for x in range(q.x, width) {
                    let slot = &mut out[(y * width + x) as usize];
                    if *slot == 0 || mm < *slot {
                        *slot = mm;
                    }
                }
            }
        }
    }
    Cow::Owned(out)
}

/// A bright but not blown-out surface (skin, a light wall) in a well exposed room, linear light.
const WELL_EXPOSED: f32 = 0.26;
/// Share of the measured pixels that are darker than the one compared with [`WELL_EXPOSED`].
const BRIGHT_PERCENTILE: f32 = 0.85;
/// However dark or bright the room, garments stay within these factors: black clothes on a black ground say little
/// about the light.
const BRIGHTNESS_RANGE: [f32; 2] = [0.45, 1.25];
/// Every so many rows and columns are measured.
const MEASURE_STEP: usize = 4;

/// How bright the room is: garments are lit by this factor. From the captured pixels that have depth.
pub(crate) fn brightness(input: &Input<'_>) -> f32 {
    let Some(color) = &input.frame.color else {
        return 1.0;
    };
    let depth = &input.frame.depth;
    let mut histogram = [0u32; 256];
    let (dw, dh) = (depth.width() as usize, depth.height() as usize);
    let (w, h) = (color.width() as usize, color.height() as usize);
    for v in (0..h).step_by(MEASURE_STEP) {
        for u in (0..w).step_by(MEASURE_STEP) {
            if depth.data()[(v * dh / h) * dw + u * dw / w] != 0 {
                let c = &color.data()[3 * (v * w + u)..][..3];
                let luma =
                    (u32::from(c[0]) * 54 + u32::from(c[1]) * 183 + u32::from(c[2]) * 19) >> 8;
                histogram[luma.min(255) as usize] += 1;
            }
        }
    }
    let total: u32 = histogram.iter().sum();
    if total == 0 {
        return 1.0;
    }
    let mut below = 0;
    let level = histogram
        .iter()
        .position(|n| {
            below += n;
            below as f32 >= BRIGHT_PERCENTILE * total as f32
        })
        .unwrap_or(255);
    (linear(level as u8) / WELL_EXPOSED)
        .sqrt()
        .clamp(BRIGHTNESS_RANGE[0], BRIGHTNESS_RANGE[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Calibration, Intrinsics, RgbdFrame};
    use crate::composite::Framing;
    use crate::math::Rigid;

    #[test]
    fn upscaling_keeps_a_ramp_and_crops_about_the_centre() {
        let k = Intrinsics::KINECT_V1.resized(64, 48);
        let data = (0..48)
            .flat_map(|v| (0..64).flat_map(move |u| [2 * u as u8, 4 * v as u8, 77]))
            .collect();
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::empty(64, 48),
            color: Some(ColorImage::new(64, 48, data).expect("size")),
        };
        let calibration = Calibration::registered(k);
        for (framing, size) in [
            (Framing::Cover, [128, 72]),
            (Framing::Contain, [90, 120]),
            (Framing::Cover, [30, 60]),
        ] {
            let input = Input {
                frame: &frame,
                calibration: &calibration,
                garments: &[],
                body: None,
                output: Some(size),
            };
            let stage = Stage::new(&input, framing);
            let out = captured(Par::Seq, &input, &stage);
            let mut seen = 0;
            for v in 0..size[1] {
                for u in 0..size[0] {
                    let (x, y) = (stage.color_at(0, u), stage.color_at(1, v));
                    if x < 0.0 || y < 0.0 || x > 63.0 || y > 47.0 {
                        continue;
                    }
                    let c = out.at(u, v);
                    assert!(
                        (f64::from(c[0]) - 2.0 * x).abs() < 1.1,
                        "{u} {v}: {c:?} {x}"
                    );
                    assert!((f64::from(c[1]) - 4.0 * y).abs() < 1.1 && c[2] == 77);
                    // The camera moved along: a point seen at (x, y) is drawn at (u, v).
                    let p = k.unproject(x as f32, y as f32, 2.0);
                    let q = stage.camera.project(&p);
                    assert!((q.x - u as f32).abs() < 0.01 && (q.y - v as f32).abs() < 0.01);
                    seen += 1;
                }
            }
            assert!(seen > 1500, "{seen}");
        }
    }

    #[test]
    fn depth_moves_to_the_colour_camera() {
        let depth = Intrinsics::KINECT_V1.resized(160, 120);
        let calibration = Calibration {
            depth,
            color: Some(Intrinsics::KINECT_V1),
            color_from_depth: Rigid::new(nalgebra::Isometry3::translation(0.05, 0.0, 0.0)),
        };
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::new(160, 120, vec![2000; 160 * 120]).expect("size"),
            color: Some(ColorImage::filled(640, 480, [9; 3])),
        };
        let input = Input {
            frame: &frame,
            calibration: &calibration,
            garments: &[],
            body: None,
            output: None,
        };
        let stage = Stage::new(&input, Framing::Cover);
        assert_eq!(stage.depth, [160, 120]);
        let seen = depth_from_picture(&input, &stage);
        // 5 cm at 2 m are 3.3 of these pixels: the wall moves right, no gaps inside.
        let row = &seen[60 * 160..61 * 160];
        assert!(
            row[..2].iter().all(|d| *d == 0) && row[5..].iter().all(|d| *d == 2000),
            "{row:?}"
        );
    }
}
