//! Folder of a capture: the outfit, and each scan once it is done. A capture that was stopped continues there.

use super::align::AlignedBody;
use super::capture::{FrameCapture, FrameReport};
pub use super::capture_header::CaptureHeader;
use super::capture_header::{check_body, check_header};
use super::texture::GarmentTexture;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon_body::Template;
use tryon_formats::FormatError;
use tryon_formats::image::{read_color, write_png_rgb};
use tryon_formats::npy::{read_npy, write_npy};
use tryon_geometry::math::V3;

/// Version of the layout. A folder of another one is refused.
const VERSION: u32 = 2;
const HEADER: &str = "capture.json";
const FRAMES: &str = "frames";
const TEXTURES: &str = "textures";

/// Result of one scan.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrameRecord {
    /// Name of the scan.
    pub scan: String,
    /// Pose and shape of the body under the cloth.
    pub body: AlignedBody,
    /// Report.
    pub report: FrameReport,
}

/// Displacements of one scan, rest pose, metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameDisplacements {
    /// Of the undressed body from the minimally clothed shape (eq. 22), shape `[vertices]`.
    pub body: Vec<V3>,
    /// Of each garment from the undressed body (eq. 23), shape `[garments][vertices]`.
    pub garments: Vec<Vec<V3>>,
}

impl FrameDisplacements {
    /// Displacements of a captured scan.
    pub fn of(template: &Template, frame: &FrameCapture) -> Self {
        let rest = frame.undressed.rest(template);
        let shape = template.personalise(&frame.undressed.body.shape).vertices;
        Self {
            body: rest.iter().zip(&shape).map(|(a, b)| a - b).collect(),
            garments: frame.displacements.clone(),
        }
    }
}

/// Folder of one capture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CaptureArchive {
    folder: PathBuf,
}

impl CaptureArchive {
    /// True for a folder that holds a capture.
    pub fn is_in(folder: &Path) -> bool {
        folder.join(HEADER).is_file()
    }

    /// Opens or creates a folder.
    ///
    /// # Errors
    /// A folder that cannot be created.
    pub fn new(folder: &Path) -> Result<Self, FormatError> {
        let frames = folder.join(FRAMES);
        std::fs::create_dir_all(&frames).map_err(|e| FormatError::io(&frames, e))?;
        Ok(Self {
            folder: folder.to_owned(),
        })
    }

    /// Opens an existing folder.
    ///
    /// # Errors
    /// A folder without a header.
    pub fn open(
        folder: &Path,
        template: &Arc<Template>,
    ) -> Result<(Self, CaptureHeader), FormatError> {
        let archive = Self {
            folder: folder.to_owned(),
        };
        let path = archive.folder.join(HEADER);
        let fault = || FormatError::field(&path, HEADER, "the folder holds no capture");
        let header = archive.header(template)?.ok_or_else(fault)?;
        Ok((archive, header))
    }

    /// Header; `None` before the first scan is done.
    ///
    /// # Errors
    /// A header of another version or body, one that cannot be read, or a field that does not fit the others.
    pub fn header(&self, template: &Arc<Template>) -> Result<Option<CaptureHeader>, FormatError> {
        let path = self.folder.join(HEADER);
        if !path.exists() {
            return Ok(None);
        }
        let header: CaptureHeader = read_json(&path)?;
        if header.version != VERSION {
            let why = format!("{}, this program reads {VERSION}", header.version);
            return Err(FormatError::field(&path, "version", why));
        }
        check_header(&header, template).map_err(|(f, why)| FormatError::field(&path, f, why))?;
        Ok(Some(header))
    }

    /// Writes the header.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_header(&self, header: &CaptureHeader) -> Result<(), FormatError> {
        let mut header = header.clone();
        header.version = VERSION;
        write_json(&self.folder.join(HEADER), &header)
    }

    /// File of a scan's result.
    fn path(&self, scan: &str, end: &str) -> PathBuf {
        self.folder.join(FRAMES).join(format!("{scan}.{end}"))
    }

    /// Result of a scan; `None` if it isn't done.
    ///
    /// # Errors
    /// A record that cannot be read, or whose body is not the template's.
    pub fn record(
        &self,
        scan: &str,
        template: &Template,
    ) -> Result<Option<FrameRecord>, FormatError> {
        let path = self.path(scan, "json");
        if !path.exists() {
            return Ok(None);
        }
        let record: FrameRecord = read_json(&path)?;
        let checked = check_body(&record.body, template, "body");
        checked.map_err(|(f, why)| FormatError::field(&path, f, why))?;
        Ok(Some(record))
    }

    /// Writes the result of a scan, the record last: a record stands for a whole result.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_frame(
        &self,
        record: &FrameRecord,
        displacements: &FrameDisplacements,
    ) -> Result<(), FormatError> {
        let scan = &record.scan;
        write_vectors(&self.path(scan, "body.npy"), &displacements.body)?;
        for (k, garment) in displacements.garments.iter().enumerate() {
            write_vectors(&self.path(scan, &format!("garment{k}.npy")), garment)?;
        }
        write_json(&self.path(scan, "json"), record)
    }

    /// Gives a scan that is unchanged the result of the one before; its record says so.
    ///
    /// # Errors
    /// A result that cannot be read or written.
    pub fn repeat(
        &self,
        before: &FrameRecord,
        scan: &str,
        header: &CaptureHeader,
        template: &Template,
    ) -> Result<FrameRecord, FormatError> {
        let displacements = self.displacements(&before.scan, header, template)?;
        let mut record = before.clone();
        scan.clone_into(&mut record.scan);
        record.report.repeated = true;
        self.write_frame(&record, &displacements)?;
        Ok(record)
    }

    /// Image of a garment's texture, and white where a scan saw it.
    fn texture_paths(&self, garment: usize) -> [PathBuf; 2] {
        let name = |end: &str| format!("garment{garment}{end}.png");
        ["", ".seen"].map(|end| self.folder.join(TEXTURES).join(name(end)))
    }

    /// Writes the garments' textures.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_textures(&self, textures: &[GarmentTexture]) -> Result<(), FormatError> {
        let folder = self.folder.join(TEXTURES);
        std::fs::create_dir_all(&folder).map_err(|e| FormatError::io(&folder, e))?;
        for (k, texture) in textures.iter().enumerate() {
            let [image, seen] = self.texture_paths(k);
            write_beside(&image, |part| write_png_rgb(part, texture.image()))?;
            write_beside(&seen, |part| write_png_rgb(part, &texture.seen_image()))?;
        }
        Ok(())
    }

    /// Textures of the garments; none for scans without colours, and for captures of programs that made none.
    ///
    /// # Errors
    /// A missing or damaged image, or one of another size than its atlas.
    pub fn textures(&self, header: &CaptureHeader) -> Result<Vec<GarmentTexture>, FormatError> {
        let atlases = header.outfit.atlases.iter().enumerate();
        let read = atlases.map(|(k, atlas)| {
            let [image, seen] = self.texture_paths(k);
            let images = (read_color(&image)?, read_color(&seen)?);
            let texture = GarmentTexture::from_images(atlas, images.0, &images.1);
            let size = [atlas.size.width, atlas.size.height];
            texture.ok_or_else(|| FormatError::field(&image, "size", format!("not {size:?}")))
        });
        read.collect()
    }

    /// Displacements of a scan of a capture on bodies of `template`.
    ///
    /// # Errors
    /// A missing or damaged array, or one with other vertices than the template or the outfit.
    pub fn displacements(
        &self,
        scan: &str,
        header: &CaptureHeader,
        template: &Template,
    ) -> Result<FrameDisplacements, FormatError> {
        let read = |name: &str, count| read_vectors(&self.path(scan, name), count);
        let parts = header.outfit.cloth.parts.iter().enumerate();
        let garments = parts.map(|(k, part)| read(&format!("garment{k}.npy"), part.nodes.len()));
        Ok(FrameDisplacements {
            // The clothed template has further vertices where a skirt joins its legs.
            body: read("body.npy", template.mesh().vertices().len())?,
            garments: garments.collect::<Result<_, _>>()?,
        })
    }
}

fn write_vectors(path: &Path, vectors: &[V3]) -> Result<(), FormatError> {
    let flat: Vec<f32> = vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
    write_npy(path, &[vectors.len() as u64, 3], flat.into_iter())
}

fn read_vectors(path: &Path, count: usize) -> Result<Vec<V3>, FormatError> {
    let (shape, flat) = read_npy(path)?;
    if shape != [count as u64, 3] {
        let why = format!("{shape:?}, expected [{count}, 3]");
        return Err(FormatError::field(path, "shape", why));
    }
    if let Some(at) = flat.iter().position(|v| !v.is_finite()) {
        let row = format!("row {}", at / 3);
        return Err(FormatError::field(path, row, "not finite"));
    }
    Ok(flat.chunks_exact(3).map(V3::from_column_slice).collect())
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, FormatError> {
    let text = std::fs::read_to_string(path).map_err(|e| FormatError::io(path, e))?;
    serde_json::from_str(&text).map_err(|e| FormatError::field(path, "json", e.to_string()))
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<(), FormatError> {
    let text = serde_json::to_string(value);
    let text = text.map_err(|e| FormatError::field(path, "json", e.to_string()))?;
    let write = |part: &Path| std::fs::write(part, text).map_err(|e| FormatError::io(part, e));
    write_beside(path, write)
}

/// Writes beside the file and renames, so that a kill leaves the old one or the new one.
fn write_beside(
    path: &Path,
    write: impl FnOnce(&Path) -> Result<(), FormatError>,
) -> Result<(), FormatError> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    let beside = PathBuf::from(beside);
    write(&beside)?;
    std::fs::rename(&beside, path).map_err(|e| FormatError::io(path, e))
}
