//! Pixels of a region as the input of a network: bilinear, channels first.

use crate::PersonRegion;
use tryon_geometry::camera::ColorImage;

/// Colours beyond the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum CropBorder {
    /// Black.
    Black,
    /// The nearest pixel of the picture.
    Nearest,
}

/// Form of a network's input.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CropForm {
    /// Rows and columns.
    pub(crate) pixels: usize,
    /// Numbers of black and of white.
    pub(crate) range: [f32; 2],
    /// Colours beyond the picture.
    pub(crate) border: CropBorder,
}

/// Fills `out` with the region's pixels, three planes of `form.pixels`² numbers; 1 ms. The image must not be empty.
pub(crate) fn crop(image: &ColorImage, region: &PersonRegion, form: &CropForm, out: &mut Vec<f32>) {
    let n = form.pixels;
    out.clear();
    out.resize(3 * n * n, 0.0);
    let scale = (form.range[1] - form.range[0]) / 255.0;
    let corner = region.pixel([0.5 / n as f32 - 0.5; 2]);
    let [across, down] = [[1.0, 0.0], [0.0, 1.0]]
        .map(|axis| region.direction(axis).map(|c| c * region.side / n as f32));
    let (red, others) = out.split_at_mut(n * n);
    let (green, blue) = others.split_at_mut(n * n);
    for (row, ((red, green), blue)) in (red.chunks_mut(n))
        .zip(green.chunks_mut(n))
        .zip(blue.chunks_mut(n))
        .enumerate()
    {
        for (column, ((red, green), blue)) in red.iter_mut().zip(green).zip(blue).enumerate() {
            let at = [0, 1].map(|c| corner[c] + across[c] * column as f32 + down[c] * row as f32);
            let color = sample(image, at, form.border).map(|c| form.range[0] + scale * c);
            [*red, *green, *blue] = color;
        }
    }
}

/// Colour between the four pixels around a place, 0 to 255.
fn sample(image: &ColorImage, at: [f32; 2], border: CropBorder) -> [f32; 3] {
    let floor = at.map(f32::floor);
    let [u, v] = [at[0] - floor[0], at[1] - floor[1]];
    // Saturates far beyond the picture, where all colours are the border's.
    let [x, y] = floor.map(|c| (c as i32).min(i32::MAX - 1));
    let mut color = [0.0; 3];
    for (x, y, weight) in [
        (x, y, (1.0 - u) * (1.0 - v)),
        (x + 1, y, u * (1.0 - v)),
        (x, y + 1, (1.0 - u) * v),
        (x + 1, y + 1, u * v),
    ] {
        let [inside_x, inside_y] = [
            x.clamp(0, image.width() as i32 - 1),
            y.clamp(0, image.height() as i32 - 1),
        ];
        let is_beyond = (inside_x, inside_y) != (x, y);
        if is_beyond && border == CropBorder::Black {
            continue;
        }
        let pixel = image.at(inside_x as u32, inside_y as u32);
        for (color, channel) in color.iter_mut().zip(pixel) {
            *color += weight * f32::from(channel);
        }
    }
    color
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Red is the column, green the row, blue constant.
    fn ramp(columns: u32, rows: u32) -> ColorImage {
        let pixels =
            (0..rows).flat_map(|v| (0..columns).flat_map(move |u| [u as u8, v as u8, 200]));
        ColorImage::new(columns, rows, pixels.collect()).expect("its size")
    }
    fn cropped(image: &ColorImage, region: PersonRegion, border: CropBorder) -> Vec<f32> {
        let mut out = Vec::new();
        let form = CropForm {
            pixels: 8,
            range: [0.0, 255.0],
            border,
        };
        crop(image, &region, &form, &mut out);
        out
    }

    #[test]
    fn pixels_are_those_of_the_turned_region() {
        let image = ramp(200, 100);
        for quarters in 0..4 {
            let region = PersonRegion {
                centre: [90.0, 50.0],
                side: 40.0,
                roll: quarters as f32 * std::f32::consts::FRAC_PI_2,
            };
            let out = cropped(&image, region, CropBorder::Nearest);
            for (row, column) in [(0, 0), (3, 6), (7, 2)] {
                let [x, y] = [column, row].map(|k| (k as f32 + 0.5) / 8.0 - 0.5);
                let want = match quarters {
                    0 => [90.0 + 40.0 * x, 50.0 + 40.0 * y],
                    1 => [90.0 - 40.0 * y, 50.0 + 40.0 * x],
                    2 => [90.0 - 40.0 * x, 50.0 - 40.0 * y],
                    _ => [90.0 + 40.0 * y, 50.0 - 40.0 * x],
                };
                let k = row * 8 + column;
                let far = (out[k] - want[0]).hypot(out[64 + k] - want[1]);
                assert!(
                    far < 1e-3 && (out[128 + k] - 200.0).abs() < 1e-3,
                    "{quarters}"
                );
            }
        }
    }

    #[test]
    fn beyond_the_picture_lies_its_border() {
        let image = ColorImage::filled(1, 1, [80, 90, 100]);
        let region = PersonRegion {
            centre: [1e9, -3.0],
            side: 7.0,
            roll: 0.3,
        };
        let black = cropped(&image, region, CropBorder::Black);
        assert!(black.iter().all(|c| *c == 0.0));
        let nearest = cropped(&image, region, CropBorder::Nearest);
        assert!(nearest[..64].iter().all(|c| (c - 80.0).abs() < 1e-3));
        // The letterbox of a picture twice as wide as high: a quarter above, a quarter below.
        let wide = ColorImage::filled(32, 16, [255; 3]);
        let out = cropped(&wide, PersonRegion::whole([32, 16], 0), CropBorder::Black);
        let rows: Vec<f32> = (0..8).map(|row| out[8 * row + 4]).collect();
        assert_eq!(rows, [0.0, 0.0, 255.0, 255.0, 255.0, 255.0, 0.0, 0.0]);
    }
}
