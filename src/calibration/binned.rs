//! Colour reduced by a whole factor.

use tryon_geometry::camera::{ColorImage, Intrinsics};

/// Factor that leaves about `columns`.
pub(crate) fn factor(camera: &Intrinsics, columns: u32) -> u32 {
    ((f64::from(camera.width) / f64::from(columns.max(1))).round() as u32).max(1)
}

/// Camera of an image reduced by `factor`; columns and rows that fill no cell are cut off.
pub(crate) fn camera(k: &Intrinsics, factor: u32) -> Intrinsics {
    let (width, height) = (k.width / factor, k.height / factor);
    let whole = Intrinsics {
        width: width * factor,
        height: height * factor,
        ..*k
    };
    whole.resized(width, height)
}

/// Means of cells of `factor` × `factor` pixels.
pub(crate) fn color(image: &ColorImage, factor: u32) -> Vec<u8> {
    let (n, full) = (factor as usize, image.width() as usize);
    let (width, height) = (full / n, image.height() as usize / n);
    if n == 1 {
        return image.data().to_vec();
    }
    let mut out = Vec::with_capacity(3 * width * height);
    let mut sums = vec![0u32; 3 * width];
    let area = factor * factor;
    for rows in image.data().chunks_exact(3 * full * n) {
        sums.fill(0);
        for row in rows.chunks_exact(3 * full) {
            for (sum, cell) in sums.chunks_exact_mut(3).zip(row.chunks_exact(3 * n)) {
                for pixel in cell.chunks_exact(3) {
                    for (s, p) in sum.iter_mut().zip(pixel) {
                        *s += u32::from(*p);
                    }
                }
            }
        }
        out.extend(sums.iter().map(|s| ((s + area / 2) / area) as u8));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_means_and_rays_stay() {
        let ramp: Vec<u8> = (0..5 * 7).flat_map(|i| [i, 100, 2 * i]).collect();
        let image = ColorImage::new(7, 5, ramp).expect("7×5");
        let binned = color(&image, 2);
        assert_eq!(binned.len(), 3 * 3 * 2);
        // Pixels 2, 3, 9 and 10 of the first two rows: mean 6.
        assert_eq!(binned[3..6], [6, 100, 12]);

        let k = Intrinsics {
            width: 1281,
            ..Intrinsics::KINECT_V1
        };
        let half = camera(&k, factor(&k, 640));
        let p = k.unproject(400.0, 300.0, 2.0);
        let [full, small] = [k, half].map(|k| k.project(&p));
        assert!(((full.x + 0.5) / 2.0 - 0.5 - small.x).abs() < 1e-3);
        assert_eq!((half.width, half.height), (640, 240));
    }
}
