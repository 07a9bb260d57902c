//! One input through one decoder: outcome, memory, time.

use crate::HEAP;
use crate::bundle::Bundle;
use crate::targets::Target;
use std::cell::RefCell;
use std::fs;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Folder for decoders that read paths, in memory where the system has one.
#[derive(Debug)]
pub struct Scratch {
    _parent: tempfile::TempDir,
    folder: PathBuf,
}

impl Scratch {
    /// Makes the folder.
    ///
    /// # Errors
    /// An error of the system.
    pub fn new() -> io::Result<Self> {
        let memory = Path::new("/dev/shm");
        let parent = match tempfile::tempdir_in(memory) {
            Ok(dir) => dir,
            Err(_) => tempfile::tempdir()?,
        };
        let folder = parent.path().join("input");
        Ok(Self {
            _parent: parent,
            folder,
        })
    }

    /// The folder with the members of `bundle` and nothing else.
    ///
    /// # Errors
    /// An error of the system, as text.
    pub fn fill(&self, bundle: &Bundle) -> Result<&Path, String> {
        if self.folder.exists() {
            fs::remove_dir_all(&self.folder).map_err(|e| e.to_string())?;
        }
        fs::create_dir(&self.folder).map_err(|e| e.to_string())?;
        bundle
            .write_into(&self.folder)
            .map_err(|e| format!("scratch: {e}"))?;
        Ok(&self.folder)
    }

    /// Path of the one file `name` with these bytes.
    ///
    /// # Errors
    /// An error of the system, as text.
    pub fn file(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, String> {
        fs::create_dir_all(&self.folder).map_err(|e| e.to_string())?;
        let path = self.folder.join(name);
        fs::write(&path, bytes).map_err(|e| e.to_string())?;
        Ok(path)
    }
}

/// Result of an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Decoded, with the size of the result, or refused with a message.
    Fine(Result<usize, String>),
    /// A panic: its message and place.
    Panicked(String),
    /// Held `bytes`, with `allowed` for this input.
    Greedy {
        /// Most bytes held at a time.
        bytes: usize,
        /// Allowance of the input.
        allowed: usize,
    },
}

impl Verdict {
    /// Name of the fault, the same for all its inputs; `None` without one.
    pub fn fault(&self) -> Option<&str> {
        match self {
            Self::Fine(_) => None,
            Self::Panicked(place) => Some(place),
            Self::Greedy { .. } => Some("greedy"),
        }
    }
}

/// Verdict with what it cost.
#[derive(Clone, Debug)]
pub struct Execution {
    /// Result.
    pub verdict: Verdict,
    /// Most bytes held at a time beyond those before.
    pub held: usize,
    /// Duration.
    pub took: Duration,
}

thread_local! {
    static PANIC: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps message and place of panics for [`execute`] instead of printing them. A worker's panic is told by its payload.
pub fn catch_panics() {
    std::panic::set_hook(Box::new(|info| {
        let place = info
            .location()
            .map(|l| format!("{}:{}", l.file(), l.line()));
        let text = format!("{} {}", place.unwrap_or_default(), message(info.payload()));
        PANIC.with(|p| *p.borrow_mut() = Some(text));
    }));
}

fn message(payload: &(dyn std::any::Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    let owned = || payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(owned).unwrap_or("a panic without text")
}

/// Runs a target on an input.
pub fn execute(target: &Target, input: &Bundle, scratch: &Scratch) -> Execution {
    let before = HEAP.current_usage();
    HEAP.reset_peak_usage();
    let start = Instant::now();
    let result = catch_unwind(AssertUnwindSafe(|| (target.run)(input, scratch)));
    let took = start.elapsed();
    let held = HEAP.peak_usage().saturating_sub(before);

    let allowed = target.allowance.base + target.allowance.per_byte * input.size();
    let verdict = match result {
        Err(payload) => {
            let kept = PANIC.with(|p| p.borrow_mut().take());
            Verdict::Panicked(kept.unwrap_or_else(|| message(&*payload).to_owned()))
        }
        Ok(_) if held > allowed => Verdict::Greedy {
            bytes: held,
            allowed,
        },
        Ok(result) => Verdict::Fine(result),
    };
    Execution {
        verdict,
        held,
        took,
    }
}
