//! Journal beside a partial copy: its origin, and after each frame the count of frames read for it.

use crate::recording::RecordingArgs;
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// Recording and options that a copy is made of.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Origin {
    /// Version of the program: another one may write other bytes.
    program: String,
    input: PathBuf,
    recording: FileState,
    /// Options of the recording, as their `Debug` writes them.
    options: String,
    /// Calibration that was given.
    camera: Option<FileState>,
}

/// State of a file, or of all files in a folder.
#[derive(Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileState {
    files: u64,
    bytes: u64,
    /// Time of the last change, nanoseconds since 1970.
    changed_ns: u128,
}

impl FileState {
    fn of(path: &Path) -> Result<Self> {
        let context = || format!("cannot read {}", path.display());
        let mut state = Self::default();
        let found = std::fs::metadata(path).with_context(context)?;
        if !found.is_dir() {
            state.add(&found);
            return Ok(state);
        }
        for entry in std::fs::read_dir(path).with_context(context)? {
            let inner = Self::of(&entry.with_context(context)?.path())?;
            state.files += inner.files;
            state.bytes += inner.bytes;
            state.changed_ns = state.changed_ns.max(inner.changed_ns);
        }
        Ok(state)
    }

    fn add(&mut self, file: &Metadata) {
        let changed = file.modified().ok();
        let changed = changed.and_then(|t| t.duration_since(UNIX_EPOCH).ok());
        self.files += 1;
        self.bytes += file.len();
        self.changed_ns = self.changed_ns.max(changed.map_or(0, |d| d.as_nanos()));
    }
}

impl Origin {
    /// Origin of copies of a recording as it is now.
    ///
    /// # Errors
    /// A file that cannot be read, named.
    pub(super) fn of(input: &Path, options: &RecordingArgs) -> Result<Self> {
        let context = || format!("cannot read {}", input.display());
        Ok(Self {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            input: input.canonicalize().with_context(context)?,
            recording: FileState::of(input)?,
            options: format!("{options:?}"),
            camera: options.camera.as_deref().map(FileState::of).transpose()?,
        })
    }

    /// The first difference from the origin of an earlier run, for people.
    fn difference(&self, earlier: &Self) -> Option<String> {
        if self.input != earlier.input {
            return Some(format!("from {}", earlier.input.display()));
        }
        if self.recording != earlier.recording || self.camera != earlier.camera {
            return Some("before the recording or its camera file changed".to_owned());
        }
        if self.options != earlier.options {
            return Some(format!("with other options, {}", earlier.options));
        }
        let is_same = self.program == earlier.program;
        (!is_same).then(|| format!("by version {}", earlier.program))
    }
}

/// A journal of this process: others find it locked.
#[derive(Debug)]
pub(super) struct Journal {
    path: PathBuf,
    file: File,
    /// Bytes of the origin's line.
    start: u64,
    /// Frames of the recording read when each frame of the copy was written.
    read: Vec<u64>,
}

impl Journal {
    /// Opens the journal at `path`, or begins one. Without the copy `part` there is nothing to continue.
    ///
    /// # Errors
    /// Another origin, a copy without a journal, one that another process writes, or files that cannot be read or written.
    pub(super) fn open(path: &Path, part: &Path, origin: &Origin) -> Result<Self> {
        let context = || format!("cannot write {}", path.display());
        if part.exists() && !path.exists() {
            bail!("{} is there and no copy that was stopped", part.display());
        }
        let mut options = OpenOptions::new();
        options.read(true).append(true).create(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let mut file = options.open(path).with_context(context)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                bail!("{}: another import writes this copy", part.display())
            }
            Err(TryLockError::Error(e)) => return Err(e).with_context(context),
        }
        let mut text = String::new();
        if part.exists() {
            file.read_to_string(&mut text).with_context(context)?;
        }
        let mut journal = Self {
            path: path.to_owned(),
            file,
            start: 0,
            read: Vec::new(),
        };
        match text.split_once('\n') {
            Some((first, lines)) => journal.load(first, lines, part, origin)?,
            None if part.exists() => journal.load(&text, "", part, origin)?,
            None => journal.begin(origin).with_context(context)?,
        }
        Ok(journal)
    }

    fn begin(&mut self, origin: &Origin) -> Result<()> {
        let line = format!("{}\n", serde_json::to_string(origin)?);
        self.file.set_len(0)?;
        self.file.write_all(line.as_bytes())?;
        self.start = line.len() as u64;
        Ok(())
    }

    fn load(&mut self, first: &str, lines: &str, part: &Path, origin: &Origin) -> Result<()> {
        let (path, part) = (self.path.display(), part.display());
        let way = format!("remove {part} and {path}, or choose another --out");
        let Ok(earlier) = serde_json::from_str::<Origin>(first) else {
            bail!("{path} is no journal of this version: {way}");
        };
        if let Some(difference) = origin.difference(&earlier) {
            bail!("{part} was begun {difference}: {way}");
        }
        self.start = first.len() as u64 + 1;
        // A line without its end was being written when the process stopped.
        let whole = lines.split_inclusive('\n').filter(|l| l.ends_with('\n'));
        self.read = whole.map_while(|l| l.trim_end().parse().ok()).collect();
        Ok(())
    }

    /// Frames that the copy has according to the journal.
    pub(super) fn frames(&self) -> usize {
        self.read.len()
    }

    /// Frames of the recording read for them.
    pub(super) fn read(&self) -> u64 {
        self.read.last().copied().unwrap_or(0)
    }

    /// Keeps the first `frames` lines.
    ///
    /// # Errors
    /// When the file cannot be shortened.
    pub(super) fn shorten(&mut self, frames: usize) -> Result<()> {
        self.read.truncate(frames);
        let lines: usize = self.read.iter().map(|n| n.to_string().len() + 1).sum();
        let context = || format!("cannot write {}", self.path.display());
        self.file
            .set_len(self.start + lines as u64)
            .with_context(context)
    }

    /// Adds a frame of the copy.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(super) fn push(&mut self, read: u64) -> Result<()> {
        self.read.push(read);
        let context = || format!("cannot write {}", self.path.display());
        writeln!(self.file, "{read}").with_context(context)
    }

    /// Removes the file.
    ///
    /// # Errors
    /// When it cannot be removed.
    pub(super) fn remove(self) -> Result<()> {
        std::fs::remove_file(&self.path)
            .with_context(|| format!("cannot remove {}", self.path.display()))
    }
}
