//! Pass one: the captured picture at the output's size, and the brightness of the room.

use super::input::Input;
use super::settings::ExposureSettings;
use super::srgb::linear;
use super::viewport::Viewport;
use tryon_geometry::camera::{ColorImage, DepthImage};
use tryon_geometry::par::{self, Par};

/// Rows resized by one task.
const ROWS: usize = 16;

/// The captured picture at the output's size: copied when sizes agree, else bilinear. Depth in grey where there is no
/// colour.
pub(crate) fn captured(par: Par, input: &Input<'_>, viewport: &Viewport) -> ColorImage {
    match &input.frame.color {
        Some(color) => resample(par, color, viewport),
        None => resample(par, &grey_depth(&input.frame.depth, viewport), viewport),
    }
}

fn resample(par: Par, source: &ColorImage, viewport: &Viewport) -> ColorImage {
    let (width, height) = (viewport.camera.width, viewport.camera.height);
    if [width, height] == [source.width(), source.height()] {
        return source.clone();
    }
    let mut out = ColorImage::filled(width, height, [0; 3]);
    let columns: Vec<Option<Tap>> = (0..width)
        .map(|u| Tap::new(viewport.color_at(0, u), source.width()))
        .collect();
    let stride = 3 * source.width() as usize;
    let row_bytes = 3 * width as usize;
    let last_row = source.height() as usize - 1;
    par::for_chunks(par, out.data_mut(), row_bytes * ROWS, |start, chunk| {
        let mut line = vec![0u16; stride + 3];
        for (k, row) in chunk.chunks_mut(row_bytes).enumerate() {
            let v = (start / row_bytes + k) as u32;
            let Some(tap) = Tap::new(viewport.color_at(1, v), source.height()) else {
                continue;
            };
            let source_row = |i: usize| &source.data()[i * stride..(i + 1) * stride];
            let upper = source_row(tap.first);
            let lower = source_row((tap.first + 1).min(last_row));
            for ((l, a), b) in line.iter_mut().zip(upper).zip(lower) {
                *l = u16::from(*a) * (WEIGHT_ONE - tap.weight) + u16::from(*b) * tap.weight;
            }
            line.copy_within(stride - 3..stride, stride);
            resample_row(&line, &columns, row);
        }
    });
    out
}

/// Bilinear columns of one row; `line` is the source row times [`WEIGHT_ONE`], its last pixel repeated.
fn resample_row(line: &[u16], columns: &[Option<Tap>], row: &mut [u8]) {
    for (pixel, tap) in row.chunks_exact_mut(3).zip(columns) {
        let Some(tap) = tap else { continue };
        let (first, w) = (3 * tap.first, u32::from(tap.weight));
        for (c, out) in pixel.iter_mut().enumerate() {
            let (a, b) = (u32::from(line[first + c]), u32::from(line[first + 3 + c]));
            let sum = a * (u32::from(WEIGHT_ONE) - w) + b * w;
            *out = ((sum + UNIT / 2) / UNIT) as u8;
        }
    }
}

/// Denominator of the fixed-point bilinear weights: keeps the products of a row within 16 bits.
const WEIGHT_ONE: u16 = 128;
/// Denominator of the product of two weights.
const UNIT: u32 = (WEIGHT_ONE as u32).pow(2);

/// Two neighbouring source pixels along one axis.
#[derive(Clone, Copy)]
struct Tap {
    first: usize,
    /// Weight of the second, of [`WEIGHT_ONE`].
    weight: u16,
}

impl Tap {
    /// The taps at source position `x`; `None` outside the image.
    fn new(x: f64, side: u32) -> Option<Self> {
        if x < -0.5 || x > f64::from(side) - 0.5 {
            return None;
        }
        let x = x.clamp(0.0, f64::from(side - 1));
        Some(Self {
            first: x as usize,
            weight: (x.fract() * f64::from(WEIGHT_ONE)).round() as u16,
        })
    }
}

/// Grey level of the nearest depth, levels lost over the range, and millimetres a level.
const GREY: [u32; 3] = [220, 180, 25];

/// Depth as grey levels, near is bright: the picture where there is no colour image.
fn grey_depth(depth: &DepthImage, viewport: &Viewport) -> ColorImage {
    let [width, height] = viewport.color.map(|s| s as usize);
    let mut out = ColorImage::filled(viewport.color[0], viewport.color[1], [0; 3]);
    let (w, h) = (depth.width() as usize, depth.height() as usize);
    for (i, pixel) in out.data_mut().chunks_exact_mut(3).enumerate() {
        let (u, v) = (i % width, i / width);
        let mm = u32::from(depth.data()[v * h / height * w + u * w / width]);
        if mm > 0 {
            pixel.fill((GREY[0] - (mm / GREY[2]).min(GREY[1])) as u8);
        }
    }
    out
}

/// Weights of red, green and blue in luma, of 256 (ITU-R BT.709).
const LUMA: [u32; 3] = [54, 183, 19];
/// Stride of measured rows and columns, pixels.
const MEASURE_STEP: usize = 4;

/// Brightness of the room, the factor of the light on garments, from the captured pixels that have depth.
pub(crate) fn brightness(input: &Input<'_>, settings: &ExposureSettings) -> f32 {
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
                let luma = (0..3).map(|k| u32::from(c[k]) * LUMA[k]).sum::<u32>() >> 8;
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
            below as f32 >= settings.bright_percentile * total as f32
        })
        .unwrap_or(255);
    (linear(level as u8) / settings.well_exposed)
        .sqrt()
        .clamp(settings.range[0], settings.range[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::FocusSettings;
    use crate::{Framing, OutputFrame};
    use tryon_geometry::camera::{Calibration, Intrinsics, RgbdFrame};

    #[test]
    fn bilinear_resampling_preserves_a_ramp_in_every_framing() {
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
                output: Some(OutputFrame { size, framing }),
            };
            let viewport = Viewport::new(&input, None, &FocusSettings::default());
            let out = captured(Par::Seq, &input, &viewport);
            let mut tested = 0;
            for v in 0..size[1] {
                for u in 0..size[0] {
                    let (x, y) = (viewport.color_at(0, u), viewport.color_at(1, v));
                    if x < 0.0 || y < 0.0 || x > 63.0 || y > 47.0 {
                        continue;
                    }
                    let c = out.at(u, v);
                    assert!(
                        (f64::from(c[0]) - 2.0 * x).abs() < 1.1,
                        "{u} {v}: {c:?} {x}"
                    );
                    assert!((f64::from(c[1]) - 4.0 * y).abs() < 1.1 && c[2] == 77);
                    // The output camera projects a point captured at (x, y) to (u, v).
                    let p = k.unproject(x as f32, y as f32, 2.0);
                    let q = viewport.camera.project(&p);
                    assert!((q.x - u as f32).abs() < 0.01 && (q.y - v as f32).abs() < 0.01);
                    tested += 1;
                }
            }
            assert!(tested > 1500, "{tested}");
        }
    }
}
