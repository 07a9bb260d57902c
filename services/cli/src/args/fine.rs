//! Arguments of `tryon fine`.

use clap::{ArgGroup, Args};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(group(ArgGroup::new("start").required(true).args(["session", "simulation"])))]
pub(crate) struct FineSessionArgs {
    /// Session whose garments are simulated, while they are worn: the id of its try-on. Ctrl-C cancels the simulation after
    /// the frame in work.
    #[arg(long, value_name = "ID")]
    pub(crate) session: Option<String>,
    /// Simulation that Ctrl-C cancelled, to continue with the positions and the report in --out: within ten minutes, and
    /// while the session knows the body.
    #[arg(long, value_name = "ID", conflicts_with_all = ["vertices", "seconds"])]
    pub(crate) simulation: Option<String>,
    /// Folder for positions.npy (frames × vertices × 3, f32, metres in the world frame), outfit.glb (animated for more than
    /// one frame) and report.json.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Vertices of all garments, about: their triangles are divided by four until as near as can be.
    #[arg(long, value_name = "N", default_value_t = 30_000)]
    pub(crate) vertices: u32,
    /// Seconds of the body's motion that are recorded from now on and simulated, at most 10; 0 for the drape in the present
    /// pose alone.
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub(crate) seconds: f32,
    /// Configuration file with the address of the cloth service (`compositor.cloth`) and the token for it (see `up`).
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
}
