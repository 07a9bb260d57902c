//! Sleep: regions that have been still for a while are left out of frames, and looked at again a few frames later.
//!
//! A vertex sleeps once it has stayed within a distance of one place for a time. It wakes when a vertex with which it shares
//! an element, or in reach of the barrier, is awake, and at the latest after that time, in a frame in which nothing sleeps.
//! So cloth that sleeps is behind by about that distance at most, and a swing at its turning point is not taken for rest.

use tryon_geometry::math::V3d;

/// Still and sleeping vertices, those of the cloth before those of the obstacle.
#[derive(Clone, Debug, Default)]
pub(super) struct Sleep {
    /// Place at which each vertex, or the target of each vertex of the obstacle, is still (m).
    pub(super) places: Vec<V3d>,
    /// Time that it has been there (s).
    pub(super) still: Vec<f64>,
    /// Time since nothing slept (s).
    pub(super) since: f64,
    /// Vertices left out of the frame; empty for none.
    pub(super) asleep: Vec<bool>,
}
