//! RGBD folders, read frame by frame.

use super::datasets::camera_of;
use super::index::{ColorEntry, Entry, FolderIndex};
use crate::FormatError;
use crate::camera_json::CameraFile;
use crate::image::{read_color, read_png_depth};
use crate::rgbd_source::RgbdSource;
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{
    Calibration, ColorImage, DepthImage, Intrinsics, LensCalibration, RgbdFrame,
};

/// An RGBD folder, read frame by frame.
#[derive(Debug)]
pub struct RgbdFolder {
    folder: PathBuf,
    camera: CameraFile,
    calibration: Calibration,
    entries: Vec<Entry>,
    untaken: Vec<String>,
    next: usize,
    /// Capture time of the last frame's colour.
    color_time_ns: Option<u64>,
}

/// Calibration and depth scale (units per metre) of a `camera.json` without distortion (`tryon composite --camera`).
///
/// # Errors
/// Names the file and the field at fault.
pub fn read_camera(path: &Path) -> Result<(Calibration, f64), FormatError> {
    let file = CameraFile::read(path)?;
    let color = file.lenses.color.is_none_or(|c| c.distortion.is_none());
    if !(color && file.lenses.depth.distortion.is_none()) {
        let why = "an image pair is read as a pinhole's: undistort it, and leave this out";
        return Err(FormatError::field(path, "distortion", why));
    }
    Ok((file.lenses.pinholes(), file.depth_scale))
}

/// Lenses of a `camera.json` for a recording of pairs in its own unit of depth; notes what has no effect on those.
pub(crate) fn read_lenses(
    path: &Path,
    untaken: &mut Vec<String>,
) -> Result<LensCalibration, FormatError> {
    Ok(read_of_pairs(path, untaken)?.lenses)
}

/// A `camera.json` for pairs of depth and colour; notes what has no effect on those.
pub(super) fn read_of_pairs(
    path: &Path,
    untaken: &mut Vec<String>,
) -> Result<CameraFile, FormatError> {
    let file = CameraFile::read(path)?;
    if file.color_time_offset_s != 0.0 {
        let name = path.display();
        let why = "has no effect: the recording holds pairs of depth and colour";
        untaken.push(format!("{name}: color_time_offset_s {why}"));
    }
    Ok(file)
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
    /// No or bad `camera.json`, a bad line of a time list, no depth image, or images of another size than it says.
    pub fn open(folder: &Path) -> Result<Self, FormatError> {
        Self::open_with(folder, None)
    }

    /// As [`RgbdFolder::open`], with a `camera.json` for folders that have none.
    ///
    /// # Errors
    /// As [`RgbdFolder::open`].
    pub fn open_with(folder: &Path, camera: Option<&Path>) -> Result<Self, FormatError> {
        let own = folder.join("camera.json");
        let file = match camera {
            _ if own.exists() => CameraFile::read(&own)?,
            Some(camera) => CameraFile::read(camera)?,
            None => camera_of(folder).ok_or_else(|| {
                let why = "missing: pass the camera's with `--camera camera.json`";
                FormatError::field(&own, "file", why)
            })?,
        };
        let mut index = FolderIndex::read(folder, file.color_time_offset_ns())?;
        if let Some(camera) = camera.filter(|_| own.exists()) {
            index.notes.push(format!(
                "{}: the folder has its own camera.json",
                camera.display()
            ));
        }
        Self::of_images(folder.to_owned(), file, index)
    }

    /// The images of an index, relative to a folder.
    pub(super) fn of_images(
        folder: PathBuf,
        camera: CameraFile,
        index: FolderIndex,
    ) -> Result<Self, FormatError> {
        let out = Self {
            folder,
            calibration: camera.lenses.pinholes(),
            camera,
            entries: index.entries,
            untaken: index.notes,
            next: 0,
            color_time_ns: None,
        };
        out.check_sizes()?;
        Ok(out)
    }

    /// Checks the sizes of the first and the last frame: if both are wrong, all are. Damage is left to its frame.
    fn check_sizes(&self) -> Result<(), FormatError> {
        let [Some(first), Some(last)] = [self.entries.first(), self.entries.last()] else {
            return Ok(());
        };
        let depth = |entry: &Entry| {
            let path = self.folder.join(&entry.depth);
            read_png_depth(&path).map_or(Ok(()), |image| self.check_depth(&path, &image))
        };
        depth(first).or_else(|e| depth(last).map_err(|_| e))?;
        let color = |entry: Option<&Entry>| {
            let Some(ColorEntry { file, .. }) = entry.and_then(|e| e.color.as_ref()) else {
                return Ok(());
            };
            let path = self.folder.join(file);
            read_color(&path).map_or(Ok(()), |image| self.check_color(&path, &image))
        };
        let has_color = |entry: &&Entry| entry.color.is_some();
        let last = self.entries.iter().rfind(has_color);
        color(self.entries.iter().find(has_color)).or_else(|e| color(last).map_err(|_| e))
    }

    fn check_depth(&self, path: &Path, image: &DepthImage) -> Result<(), FormatError> {
        let size = (image.width(), image.height());
        check(path, "depth size", size, &self.calibration.depth)
    }

    fn check_color(&self, path: &Path, image: &ColorImage) -> Result<(), FormatError> {
        let size = (image.width(), image.height());
        let camera = self.calibration.color.as_ref();
        check(
            path,
            "colour size",
            size,
            camera.unwrap_or(&self.calibration.depth),
        )
    }

    fn read_frame(&self, entry: &Entry, sequence: u64) -> Result<RgbdFrame, FormatError> {
        let path = self.folder.join(&entry.depth);
        let mut depth = read_png_depth(&path)?;
        self.check_depth(&path, &depth)?;
        depth_to_mm(&mut depth, self.camera.depth_scale);
        let color = match &entry.color {
            None => None,
            Some(ColorEntry { file, .. }) => {
                let path = self.folder.join(file);
                let color = read_color(&path)?;
                self.check_color(&path, &color)?;
                Some(color)
            }
        };
        Ok(RgbdFrame {
            sequence,
            time_ns: entry.time_ns,
            depth,
            color,
        })
    }
}

/// Checks the size of an image against `camera.json`.
fn check(path: &Path, field: &str, got: (u32, u32), want: &Intrinsics) -> Result<(), FormatError> {
    if got == (want.width, want.height) {
        return Ok(());
    }
    let hint = match field {
        "colour size" => " (colour of its own size needs a `color` section)",
        _ => "",
    };
    let why = format!(
        "{}×{}, but camera.json says {}×{}{hint}",
        got.0, got.1, want.width, want.height
    );
    Err(FormatError::field(path, field, why))
}

impl RgbdSource for RgbdFolder {
    fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    fn lenses(&self) -> LensCalibration {
        self.camera.lenses.clone()
    }
    fn camera_file(&self) -> CameraFile {
        self.camera.clone()
    }
    fn untaken(&self) -> &[String] {
        &self.untaken
    }
    fn color_time_ns(&self) -> Option<u64> {
        self.color_time_ns
    }
    fn len(&self) -> Option<usize> {
        Some(self.entries.len())
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let sequence = self.next;
        let Some(entry) = self.entries.get(sequence) else {
            return Ok(None);
        };
        self.next += 1;
        self.color_time_ns = entry.color.as_ref().and_then(|c| c.time_ns);
        self.read_frame(entry, sequence as u64).map(Some)
    }
    fn skip_frame(&mut self) -> Result<bool, FormatError> {
        let is_there = self.next < self.entries.len();
        self.next += usize::from(is_there);
        Ok(is_there)
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.next = 0;
        Ok(())
    }
}
