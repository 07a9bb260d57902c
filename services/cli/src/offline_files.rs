//! Files of an offline simulation, valid after every frame: positions of cloth and body, checkpoint.

use crate::args::SolverArgs;
use crate::interrupt::Interrupt;
use anyhow::{Context, Result};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use tryon::cloth::fine::OfflineSolver;
use tryon::formats::NpyFrames;
use tryon::geometry::math::P3;

/// Vertices of the files; no body.npy for `None`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VertexCounts {
    pub(crate) cloth: usize,
    pub(crate) body: Option<usize>,
}

/// Positions of the frames so far, the checkpoint after the last, and the request to end.
#[derive(Debug)]
pub(crate) struct OfflineFiles {
    positions: NpyFrames,
    /// Obstacle, where a file is kept of it.
    body: Option<NpyFrames>,
    checkpoint: Option<PathBuf>,
    interrupt: Interrupt,
}

/// State to continue from; `None` without `--resume` or before its first frame.
///
/// # Errors
/// A file that cannot be read.
pub(crate) fn saved_state(args: &SolverArgs) -> Result<Option<Vec<u8>>> {
    let file = args.checkpoint.as_ref();
    match file.filter(|f| args.resume && f.exists()) {
        Some(file) => {
            let bytes = std::fs::read(file);
            bytes.with_context(|| file.display().to_string()).map(Some)
        }
        None => Ok(None),
    }
}

impl OfflineFiles {
    /// positions.npy and body.npy in `out`, and the checkpoint of `args`, after `frames` frames of an earlier run.
    ///
    /// # Errors
    /// Files that cannot be written, or positions that do not belong to the checkpoint.
    pub(crate) fn open(
        args: &SolverArgs,
        out: &Path,
        vertices: VertexCounts,
        frames: usize,
    ) -> Result<Self> {
        let open = |name: &str, vertices| match frames {
            0 => NpyFrames::create(&out.join(name), vertices),
            n => NpyFrames::resume(&out.join(name), vertices, n),
        };
        Ok(Self {
            positions: open("positions.npy", vertices.cloth)?,
            body: (vertices.body).map(|n| open("body.npy", n)).transpose()?,
            checkpoint: args.checkpoint.clone(),
            interrupt: Interrupt::watch()?,
        })
    }

    /// Adds a frame: cloth, and the body where a file is kept of it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn push(&mut self, cloth: &[P3], body: &[P3]) -> Result<()> {
        self.positions.push(cloth)?;
        if let Some(file) = &mut self.body {
            file.push(body)?;
        }
        Ok(())
    }

    /// Adds a frame and writes the checkpoint after it; breaks after Ctrl-C.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn frame(&mut self, solver: &OfflineSolver<'_>) -> Result<ControlFlow<()>> {
        let number = self.positions.len() as u64;
        let state = solver.state();
        self.push(&state.positions(), &state.obstacle_positions())?;
        if let Some(file) = &self.checkpoint {
            replace(file, &solver.checkpoint(number))
                .with_context(|| format!("cannot write {}", file.display()))?;
        }
        Ok(self.flow())
    }

    /// Breaks after Ctrl-C.
    pub(crate) fn flow(&self) -> ControlFlow<()> {
        if self.interrupt.is_asked() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Positions of all frames of the cloth (m), shape `[frames][vertices]`.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(crate) fn read(&mut self) -> Result<Vec<Vec<P3>>> {
        Ok(self.positions.read()?)
    }

    /// Positions of all frames of the body (m), shape `[frames][vertices]`; none where no file is kept of it.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(crate) fn read_body(&mut self) -> Result<Vec<Vec<P3>>> {
        let file = self.body.as_mut();
        Ok(file.map(NpyFrames::read).transpose()?.unwrap_or_default())
    }
}

/// Writes a file beside `path` and renames it, so that there is a whole one at any time.
///
/// # Errors
/// When the system refuses.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    std::fs::write(&beside, bytes)?;
    std::fs::rename(&beside, path)
}
