//! Reorientation: frames of a turned or mirrored camera set upright.

use super::{
    Calibration, ColorImage, DepthImage, FrameSizeError, LensCalibration, Mounting, RgbdFrame,
};

/// Side of the square tiles in which a picture is turned: a tile of colours and its source stay in the first cache.
const TILE: usize = 32;

/// Sets frames upright: a frame allocates nothing; an upright camera costs nothing.
#[derive(Clone, Debug)]
pub struct Reorienter {
    mounting: Mounting,
    delivered: Calibration,
    lenses: LensCalibration,
    calibration: Calibration,
    /// Images exchanged with those of a frame.
    spare: (DepthImage, ColorImage),
}

impl Reorienter {
    /// Frames of a camera with the lenses `delivered`, mounted so.
    pub fn new(mounting: Mounting, delivered: &LensCalibration) -> Self {
        let lenses = mounting.upright(delivered);
        Self {
            mounting,
            delivered: delivered.pinholes(),
            calibration: lenses.pinholes(),
            lenses,
            spare: <_>::default(),
        }
    }

    /// Calibration of upright frames, distortion left out.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Calibration of upright frames.
    pub fn lenses(&self) -> &LensCalibration {
        &self.lenses
    }

    /// Replaces the images of a frame by upright ones.
    ///
    /// # Errors
    /// An image that has not the size of its camera; the frame is then unchanged.
    pub fn reorient(&mut self, frame: &mut RgbdFrame) -> Result<(), FrameSizeError> {
        let depth = self.delivered.depth.size();
        FrameSizeError::check("depth image", frame.depth.size(), depth)?;
        if let Some(color) = &frame.color {
            let camera = self.delivered.color.unwrap_or(self.delivered.depth);
            FrameSizeError::check("colour image", color.size(), camera.size())?;
        }
        if self.mounting.is_upright() {
            return Ok(());
        }

        let (spare_depth, spare_color) = &mut self.spare;
        upright_depth(self.mounting, &frame.depth, spare_depth);
        std::mem::swap(&mut frame.depth, spare_depth);
        if let Some(color) = &mut frame.color {
            upright_color(self.mounting, color, spare_color);
            std::mem::swap(color, spare_color);
        }
        Ok(())
    }
}

/// Sets a depth image upright; `out` takes its size.
fn upright_depth(mounting: Mounting, image: &DepthImage, out: &mut DepthImage) {
    let order = PixelOrder::new(mounting, image.size());
    out.resize(order.size.map(|side| side as u32));
    order.copy(image.data(), out.data_mut());
}

/// Sets a colour image upright; `out` takes its size.
fn upright_color(mounting: Mounting, image: &ColorImage, out: &mut ColorImage) {
    let order = PixelOrder::new(mounting, image.size());
    out.resize(order.size.map(|side| side as u32));
    let (pixels, _) = image.data().as_chunks::<3>();
    let (out, _) = out.data_mut().as_chunks_mut::<3>();
    order.copy(pixels, out);
}

/// Source of each upright pixel, an affine index: `start + u · column + v · row`.
struct PixelOrder {
    /// Columns and rows of the upright picture.
    size: [usize; 2],
    start: isize,
    column: isize,
    row: isize,
}

impl PixelOrder {
    fn new(mounting: Mounting, size: [u32; 2]) -> Self {
        let [width, height] = size.map(|side| side as isize);
        let mut order = Self {
            size: size.map(|side| side as usize),
            start: 0,
            column: 1,
            row: width,
        };
        if mounting.mirrored {
            (order.start, order.column) = ((width - 1).max(0), -1);
        }
        for _ in 0..mounting.turned.quarters() {
            // The new column runs up the old rows, the new row along the old columns.
            let last_row = order.row * (order.size[1].max(1) as isize - 1);
            (order.start, order.column, order.row) =
                (order.start + last_row, -order.row, order.column);
            order.size.swap(0, 1);
        }
        debug_assert_eq!(
            order.size.iter().product::<usize>() as isize,
            width * height
        );
        order
    }

    /// Copies pixels tile by tile.
    fn copy<T: Copy>(&self, from: &[T], to: &mut [T]) {
        let [width, height] = self.size;
        for v0 in (0..height).step_by(TILE) {
            for u0 in (0..width).step_by(TILE) {
                let end = (u0 + TILE).min(width);
                for v in v0..(v0 + TILE).min(height) {
                    let mut at = self.start + v as isize * self.row + u0 as isize * self.column;
                    for pixel in &mut to[v * width + u0..v * width + end] {
                        *pixel = from[at as usize];
                        at += self.column;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Intrinsics, PictureTurn};

    const K: Intrinsics = Intrinsics {
        width: 3,
        height: 2,
        fx: 3.0,
        fy: 3.0,
        cx: 1.0,
        cy: 0.5,
    };

    /// The numbers 1 to 6 in two rows, set upright.
    fn numbers(degrees: u16, mirrored: bool) -> (u32, Vec<u16>) {
        let turned = PictureTurn::try_from(degrees).expect("a quarter");
        let color = (1..=6u8).flat_map(|i| [i, 10 * i, 0]).collect();
        let mut frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::new(3, 2, (1..=6).collect()).expect("six"),
            color: ColorImage::new(3, 2, color).ok(),
        };
        let lenses = Calibration::registered(K).into();
        let mut reorienter = Reorienter::new(Mounting { turned, mirrored }, &lenses);
        reorienter.reorient(&mut frame).expect("its size");
        let color = frame.color.expect("colour stays");
        let same = frame
            .depth
            .data()
            .iter()
            .map(|d| *d as u8)
            .collect::<Vec<_>>();
        let (pixels, _) = color.data().as_chunks::<3>();
        assert!(pixels.iter().zip(&same).all(|(p, d)| *p == [*d, 10 * d, 0]));
        let size = reorienter.calibration().depth.size();
        assert_eq!((frame.depth.size(), color.size()), (size, size));
        (frame.depth.width(), frame.depth.data().to_vec())
    }

    #[test]
    fn pictures_turn_as_on_paper() {
        assert_eq!(numbers(0, false), (3, vec![1, 2, 3, 4, 5, 6]));
        assert_eq!(numbers(90, false), (2, vec![4, 1, 5, 2, 6, 3]));
        assert_eq!(numbers(180, false), (3, vec![6, 5, 4, 3, 2, 1]));
        assert_eq!(numbers(270, false), (2, vec![3, 6, 2, 5, 1, 4]));
        assert_eq!(numbers(0, true), (3, vec![3, 2, 1, 6, 5, 4]));
        assert_eq!(numbers(90, true), (2, vec![6, 3, 5, 2, 4, 1]));
        assert_eq!(numbers(180, true), (3, vec![4, 5, 6, 1, 2, 3]));
        assert_eq!(numbers(270, true), (2, vec![1, 4, 2, 5, 3, 6]));
    }

    /// Every pixel of pictures larger than a tile, against the pixel's own place.
    #[test]
    fn large_pictures_turn_as_small_ones() {
        let k = Intrinsics {
            width: 150,
            height: 67,
            ..K
        };
        let data: Vec<u16> = (0..k.pixels()).map(|i| i as u16).collect();
        for turned in PictureTurn::ALL {
            let mut frame = RgbdFrame {
                sequence: 0,
                time_ns: 0,
                depth: DepthImage::new(150, 67, data.clone()).expect("its size"),
                color: None,
            };
            let lenses = Calibration::registered(k).into();
            let mounting = Mounting {
                turned,
                mirrored: true,
            };
            let mut reorienter = Reorienter::new(mounting, &lenses);
            reorienter.reorient(&mut frame).expect("its size");
            for (i, d) in data.iter().enumerate() {
                let (mut u, mut v, mut h) = (149 - i as i32 % 150, i as i32 / 150, [67, 150]);
                for _ in 0..turned.quarters() {
                    (u, v) = (h[0] - 1 - v, u);
                    h.swap(0, 1);
                }
                assert_eq!(frame.depth.at(u, v), *d, "{turned:?} {i}");
            }
        }
    }

    #[test]
    fn other_sizes_are_refused_and_nothing_is_nothing() {
        let lenses = Calibration::registered(K).into();
        let mounting = Mounting {
            turned: PictureTurn::Quarter,
            mirrored: true,
        };
        let mut frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::new(2, 3, vec![7; 6]).expect("six"),
            color: None,
        };
        let e = Reorienter::new(mounting, &lenses).reorient(&mut frame);
        assert_eq!(e.map_err(|e| e.got), Err([2, 3]));
        assert_eq!((frame.depth.width(), frame.depth.data().len()), (2, 6));

        let none = Intrinsics {
            width: 0,
            height: 0,
            ..K
        };
        let lenses = Calibration::registered(none).into();
        frame.depth = DepthImage::default();
        let done = Reorienter::new(mounting, &lenses).reorient(&mut frame);
        assert!(done.is_ok() && frame.depth.data().is_empty());
    }
}
