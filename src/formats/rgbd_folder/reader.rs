//! RGBD folders, read frame by frame.

use super::camera_json::CameraFile;
use super::index::{Entry, entries};
use crate::FormatError;
use crate::image::{read_color, read_png_depth};
use crate::rgbd_source::RgbdSource;
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};

/// An RGBD folder, read frame by frame.
#[derive(Debug)]
pub struct RgbdFolder {
    folder: PathBuf,
    camera: CameraFile,
    entries: Vec<Entry>,
    next: usize,
}

/// Calibration and depth scale of a `camera.json` (`tryon composite --camera`).
///
/// # Errors
/// Names the file and the field at fault.
pub fn read_camera(path: &Path) -> Result<(Calibration, f64), FormatError> {
    CameraFile::read(path).map(|c| (c.calibration, c.depth_scale))
}

/// Converts depth in the file's unit to millimetres; values out of range become 0, "no reading".
/// `depth_scale` is the number of units in a metre.
pub fn depth_to_mm(image: &mut DepthImage, depth_scale: f64) {
    /// Millimetres in a metre: images in this unit stay unchanged.
    const MM: f64 = 1000.0;
    if (depth_scale - MM).abs() < MM * f64::EPSILON {
        return;
    }
    let factor = MM / depth_scale;
    for d in image.data_mut() {
        let mm = (f64::from(*d) * factor).round();
        *d = if mm <= f64::from(u16::MAX) {
            mm as u16
        } else {
            0
        };
    }
}

impl RgbdFolder {
    /// Reads calibration and time lists; images are read with their frame.
    ///
    /// # Errors
    /// No or bad `camera.json`, a bad line of a time list, or no depth image.
    pub fn open(folder: &Path) -> Result<Self, FormatError> {
        let camera = CameraFile::read(&folder.join("camera.json"))?;
        let entries = entries(folder)?;
        Ok(Self {
            folder: folder.to_owned(),
            camera,
            entries,
            next: 0,
        })
    }
}

/// Checks the size of an image against `camera.json`.
fn check(path: &Path, field: &str, got: (u32, u32), want: &Intrinsics) -> Result<(), FormatError> {
    if got == (want.width, want.height) {
        return Ok(());
    }
    let why = format!(
        "{}×{}, but camera.json says {}×{}",
        got.0, got.1, want.width, want.height
    );
    Err(FormatError::field(path, field, why))
}

impl RgbdSource for RgbdFolder {
    fn calibration(&self) -> &Calibration {
        &self.camera.calibration
    }
    fn len(&self) -> Option<usize> {
        Some(self.entries.len())
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let Some(entry) = self.entries.get(self.next) else {
            return Ok(None);
        };
        let sequence = self.next as u64;
        self.next += 1;
        let path = self.folder.join(&entry.depth);
        let mut depth = read_png_depth(&path)?;
        let calibration = &self.camera.calibration;
        check(
            &path,
            "depth size",
            (depth.width(), depth.height()),
            &calibration.depth,
        )?;
        depth_to_mm(&mut depth, self.camera.depth_scale);
        let color = match &entry.color {
            None => None,
            Some(file) => {
                let path = self.folder.join(file);
                let color = read_color(&path)?;
                let camera = calibration.color.as_ref().unwrap_or(&calibration.depth);
                check(
                    &path,
                    "colour size",
                    (color.width(), color.height()),
                    camera,
                )?;
                Some(color)
            }
        };
        Ok(Some(RgbdFrame {
            sequence,
            time_ns: entry.time_ns,
            depth,
            color,
        }))
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.next = 0;
        Ok(())
    }
}
