//! Depth as colours, and pictures side by side.

use tryon::geometry::camera::{ColorImage, DepthImage};
use tryon::geometry::settings;

settings! {
    /// Settings of depth in colours.
    pub struct DepthColorSettings {
        /// Depths of red and of blue (m); nearer and farther ones have the same colours.
        pub range: [f32; 2] = [0.5, 4.5],
        /// Width of the black line between two pictures, pixels.
        pub line: u32 = 4,
    }
}

/// Colours at even steps from near to far: red, yellow, green, cyan, blue.
const RAMP: [[f32; 3]; 5] = [
    [230.0, 50.0, 30.0],
    [240.0, 200.0, 40.0],
    [60.0, 190.0, 70.0],
    [40.0, 190.0, 220.0],
    [50.0, 60.0, 200.0],
];

/// Colour of a reading (mm); black without one.
pub(crate) fn depth_color(reading: u16, [near, far]: [f32; 2]) -> [u8; 3] {
    if reading == 0 {
        return [0; 3];
    }
    let share = (f32::from(reading) * 1e-3 - near) / (far - near);
    let at = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f32;
    let below = (at as usize).min(RAMP.len() - 2);
    let t = at - below as f32;
    std::array::from_fn(|c| (RAMP[below][c] * (1.0 - t) + RAMP[below + 1][c] * t).round() as u8)
}

/// A depth image in colours.
pub(crate) fn depth_colors(depth: &DepthImage, settings: &DepthColorSettings) -> ColorImage {
    let mut out = ColorImage::filled(depth.width(), depth.height(), [0; 3]);
    let (pixels, _) = out.data_mut().as_chunks_mut::<3>();
    for (pixel, reading) in pixels.iter_mut().zip(depth.data()) {
        *pixel = depth_color(*reading, settings.range);
    }
    out
}

/// Two pictures side by side with a line between; the right one takes the left one's height, nearest pixels.
pub(crate) fn beside(left: &ColorImage, right: &ColorImage, line: u32) -> ColorImage {
    let height = left.height();
    let scale = f64::from(right.height()) / f64::from(height.max(1));
    let width = (f64::from(right.width()) / scale.max(f64::MIN_POSITIVE)).round() as u32;
    let total = left.width() + line + width;
    let mut out = ColorImage::filled(total, height, [0; 3]);
    let (pixels, _) = out.data_mut().as_chunks_mut::<3>();
    for (v, row) in pixels.chunks_exact_mut((total as usize).max(1)).enumerate() {
        for (u, pixel) in row.iter_mut().enumerate() {
            let (u, v) = (u as u32, v as u32);
            if u < left.width() {
                *pixel = left.at(u, v);
            } else if u >= left.width() + line {
                let at = |i: u32, most: u32| ((f64::from(i) * scale) as u32).min(most - 1);
                let x = at(u - left.width() - line, right.width());
                *pixel = right.at(x, at(v, right.height()));
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_red_far_is_blue_and_nothing_is_black() {
        let range = DepthColorSettings::default().range;
        assert_eq!(depth_color(0, range), [0; 3]);
        assert_eq!(depth_color(500, range), [230, 50, 30]);
        assert_eq!(depth_color(300, range), depth_color(500, range));
        assert_eq!(depth_color(2500, range), [60, 190, 70]);
        assert_eq!(depth_color(4500, range), [50, 60, 200]);
        assert_eq!(depth_color(60_000, range), depth_color(4500, range));
    }

    #[test]
    fn pictures_stand_side_by_side_at_one_height() {
        let left = ColorImage::filled(4, 3, [1; 3]);
        let mut right = ColorImage::filled(12, 6, [2; 3]);
        right.data_mut()[..3].fill(9);
        let both = beside(&left, &right, 2);
        assert_eq!((both.width(), both.height()), (4 + 2 + 6, 3));
        let row: Vec<u8> = (0..12).map(|u| both.at(u, 0)[0]).collect();
        assert_eq!(row, [1, 1, 1, 1, 0, 0, 9, 2, 2, 2, 2, 2]);
    }
}
