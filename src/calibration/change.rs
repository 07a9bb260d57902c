//! Difference of a picture from the empty scene, at three sizes.

use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::order_statistics::median;

/// Sizes: whole, halves, quarters.
pub(crate) const LEVELS: usize = 3;
/// Every how many bytes the gain is measured at.
const GAIN_STRIDE: usize = 291;

/// Grey image, row-major.
#[derive(Clone, Debug)]
pub(crate) struct GreyImage {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<u8>,
}

impl GreyImage {
    /// Bilinear sample; the border repeats.
    pub(crate) fn sample(&self, u: f32, v: f32) -> f32 {
        let u = u.clamp(0.0, (self.width - 1) as f32);
        let v = v.clamp(0.0, (self.height - 1) as f32);
        let (x, y) = (
            (u as usize).min(self.width.saturating_sub(2)),
            (v as usize).min(self.height.saturating_sub(2)),
        );
        let (s, t) = (u - x as f32, v - y as f32);
        let at = |i: usize| f32::from(self.data[i.min(self.data.len() - 1)]);
        let i = y * self.width + x;
        let upper = at(i) + (at(i + 1) - at(i)) * s;
        let lower = at(i + self.width) + (at(i + self.width + 1) - at(i + self.width)) * s;
        upper + (lower - upper) * t
    }

    /// Means of cells of 2 × 2 pixels.
    fn half(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let rows = self.data.chunks_exact((2 * self.width).max(1)).take(height);
        let data = rows.flat_map(|rows| {
            let (upper, lower) = rows.split_at(self.width);
            upper
                .chunks_exact(2)
                .zip(lower.chunks_exact(2))
                .map(|(a, b)| {
                    let sum: u16 = a.iter().chain(b).map(|p| u16::from(*p)).sum();
                    ((sum + 2) / 4) as u8
                })
        });
        Self {
            width,
            height,
            data: data.collect(),
        }
    }
}

/// Largest difference of a channel from the empty scene.
#[derive(Clone, Debug)]
pub(crate) struct ChangeImage {
    pub(crate) levels: [GreyImage; LEVELS],
}

impl ChangeImage {
    /// Compares a picture with the empty scene, whose brightness follows the picture's exposure.
    pub(crate) fn new(camera: &Intrinsics, color: &[u8], empty: &[u8]) -> Self {
        let gains = gains(color, empty);
        let pixels = color.chunks_exact(3).zip(empty.chunks_exact(3));
        let data = pixels.map(|(now, empty)| {
            let channels = now.iter().zip(empty).zip(gains);
            let differences = channels
                .map(|((now, empty), gain)| (f32::from(*now) - gain * f32::from(*empty)).abs());
            differences.fold(0.0, f32::max).min(255.0) as u8
        });
        let whole = GreyImage {
            width: camera.width as usize,
            height: camera.height as usize,
            data: data.collect(),
        };
        let half = whole.half();
        let quarter = half.half();
        Self {
            levels: [whole, half, quarter],
        }
    }
}

/// Median ratio of a picture to the empty scene, of each channel.
fn gains(color: &[u8], empty: &[u8]) -> [f32; 3] {
    std::array::from_fn(|channel| {
        let at = (channel..color.len().min(empty.len())).step_by(GAIN_STRIDE);
        let mut ratios: Vec<f32> = at
            .filter(|i| empty[*i] > 0)
            .map(|i| f32::from(color[i]) / f32::from(empty[i]))
            .collect();
        median(&mut ratios).unwrap_or(1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn change_is_the_difference_whatever_the_exposure() {
        let camera = Intrinsics::KINECT_V1.resized(40, 30);
        let empty: Vec<u8> = (0..3 * 40 * 30).map(|i| 80 + (i % 40) as u8).collect();
        // A quarter brighter, and a square that is not the scene.
        let mut now: Vec<u8> = empty
            .iter()
            .map(|c| (u16::from(*c) * 5 / 4) as u8)
            .collect();
        for v in 10..20 {
            now[3 * (v * 40 + 10)..3 * (v * 40 + 20)].fill(10);
        }
        let change = ChangeImage::new(&camera, &now, &empty);
        let [whole, half, quarter] = &change.levels;
        assert!(whole.data[..10 * 40].iter().all(|c| *c < 3));
        assert!(whole.sample(14.5, 14.5) > 80.0);
        assert_eq!((half.width, half.height, quarter.width), (20, 15, 10));
        assert!(half.sample(7.0, 7.0) > 80.0 && quarter.sample(0.0, 0.0) < 3.0);
        // Between the last column of the scene and the first of the square.
        let edge = whole.sample(9.5, 15.0);
        let mean = 0.5 * (whole.sample(9.0, 15.0) + whole.sample(10.0, 15.0));
        assert!((edge - mean).abs() < 1e-4);
    }
}
