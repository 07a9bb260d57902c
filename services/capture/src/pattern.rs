//! A test picture: a wall three metres away and colours that move, so that a chain can be checked without anybody.

use tryon_formats::{FormatError, RgbdSource};
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};

/// Distance of the wall, millimetres.
const WALL_MM: u16 = 3000;
/// Frames a second.
const RATE: u64 = 30;

/// The source of test pictures; it never ends.
pub(crate) struct Pattern {
    calibration: Calibration,
    next: u64,
}

impl Pattern {
    pub(crate) fn new() -> Self {
        let k = Intrinsics::KINECT_V1.resized(320, 240);
        Self {
            calibration: Calibration::registered(k),
            next: 0,
        }
    }
}

impl RgbdSource for Pattern {
    fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    fn len(&self) -> Option<usize> {
        None
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let (i, k) = (self.next, &self.calibration.depth);
        self.next += 1;
        let mut color = ColorImage::filled(k.width, k.height, [0; 3]);
        for (n, p) in color.data_mut().chunks_exact_mut(3).enumerate() {
            let (u, v) = (n as u64 % u64::from(k.width), n as u64 / u64::from(k.width));
            p.copy_from_slice(&[(u + 2 * i) as u8, v as u8, (u + v) as u8]);
        }
        let mut depth = DepthImage::empty(k.width, k.height);
        depth.data_mut().fill(WALL_MM);
        Ok(Some(RgbdFrame {
            sequence: i,
            time_ns: i * 1_000_000_000 / RATE,
            depth,
            color: Some(color),
        }))
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.next = 0;
        Ok(())
    }
}
