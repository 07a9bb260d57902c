//! Copy of a recording under a name of its own until it is whole: `NAME.part.mcap`, or the folder `NAME.part`.

use super::journal::{Journal, Origin};
use crate::commands::record::Sink;
use crate::input;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use tryon::geometry::camera::{Calibration, RgbdFrame};

/// A copy being written.
pub(super) struct PartialCopy {
    out: PathBuf,
    part: PathBuf,
    sink: Sink,
    journal: Journal,
}

impl PartialCopy {
    /// Begins a copy, or continues the one of the same origin after its last whole frame.
    ///
    /// # Errors
    /// `out` exists, a partial copy of another origin or of a process that runs, or files that cannot be written.
    pub(super) fn open(out: &Path, origin: &Origin, calibration: &Calibration) -> Result<Self> {
        ensure!(is_free(out), "{} exists already", out.display());
        if let Some(parent) = out.parent().filter(|p| !p.as_os_str().is_empty()) {
            input::create_dir(parent)?;
        }
        let [part, next, journal] = ["part", "next", "journal"].map(|kind| beside(out, kind));
        let mut journal = Journal::open(&journal, &part, origin)?;
        let frames = journal.frames();
        let sink = if part.is_dir() && frames > 0 {
            Sink::resume_folder(&part, frames)?
        } else if part.is_file() && frames > 0 {
            remove(&next)?;
            let sink = Sink::resume_mcap(&next, &part, calibration, frames)?;
            rename(&next, &part)?;
            sink
        } else {
            remove(&part)?;
            Sink::create(&part, calibration)?
        };
        journal.shorten(sink.frames())?;
        Ok(Self {
            out: out.to_owned(),
            part,
            sink,
            journal,
        })
    }

    /// File or folder that is being written.
    pub(super) fn path(&self) -> &Path {
        &self.part
    }

    /// Frames in the copy.
    pub(super) fn frames(&self) -> u64 {
        self.journal.frames() as u64
    }

    /// Frames of the recording that they were made of, bad ones included.
    pub(super) fn read(&self) -> u64 {
        self.journal.read()
    }

    /// Adds a frame, the last of `read` frames of the recording.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn write(&mut self, frame: &RgbdFrame, read: u64) -> Result<()> {
        self.sink.write(frame)?;
        self.journal.push(read)
    }

    /// Ends the copy and gives it its name.
    ///
    /// # Errors
    /// When the files cannot be written or renamed.
    pub(super) fn finish(self) -> Result<()> {
        self.sink.finish()?;
        ensure!(is_free(&self.out), "{} exists now", self.out.display());
        rename(&self.part, &self.out)?;
        self.journal.remove()
    }

    /// Removes the copy.
    ///
    /// # Errors
    /// When its files cannot be removed.
    pub(super) fn abandon(self) -> Result<()> {
        remove(&self.part)?;
        self.journal.remove()
    }
}

/// True where nothing is, or an empty folder.
fn is_free(out: &Path) -> bool {
    let is_empty = std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_none());
    !out.exists() || is_empty
}

/// `NAME.KIND`, with the `.mcap` of `out` behind unless it is the journal.
fn beside(out: &Path, kind: &str) -> PathBuf {
    let is_file = out.extension().is_some_and(|e| e == "mcap") && kind != "journal";
    let stem = match out.extension() {
        Some(e) if e == "mcap" => out.file_stem(),
        _ => out.file_name(),
    };
    let name = stem.unwrap_or_default().to_string_lossy();
    let extension = if is_file { ".mcap" } else { "" };
    out.with_file_name(format!("{name}.{kind}{extension}"))
}

fn rename(from: &Path, to: &Path) -> Result<()> {
    std::fs::rename(from, to)
        .with_context(|| format!("cannot rename {} to {}", from.display(), to.display()))
}

/// Removes a file or folder, if it is there.
fn remove(path: &Path) -> Result<()> {
    let removed = match std::fs::symlink_metadata(path) {
        Err(_) => return Ok(()),
        Ok(found) if found.is_dir() => std::fs::remove_dir_all(path),
        Ok(_) => std::fs::remove_file(path),
    };
    removed.with_context(|| format!("cannot remove {}", path.display()))
}
