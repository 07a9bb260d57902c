//! One depth image as a recording of one frame, with its colour and its camera beside it.

use super::index::{ColorEntry, Entry, FolderIndex};
use super::reader::{RgbdFolder, read_of_pairs};
use crate::FormatError;
use std::path::{Path, PathBuf};

/// Word of a depth image's name that its colour image replaces.
const DEPTH: &str = "depth";
/// Words in its place.
const COLOR: [&str; 2] = ["color", "rgb"];
const COLOR_EXTENSIONS: [&str; 3] = ["png", "jpg", "jpeg"];

impl RgbdFolder {
    /// Opens one depth image (16-bit PNG) as a recording of one frame. Colour is the image of the same name with `color` or
    /// `rgb` in place of `depth`; the camera is the one given, else `camera.json` beside the image.
    ///
    /// # Errors
    /// No or bad camera, two images of colour, or images of another size than the camera says.
    pub fn open_pair(depth: &Path, camera: Option<&Path>) -> Result<Self, FormatError> {
        let folder = depth.with_file_name("");
        let own = folder.join("camera.json");
        let camera = camera.or_else(|| own.exists().then_some(&*own));
        let camera = camera.ok_or_else(|| {
            let why = "an image has none: pass the camera's with `--camera camera.json`";
            FormatError::field(depth, "camera", why)
        })?;
        let mut index = pair(depth)?;
        let camera = read_of_pairs(camera, &mut index.notes)?;
        Self::of_images(folder, camera, index)
    }
}

/// The one frame of a depth image.
fn pair(depth: &Path) -> Result<FolderIndex, FormatError> {
    let name = depth.file_name().and_then(|name| name.to_str());
    let name = name.ok_or_else(|| FormatError::field(depth, "name", "not UTF-8"))?;
    let names = color_names(name);
    let is_there = |name: &&String| depth.with_file_name(name).is_file();
    let mut found = names.iter().filter(is_there);
    let color = found.next();
    if let (Some(first), Some(second)) = (color, found.next()) {
        let why = format!("both {first} and {second} are there: keep the one of this depth");
        return Err(FormatError::field(depth, "color", why));
    }
    let note = color.is_none().then(|| match names.first() {
        Some(expected) => format!("{name}: no colour beside it, such as {expected}"),
        None => format!("{name}: no colour, since the name has no `{DEPTH}` to replace by `color`"),
    });
    let entry = Entry {
        time_ns: 0,
        depth: name.to_owned(),
        color: color.map(|name| ColorEntry::untimed(name)),
    };
    Ok(FolderIndex {
        entries: vec![entry],
        notes: note.into_iter().collect(),
    })
}

/// Names that the colour of a depth image can have; none if its own lacks the word.
fn color_names(depth: &str) -> Vec<String> {
    let stem = PathBuf::from(depth).with_extension("");
    let stem = stem.to_string_lossy();
    let Some(at) = stem.to_ascii_lowercase().rfind(DEPTH) else {
        return Vec::new();
    };
    let (before, behind) = (&stem[..at], &stem[at + DEPTH.len()..]);
    let named = |word| COLOR_EXTENSIONS.map(|e| format!("{before}{word}{behind}.{e}"));
    COLOR.into_iter().flat_map(named).collect()
}
