//! Report of one step.

use serde::{Deserialize, Serialize};

/// Work and quality of a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Substeps of the garment that needed the most.
    pub steps: usize,
    /// Least share of its membrane stiffness that a garment keeps at its substep.
    pub softened: f64,
    /// Largest stretch of an edge (length over rest length, minus one).
    pub max_strain: f64,
    /// 99th percentile of the stretch.
    pub p99_strain: f64,
    /// Deepest vertex below the skin before penetrations were resolved, metres.
    pub penetration: f64,
    /// Deepest vertex below the skin in the result, metres.
    pub penetration_left: f64,
    /// Vertices in contact with the body.
    pub contacts: usize,
    /// Mean speed over the step that 95 % of the fastest garment do not exceed, m/s.
    pub speed: f64,
    /// Sleeping vertices, which were not simulated.
    pub sleeping: usize,
    /// Skin queries skipped because the vertex was too far away to reach it.
    pub searches_skipped: usize,
    /// Near pairs of vertices and faces, or edges, of cloth and cloth.
    pub cloth_contacts: usize,
    /// Vertices between two body parts with less clearance than two layers need.
    pub pinched: usize,
    /// Body vertices inside another part, which support no cloth.
    pub buried: usize,
    /// Intersections (edge, triangle) of the garments queried in this step.
    #[serde(default)]
    pub crossings: usize,
    /// The body teleported and the cloth was reskinned.
    pub teleported: bool,
    /// Fault that made a garment keep its last good state.
    pub kept_last_good: Option<String>,
    /// Milliseconds by stage.
    pub stages_ms: StagesMs,
}

/// Time of a step by stage, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StagesMs {
    /// Depth maps of the body.
    pub maps: f64,
    /// Collision body and contact generation.
    pub contact: f64,
    /// Substeps, commit and sleep.
    pub solve: f64,
    /// The whole step.
    pub total: f64,
}
