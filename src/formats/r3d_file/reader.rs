//! Record3D recordings, read frame by frame with memory for one frame.

use super::metadata::R3dMetadata;
use crate::FormatError;
use crate::depth_metres::metres_to_mm;
use crate::image::{MAX_PIXELS, check_size, decode_jpeg};
use crate::rgbd_source::RgbdSource;
use crate::zip_entries::{ZipFileArchive, open_zip, read_entry};
use lzfse_rust::LzfseRingDecoder;
use std::collections::HashSet;
use std::io::Read;
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, RgbdFrame};

/// Largest `metadata`, bytes; an hour of poses has 20 MB.
const MAX_METADATA: u64 = 64 << 20;

/// A Record3D recording.
pub struct R3dReader {
    path: PathBuf,
    zip: ZipFileArchive,
    metadata: R3dMetadata,
    /// Numbers of the frames, ascending.
    frames: Vec<u64>,
    has_color: Vec<bool>,
    decoder: LzfseRingDecoder,
    next: usize,
}

impl std::fmt::Debug for R3dReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("R3dReader")
            .field("path", &self.path)
            .field("frames", &self.frames.len())
            .finish_non_exhaustive()
    }
}

fn depth_name(frame: u64) -> String {
    format!("rgbd/{frame}.depth")
}

fn color_name(frame: u64) -> String {
    format!("rgbd/{frame}.jpg")
}

impl R3dReader {
    /// Reads the archive's directory and `metadata`.
    ///
    /// # Errors
    /// No zip archive, no `metadata` or an unusable field of it, or no depth.
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        Self::open_with(path, None)
    }

    /// As [`R3dReader::open`]; a `camera.json` is noted as unused, since every recording has its `K`.
    ///
    /// # Errors
    /// As [`R3dReader::open`].
    pub fn open_with(path: &Path, camera: Option<&Path>) -> Result<Self, FormatError> {
        let mut zip = open_zip(path)?;
        let bytes = read_entry(path, &mut zip, "metadata", MAX_METADATA)?;
        let mut metadata = R3dMetadata::parse(path, &bytes)?;
        let depth = metadata.calibration.depth;
        check_size(path, depth.width, depth.height)?;
        let number = |name: &str| {
            name.strip_prefix("rgbd/")?
                .strip_suffix(".depth")?
                .parse()
                .ok()
        };
        let mut frames: Vec<u64> = zip.file_names().filter_map(number).collect();
        frames.sort_unstable();
        frames.dedup();
        if frames.is_empty() {
            return Err(FormatError::field(path, "rgbd", "no rgbd/N.depth"));
        }
        let names: HashSet<&str> = zip.file_names().collect();
        let has_color = frames
            .iter()
            .map(|f| names.contains(color_name(*f).as_str()));
        let has_color = has_color.collect();
        if zip.file_names().any(|n| n.ends_with(".conf")) {
            metadata
                .notes
                .push("rgbd/N.conf: confidence is not used".to_owned());
        }
        if let Some(camera) = camera {
            let name = camera.display();
            metadata
                .notes
                .push(format!("{name}: the recording has its own K"));
        }
        Ok(Self {
            path: path.to_owned(),
            zip,
            metadata,
            frames,
            has_color,
            decoder: LzfseRingDecoder::default(),
            next: 0,
        })
    }

    fn read_depth(&mut self, frame: u64) -> Result<DepthImage, FormatError> {
        let name = depth_name(frame);
        let (width, height) = self.depth_size();
        let pixels = width as usize * height as usize;
        let limit = 8 * pixels as u64 + 4096;
        let coded = read_entry(&self.path, &mut self.zip, &name, limit)?;
        let fault = |why: String| FormatError::field(&self.path, &name, why);
        let mut bytes = Vec::new();
        self.decoder
            .reader(&coded[..])
            .take(4 * pixels as u64 + 1)
            .read_to_end(&mut bytes)
            .map_err(|e| fault(format!("LZFSE: {e}")))?;
        let data: Vec<u16> = match bytes.len() {
            n if n == 4 * pixels => {
                let metres = bytes
                    .as_chunks::<4>()
                    .0
                    .iter()
                    .map(|b| f32::from_le_bytes(*b));
                metres.map(|m| metres_to_mm(f64::from(m))).collect()
            }
            n if n == 2 * pixels => {
                let mm = bytes.as_chunks::<2>().0.iter();
                mm.map(|b| u16::from_le_bytes(*b)).collect()
            }
            n => {
                let why =
                    format!("{n} bytes for {width}×{height} pixels, expected 2 or 4 for each");
                return Err(fault(why));
            }
        };
        DepthImage::new(width, height, data).map_err(|e| fault(e.to_string()))
    }

    fn depth_size(&self) -> (u32, u32) {
        let depth = &self.metadata.calibration.depth;
        (depth.width, depth.height)
    }

    fn read_color(&mut self, frame: u64) -> Result<ColorImage, FormatError> {
        let name = color_name(frame);
        let coded = read_entry(&self.path, &mut self.zip, &name, MAX_PIXELS)?;
        let fault = |why: String| FormatError::field(&self.path, &name, why);
        let image = decode_jpeg(&coded).map_err(|e| fault(e.to_string()))?;
        let calibration = &self.metadata.calibration;
        let camera = calibration.color.as_ref().unwrap_or(&calibration.depth);
        if (image.width(), image.height()) == (camera.width, camera.height) {
            return Ok(image);
        }
        let (w, h) = (image.width(), image.height());
        let why = format!(
            "{w}×{h}, but metadata says {}×{}",
            camera.width, camera.height
        );
        Err(fault(why))
    }
}

impl RgbdSource for R3dReader {
    fn calibration(&self) -> &Calibration {
        &self.metadata.calibration
    }
    fn untaken(&self) -> &[String] {
        &self.metadata.notes
    }
    fn len(&self) -> Option<usize> {
        Some(self.frames.len())
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let index = self.next;
        let Some(frame) = self.frames.get(index).copied() else {
            return Ok(None);
        };
        self.next += 1;
        let depth = self.read_depth(frame)?;
        let color = match self.has_color.get(index) {
            Some(true) => Some(self.read_color(frame)?),
            _ => None,
        };
        Ok(Some(RgbdFrame {
            sequence: index as u64,
            time_ns: self.metadata.time_ns(frame),
            depth,
            color,
        }))
    }
    fn skip_frame(&mut self) -> Result<bool, FormatError> {
        let is_there = self.next < self.frames.len();
        self.next += usize::from(is_there);
        Ok(is_there)
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.next = 0;
        Ok(())
    }
}
