//! Files of each frame, by time lists or by name.

use super::names::{nanoseconds, natural_order, stem};
pub(super) use super::pairing::ColorEntry;
use super::pairing::{ImageList, pair_colors};
use crate::FormatError;
use crate::image::read_limited;
use crate::rgbd_source::NOMINAL_PERIOD_NS;
use std::path::Path;

/// Largest time list, bytes; a day at 30 Hz has 180 MB.
const MAX_LIST_BYTES: u64 = 256 << 20;

/// Folders of colour.
const COLOR_FOLDERS: [&str; 2] = ["rgb", "color"];

/// The files of one frame, relative to the folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    /// Capture time of the depth image, nanoseconds.
    pub(super) time_ns: u64,
    /// Depth image.
    pub(super) depth: String,
    /// Colour image of the same exposure.
    pub(super) color: Option<ColorEntry>,
}

/// Frames of a folder.
#[derive(Clone, Debug)]
pub(super) struct FolderIndex {
    /// Frames, sorted by time.
    pub(super) entries: Vec<Entry>,
    /// Images that no frame has, and why.
    pub(super) notes: Vec<String>,
}

impl FolderIndex {
    /// Lists the images of a folder and pairs them; `color_offset_ns` is added to colour's times.
    pub(super) fn read(folder: &Path, color_offset_ns: i64) -> Result<Self, FormatError> {
        let depth = images(folder, "depth", &["png"])?;
        if depth.images.is_empty() {
            return Err(FormatError::field(
                folder,
                "depth",
                "no depth images: expected depth/*.png and perhaps depth.txt",
            ));
        }
        let (mut colors, mut notes) = (vec![None; depth.images.len()], Vec::new());
        if let Some((name, mut color)) = color_images(folder)? {
            let is_timed = depth.has_times && color.has_times;
            if is_timed {
                color.shift(color_offset_ns);
            } else if color_offset_ns != 0 {
                notes.push(format!(
                    "{name}: no times; color_time_offset_s has no effect"
                ));
            }
            let (found, note) = pair_colors(&depth, &color);
            colors = found;
            notes.extend(note.map(|why| format!("{name}: {why}")));
        }
        let images = depth.images.into_iter().zip(colors);
        let entries = images.map(|((time_ns, depth), color)| Entry {
            time_ns,
            depth,
            color,
        });
        Ok(Self {
            entries: entries.collect(),
            notes,
        })
    }
}

/// Colour images and the folder they are in; `None` if there are none.
fn color_images(folder: &Path) -> Result<Option<(&'static str, ImageList)>, FormatError> {
    let mut found = Vec::new();
    for name in COLOR_FOLDERS {
        let list = images(folder, name, &["png", "jpg", "jpeg"])?;
        if !list.images.is_empty() {
            found.push((name, list));
        }
    }
    if found.len() > 1 {
        let why = "both hold images: keep the folder of the colour that belongs to depth/";
        return Err(FormatError::field(folder, "rgb, color", why));
    }
    Ok(found.pop())
}

/// Images of `NAME.txt` if it exists, else the files of `NAME/` in the order of their numbers, at the times that are
/// their names, or at 30 Hz.
fn images(folder: &Path, name: &str, extensions: &[&str]) -> Result<ImageList, FormatError> {
    let list = folder.join(format!("{name}.txt"));
    if list.exists() {
        return Ok(ImageList {
            images: time_list(&list)?,
            has_times: true,
        });
    }
    let mut files = image_files(folder, name, extensions)?;
    files.sort_by(|a, b| natural_order(a, b));
    let seconds = |file: &String| {
        let stem = stem(file);
        stem.contains('.').then(|| nanoseconds(stem)).flatten()
    };
    let times: Option<Vec<u64>> = files.iter().map(seconds).collect();
    let has_times = times.is_some();
    let times = times.unwrap_or_else(|| {
        let made_up = (0..files.len()).map(|i| i as u64 * NOMINAL_PERIOD_NS);
        made_up.collect()
    });
    let mut images: Vec<(u64, String)> = times.into_iter().zip(files).collect();
    images.sort_by_key(|(time, _)| *time);
    Ok(ImageList { images, has_times })
}

/// Files of `NAME/` with one of the extensions; none if there is no such folder.
fn image_files(folder: &Path, name: &str, extensions: &[&str]) -> Result<Vec<String>, FormatError> {
    let dir = folder.join(name);
    let mut files = Vec::new();
    if !dir.exists() {
        return Ok(files);
    }
    for item in std::fs::read_dir(&dir).map_err(|e| FormatError::io(&dir, e))? {
        let path = item.map_err(|e| FormatError::io(&dir, e))?.path();
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default()
            .to_ascii_lowercase();
        if let Some(file) = path.file_name().and_then(|f| f.to_str())
            && extensions.contains(&extension.as_str())
        {
            files.push(format!("{name}/{file}"));
        }
    }
    Ok(files)
}

/// Lines of `timestamp path`, seconds with a fraction; `#` starts a comment.
fn time_list(path: &Path) -> Result<Vec<(u64, String)>, FormatError> {
    let bytes = read_limited(path, MAX_LIST_BYTES)?;
    let text = String::from_utf8_lossy(&bytes);
    let mut out = Vec::new();
    for (n, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fault = |why: String| FormatError::field(path, format!("line {}", n + 1), why);
        let (time, file) = line
            .split_once(char::is_whitespace)
            .ok_or_else(|| fault("expected `timestamp path`".into()))?;
        let time_ns =
            nanoseconds(time).ok_or_else(|| fault(format!("`{time}` is no time in seconds")))?;
        let file = file.trim();
        let inside =
            !Path::new(file).is_absolute() && !file.split(['/', '\\']).any(|part| part == "..");
        if !inside {
            return Err(fault(format!("`{file}` leads out of the folder")));
        }
        out.push((time_ns, file.to_owned()));
    }
    out.sort();
    Ok(out)
}
