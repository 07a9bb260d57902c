//! Bilinear samples of a texture.

use tryon_geometry::camera::ColorImage;

/// Colour at texture coordinates with v down, 0 to 255; `None` for coordinates that are not finite.
///
/// The image repeats outside \[0, 1\]. Within half a texel of a border the border texel alone counts.
pub fn sample_texture(image: &ColorImage, uv: [f32; 2]) -> Option<[f32; 3]> {
    let [width, height] = [image.width(), image.height()];
    if width == 0 || height == 0 || !uv.iter().all(|t| t.is_finite()) {
        return None;
    }
    let (left, right, x) = texels(uv[0], width);
    let (top, bottom, y) = texels(uv[1], height);
    let mix = |a: [f32; 3], b: [f32; 3], t: f32| {
        std::array::from_fn::<f32, 3, _>(|k| a[k] + t * (b[k] - a[k]))
    };
    let row = |v: u32| mix(color(image, left, v), color(image, right, v), x);
    Some(mix(row(top), row(bottom), y))
}

fn color(image: &ColorImage, u: u32, v: u32) -> [f32; 3] {
    image.at(u, v).map(f32::from)
}

/// Neighbouring texels of a coordinate along an axis of `n` texels, and the weight of the second.
fn texels(t: f32, n: u32) -> (u32, u32, f32) {
    let t = if (0.0..=1.0).contains(&t) {
        t
    } else {
        t - t.floor()
    };
    let x = (t * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
    let first = (x as u32).min(n - 1);
    (first, (first + 1).min(n - 1), x - first as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_bilinear_repeat_outside_and_keep_the_border() {
        let image = ColorImage::new(2, 1, vec![0, 0, 0, 100, 200, 40]).expect("sizes");
        let at = |u: f32| sample_texture(&image, [u, 0.3]);
        assert_eq!(at(0.5), Some([50.0, 100.0, 20.0]));
        assert_eq!((at(0.0), at(0.25)), (Some([0.0; 3]), Some([0.0; 3])));
        assert_eq!((at(1.0), at(-0.25)), (at(0.75), at(0.75)));
        assert_eq!(at(2.5), at(0.5));
        assert_eq!(at(f32::NAN), None);
    }
}
