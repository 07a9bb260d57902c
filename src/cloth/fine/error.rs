//! Faults of the offline solver.

use crate::contact::ContactMeshError;
use crate::contact::broad_phase::EdgeFace;
use crate::elastic::ElasticError;
use tryon_geometry::linear::LinearError;

/// Fault of an offline simulation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OfflineError {
    /// Two arrays or a setting that do not fit.
    #[error("{field}: {why}")]
    Input {
        /// The field at fault.
        field: &'static str,
        /// Its fault.
        why: String,
    },
    /// A start whose cloth passes through itself or the obstacle.
    #[error("{} edges pass through faces at the start, the first {place}: draw the surfaces apart", .crossings.len())]
    IntersectingStart {
        /// Edges and the faces that they pass through, by their numbers in the contact mesh.
        crossings: Vec<EdgeFace>,
        /// Vertices and place of the first, in words.
        place: String,
    },
    /// A step that was not solved at the smallest length.
    #[error("no solution at {time:.6} s with the smallest step of {step:.3e} s: {why}")]
    Unsolved {
        /// Time before the step (s).
        time: f64,
        /// Length of the step (s).
        step: f64,
        /// Reason, naming the vertex.
        why: NewtonFault,
    },
    /// The surfaces.
    #[error(transparent)]
    Mesh(#[from] ContactMeshError),
    /// The rest shape or the fabric.
    #[error(transparent)]
    Elastic(#[from] ElasticError),
    /// The linear system.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// A checkpoint that does not belong to this simulation.
    #[error("checkpoint: {0}")]
    Checkpoint(String),
}

/// Reason of a Newton iteration that did not end.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NewtonFault {
    /// The iterations ran out.
    #[error("vertex {vertex} still moves by {motion:.3e} m after {iterations} iterations")]
    Iterations {
        /// Vertex with the largest motion.
        vertex: usize,
        /// Its motion in the last iteration (m).
        motion: f64,
        /// Iterations made.
        iterations: usize,
    },
    /// The line search found no lower energy.
    #[error(
        "no descent: vertex {vertex} wants to move by {motion:.3e} m, of which {share:.3e} is free"
    )]
    Stuck {
        /// Vertex with the largest motion.
        vertex: usize,
        /// Motion of the search direction (m).
        motion: f64,
        /// Share of it that contact leaves free.
        share: f64,
    },
    /// A number that is not finite.
    #[error("vertex {vertex}: a derivative is not finite")]
    NotFinite {
        /// The vertex.
        vertex: usize,
    },
}
