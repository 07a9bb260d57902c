//! Recordings in npz, read frame by frame with memory for one frame.

use super::array::{ArrayStream, NumberType};
use crate::FormatError;
use crate::depth_metres::metres_to_mm;
use crate::image::check_size;
use crate::rgbd_folder::read_lenses;
use crate::rgbd_source::{NOMINAL_PERIOD_NS, RgbdSource};
use crate::zip_entries::{ZipFileArchive, open_zip};
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{
    Calibration, ColorImage, DepthImage, Intrinsics, LensCalibration, RgbdFrame,
};

/// Largest depth of floating-point numbers, metres: greater ones are millimetres.
const MAX_METRES: f64 = 100.0;

/// A recording in npz. Depth is in millimetres where its type is uint16, in metres where it is a float.
#[derive(Debug)]
pub struct NpzReader {
    path: PathBuf,
    depth: ArrayStream,
    color: Option<ArrayStream>,
    calibration: Calibration,
    lenses: LensCalibration,
    untaken: Vec<String>,
    frames: u64,
    next: u64,
    /// True after a frame of which the rest is unread: the streams are of no use any more.
    is_broken: bool,
}

impl NpzReader {
    /// True for an archive with an array of `depth`: others have bodies and motions in npz.
    ///
    /// # Errors
    /// When the file cannot be read or is no zip archive.
    pub fn is_recording(path: &Path) -> Result<bool, FormatError> {
        let zip = open_zip(path)?;
        Ok(zip.file_names().any(|name| name == "depth.npy"))
    }

    /// Opens the arrays and checks the first frame. `camera` is a `camera.json` for a file without `K`.
    ///
    /// # Errors
    /// No zip archive, no `depth`, neither `K` nor `camera`, shapes that do not agree, or depth of another type or unit.
    pub fn open(path: &Path, camera: Option<&Path>) -> Result<Self, FormatError> {
        let mut zip = open_zip(path)?;
        let fault = |field: &str, why: String| FormatError::field(path, field, why);
        let mut depth = ArrayStream::open(path, &mut zip, "depth")?
            .ok_or_else(|| fault("depth", "missing: expected frames × rows × columns".into()))?;
        let (frames, width, height) = depth_shape(path, &mut depth)?;
        let mut untaken = others(&zip);
        let lenses = match (intrinsics(path, &mut zip, (width, height))?, camera) {
            (Some(k), None) => Calibration::registered(k).into(),
            (Some(k), Some(camera)) => {
                untaken.push(format!("{}: the file has its own K", camera.display()));
                Calibration::registered(k).into()
            }
            (None, Some(camera)) => read_lenses(camera, &mut untaken)?,
            (None, None) => {
                let why = "missing: expected 3 × 3 numbers, or `--camera camera.json`";
                return Err(fault("K", why.to_owned()));
            }
        };
        let calibration = lenses.pinholes();
        let k = &calibration.depth;
        if (k.width, k.height) != (width, height) {
            let why = format!(
                "{width}×{height}, but the camera says {}×{}",
                k.width, k.height
            );
            return Err(fault("depth", why));
        }
        let color = color(
            path,
            &mut zip,
            calibration.color.as_ref().unwrap_or(k),
            frames,
        )?;
        let mut reader = Self {
            path: path.to_owned(),
            depth,
            color,
            calibration,
            lenses,
            untaken,
            frames,
            next: 0,
            is_broken: false,
        };
        reader.next_frame()?;
        reader.rewind()?;
        Ok(reader)
    }

    fn read_frame(&mut self) -> Result<RgbdFrame, FormatError> {
        let sequence = self.next - 1;
        let k = self.calibration.depth;
        self.is_broken = true;
        let depth = self.depth.read(k.pixels() as u64)?;
        let color = match &mut self.color {
            None => None,
            Some(stream) => {
                let camera = self.calibration.color.unwrap_or(k);
                let bytes = stream.read(3 * camera.pixels() as u64)?;
                Some(ColorImage::new(camera.width, camera.height, bytes))
            }
        };
        self.is_broken = false;
        let fault = |field: &str, why: String| {
            FormatError::field(&self.path, field, format!("frame {sequence}: {why}"))
        };
        let depth = millimetres(self.depth.number, &depth).map_err(|why| fault("depth", why))?;
        let depth = DepthImage::new(k.width, k.height, depth);
        Ok(RgbdFrame {
            sequence,
            time_ns: sequence * NOMINAL_PERIOD_NS,
            depth: depth.map_err(|e| fault("depth", e.to_string()))?,
            color: color
                .transpose()
                .map_err(|e| fault("color", e.to_string()))?,
        })
    }
}

/// Frames, width and height of `depth`; one image counts as one frame.
fn depth_shape(path: &Path, depth: &mut ArrayStream) -> Result<(u64, u32, u32), FormatError> {
    let fault = |why: String| FormatError::field(path, "depth", why);
    use NumberType::{F32, F64, U16};
    if !matches!(depth.number, U16 | F32 | F64) {
        let why = format!(
            "type {:?}, expected uint16 millimetres or float32 metres",
            depth.number
        );
        return Err(fault(why));
    }
    if depth.is_fortran {
        return Err(fault(
            "Fortran order; save np.ascontiguousarray(depth)".to_owned(),
        ));
    }
    let (frames, rows, columns) = match depth.shape[..] {
        [frames, rows, columns] => (frames, rows, columns),
        [rows, columns] => (1, rows, columns),
        _ => {
            return Err(fault(format!(
                "shape {:?}, expected frames × rows × columns",
                depth.shape
            )));
        }
    };
    let side = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
    check_size(path, side(columns), side(rows))?;
    if frames == 0 {
        return Err(fault("no frame".to_owned()));
    }
    Ok((frames, side(columns), side(rows)))
}

/// Pinhole of `K`; `None` if there is no such array.
fn intrinsics(
    path: &Path,
    zip: &mut ZipFileArchive,
    (width, height): (u32, u32),
) -> Result<Option<Intrinsics>, FormatError> {
    let Some(mut array) = ArrayStream::open(path, zip, "K")? else {
        return Ok(None);
    };
    let fault = |why: String| FormatError::field(path, "K", why);
    if array.shape != [3, 3] {
        return Err(fault(format!("shape {:?}, expected [3, 3]", array.shape)));
    }
    let bytes = array.read(9)?;
    let k = array.number.numbers(&bytes);
    let at = |row: usize, column: usize| match array.is_fortran {
        true => k[3 * column + row],
        false => k[3 * row + column],
    };
    let zeros = [at(0, 1), at(1, 0), at(2, 0), at(2, 1), at(2, 2) - 1.0];
    if !zeros.iter().all(|x| x.abs() < 1e-6) {
        return Err(fault("expected fx, 0, cx; 0, fy, cy; 0, 0, 1".to_owned()));
    }
    let intrinsics = Intrinsics {
        width,
        height,
        fx: at(0, 0),
        fy: at(1, 1),
        cx: at(0, 2),
        cy: at(1, 2),
    };
    let why = |e: tryon_geometry::camera::IntrinsicsError| {
        fault(format!("{} is {}, expected {}", e.field, e.value, e.why))
    };
    intrinsics.validated().map(Some).map_err(why)
}

/// `color` or `rgb` at the size of its camera.
fn color(
    path: &Path,
    zip: &mut ZipFileArchive,
    camera: &Intrinsics,
    frames: u64,
) -> Result<Option<ArrayStream>, FormatError> {
    let mut found = Vec::new();
    for name in ["color", "rgb"] {
        found.extend(ArrayStream::open(path, zip, name)?.map(|a| (name, a)));
    }
    if found.len() > 1 {
        let why = "both are there: keep the colour that belongs to depth";
        return Err(FormatError::field(path, "color, rgb", why));
    }
    let Some((name, array)) = found.pop() else {
        return Ok(None);
    };
    let one = [u64::from(camera.height), u64::from(camera.width), 3];
    let all = [frames, one[0], one[1], 3];
    let is_whole = array.shape == all || (frames == 1 && array.shape == one);
    if is_whole && array.number == NumberType::U8 && !array.is_fortran {
        return Ok(Some(array));
    }
    let why = format!(
        "{:?} of shape {:?}, expected uint8 of shape {all:?} in C order",
        array.number, array.shape
    );
    Err(FormatError::field(path, name, why))
}

/// Notes on the other arrays.
fn others(zip: &ZipFileArchive) -> Vec<String> {
    let names = zip
        .file_names()
        .filter_map(npyz::npz::array_name_from_file_name);
    let others = names.filter(|n| !["depth", "K", "color", "rgb"].contains(n));
    let mut notes: Vec<String> = others.map(|n| format!("{n}: array is not used")).collect();
    notes.sort();
    notes
}

/// Depth in millimetres.
fn millimetres(number: NumberType, bytes: &[u8]) -> Result<Vec<u16>, String> {
    if number == NumberType::U16 {
        let mm = bytes.as_chunks::<2>().0.iter();
        return Ok(mm.map(|b| u16::from_le_bytes(*b)).collect());
    }
    let metres = number.numbers(bytes);
    let beyond = metres.iter().find(|m| m.is_finite() && **m > MAX_METRES);
    if let Some(value) = beyond {
        return Err(format!(
            "{value} in an array of floats, which are metres; save millimetres as uint16"
        ));
    }
    Ok(metres.into_iter().map(metres_to_mm).collect())
}

impl RgbdSource for NpzReader {
    fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    fn lenses(&self) -> LensCalibration {
        self.lenses.clone()
    }
    fn untaken(&self) -> &[String] {
        &self.untaken
    }
    fn len(&self) -> Option<usize> {
        usize::try_from(self.frames).ok()
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        if self.next >= self.frames || self.is_broken {
            return Ok(None);
        }
        self.next += 1;
        self.read_frame().map(Some)
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.depth.rewind()?;
        if let Some(color) = &mut self.color {
            color.rewind()?;
        }
        (self.next, self.is_broken) = (0, false);
        Ok(())
    }
}
