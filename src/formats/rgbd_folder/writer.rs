//! Writes an RGBD folder frame by frame.

use crate::image::{encode_png_depth, encode_png_rgb};
use crate::{CameraFile, FormatError, private_file};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, LensCalibration, RgbdFrame};

fn create(path: &Path) -> Result<File, FormatError> {
    private_file::create(path).map_err(|e| FormatError::io(path, e))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), FormatError> {
    private_file::write(path, bytes).map_err(|e| FormatError::io(path, e))
}

/// An RGBD folder being written: each frame is on disk when [`RgbdFolderWriter::write`] returns.
#[derive(Debug)]
pub struct RgbdFolderWriter {
    pub(super) folder: PathBuf,
    pub(super) depth_list: File,
    pub(super) color_list: Option<File>,
    pub(super) frames: usize,
}

impl RgbdFolderWriter {
    /// Creates the folder and its `camera.json` (depth in millimetres), for their owner to read. Colour is written as PNG.
    ///
    /// # Errors
    /// When the folder already contains a recording, or cannot be written.
    pub fn create(folder: &Path, calibration: &Calibration) -> Result<Self, FormatError> {
        let camera = folder.join("camera.json");
        if camera.exists() {
            return Err(FormatError::field(
                &camera,
                "file",
                "exists already; choose an empty folder",
            ));
        }
        let depth = folder.join("depth");
        private_file::create_folders(&depth).map_err(|e| FormatError::io(&depth, e))?;
        CameraFile::from(LensCalibration::from(calibration.clone())).write(&camera)?;
        let list = folder.join("depth.txt");
        let depth_list = create(&list)?;
        Ok(Self {
            folder: folder.to_owned(),
            depth_list,
            color_list: None,
            frames: 0,
        })
    }
    /// Frames written so far.
    pub fn frames(&self) -> usize {
        self.frames
    }
    /// Appends a frame.
    ///
    /// # Errors
    /// When a file cannot be written; names it.
    pub fn write(&mut self, frame: &RgbdFrame) -> Result<(), FormatError> {
        let name = format!("depth/{:06}.png", self.frames);
        let path = self.folder.join(&name);
        write(&path, &encode_png_depth(&frame.depth, &path)?)?;
        let time = format!(
            "{}.{:09}",
            frame.time_ns / 1_000_000_000,
            frame.time_ns % 1_000_000_000
        );
        let list = self.folder.join("depth.txt");
        writeln!(self.depth_list, "{time} {name}").map_err(|e| FormatError::io(&list, e))?;
        if let Some(color) = &frame.color {
            let dir = self.folder.join("rgb");
            let list = self.folder.join("rgb.txt");
            if self.color_list.is_none() {
                private_file::create_folders(&dir).map_err(|e| FormatError::io(&dir, e))?;
                self.color_list = Some(create(&list)?);
            }
            let name = format!("rgb/{:06}.png", self.frames);
            let path = self.folder.join(&name);
            write(&path, &encode_png_rgb(color, &path)?)?;
            if let Some(file) = &mut self.color_list {
                writeln!(file, "{time} {name}").map_err(|e| FormatError::io(&list, e))?;
            }
        }
        self.frames += 1;
        Ok(())
    }
}
