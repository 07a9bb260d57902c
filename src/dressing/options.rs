//! Settings and report of dressing.

use super::settings::StageSettings;
use std::time::Instant;
use tryon_cloth::Config;
use tryon_garment::Triangulation;

/// Settings of dressing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DressOptions {
    /// Fineness of the garments' meshes.
    pub triangulation: Triangulation,
    /// Settings of the simulation afterwards.
    pub config: Config,
    /// Dress in sizes that do not fit too: panels are stretched or slide, which shows as crumpled cloth.
    pub any_size: bool,
    /// Settings of the stages.
    pub stages: StageSettings,
}

/// Outcome of dressing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DressReport {
    /// Steps of the simulator.
    pub steps: usize,
    /// Deepest garment vertex under the skin at the end, metres.
    pub penetration: f64,
    /// Edges that pass through triangles at the end, of the same garment or of another.
    pub crossings: usize,
    /// 99th percentile of the stretch at the end, worst garment.
    pub p99_strain: f64,
    /// Milliseconds by stage.
    pub stages_ms: DressMs,
    /// Milliseconds in all.
    pub ms: f64,
}

/// Milliseconds of each stage of dressing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DressMs {
    /// Measuring the body and cutting it into sections.
    pub place: f64,
    /// Triangulating and sewing, and wrapping the panels around the body.
    pub sew: f64,
    /// Preparing the simulator.
    pub model: f64,
    /// Draping from the canonical to the tracked pose.
    pub drape: f64,
    /// Coming to rest there.
    pub settle: f64,
}

/// Milliseconds that have passed.
pub(super) fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
