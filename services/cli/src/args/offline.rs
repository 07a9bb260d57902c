//! Flags of commands that can simulate offline.

use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SolverArg {
    /// Many small explicit steps: a millisecond a frame.
    Realtime,
    /// Finite elements, implicit steps of the length that accuracy allows, on contact that never ends in an
    /// intersection, of cloth with cloth too: seconds a frame. Ctrl-C ends it after the frame in work.
    Offline,
}

#[derive(Debug, Args)]
pub(crate) struct SolverArgs {
    /// Solver.
    #[arg(long, value_enum, default_value = "realtime")]
    pub(crate) solver: SolverArg,
    /// Write the state here after every frame (offline solver).
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Continue after the frame of --checkpoint, if the file exists, with the positions in --out. The result is the same
    /// to the bit.
    #[arg(long, requires = "checkpoint")]
    pub(crate) resume: bool,
}

impl SolverArgs {
    /// True for the offline solver.
    ///
    /// # Errors
    /// Flags that only the offline solver knows.
    pub(crate) fn is_offline(&self) -> anyhow::Result<bool> {
        let is_offline = self.solver == SolverArg::Offline;
        anyhow::ensure!(
            is_offline || self.checkpoint.is_none(),
            "--checkpoint needs --solver offline"
        );
        Ok(is_offline)
    }
}

#[derive(Debug, Args)]
pub(crate) struct FineArgs {
    /// Vertices of all garments, about: their triangles are divided by four until as near as can be (offline solver).
    #[arg(long, value_name = "N", default_value_t = 30_000)]
    pub(crate) vertices: usize,
    /// Drape in the pose of this frame alone, instead of simulating all frames from the first dressed one on (offline
    /// solver).
    #[arg(long, value_name = "FRAME")]
    pub(crate) still: Option<usize>,
}
