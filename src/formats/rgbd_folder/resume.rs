//! Continues a folder whose writer was stopped.

use super::writer::RgbdFolderWriter;
use crate::{FormatError, private_file};
use std::fs::File;
use std::path::Path;

impl RgbdFolderWriter {
    /// Opens a folder after its first frames, at most `frames` of them; the lists lose those behind.
    /// [`RgbdFolderWriter::frames`] is the count of whole ones.
    ///
    /// # Errors
    /// A list that cannot be read or shortened; names it.
    pub fn resume(folder: &Path, frames: usize) -> Result<Self, FormatError> {
        let (depth_list, found) = shorten(&folder.join("depth.txt"), frames)?;
        let colors = folder.join("rgb.txt");
        let color_list = match colors.exists() {
            true => Some(shorten(&colors, found)?.0),
            false => None,
        };
        Ok(Self {
            folder: folder.to_owned(),
            depth_list,
            color_list,
            frames: found,
        })
    }
}

/// Keeps the lines of frames below `frames`; the list at its new end, and the count of its lines.
fn shorten(list: &Path, frames: usize) -> Result<(File, usize), FormatError> {
    let io = |e| FormatError::io(list, e);
    let text = std::fs::read_to_string(list).map_err(io)?;
    let whole = text.split_inclusive('\n').filter(|l| l.ends_with('\n'));
    let kept = whole.take_while(|line| frame_of(line).is_some_and(|frame| frame < frames));
    let (lines, bytes) = kept.fold((0, 0), |(n, bytes), line| (n + 1, bytes + line.len()));
    let file = private_file::append(list).map_err(io)?;
    file.set_len(bytes as u64).map_err(io)?;
    Ok((file, lines))
}

/// Number of the frame of a line, `TIME FOLDER/NUMBER.png`.
fn frame_of(line: &str) -> Option<usize> {
    let (_, name) = line.trim_end().rsplit_once('/')?;
    name.strip_suffix(".png")?.parse().ok()
}
