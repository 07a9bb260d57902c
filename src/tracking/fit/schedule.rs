//! Schedules and residual weights of the pose fit.

use super::standing::FloorStance;
use crate::model::TrackerConfig;
use crate::registration::Association;
use tryon_geometry::math::P3d;

/// Iterations of one fit, and how its kernel and reach shrink.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Schedule {
    /// Most iterations.
    pub iterations: usize,
    /// Shrinking iterations to skip, because the start is good already.
    pub ahead: usize,
    /// Width of the robust kernel at the first iteration and after [`ANNEAL`], metres.
    pub sigma: [f64; 2],
    /// Longest pair at the first iteration and after [`ANNEAL`], metres.
    pub distance: [f32; 2],
    /// Reach of the pull from unexplained readings while the kernel shrinks, metres.
    pub pull: f32,
}

/// From frame to frame. The first distance is Table 1's 0.2 m less the share that prediction saves; the last is three
/// times the residual of a body of wrong size.
pub(crate) const TRACK: Schedule = Schedule {
    iterations: 8,
    ahead: 0,
    sigma: [0.08, 0.03],
    distance: [0.12, 0.06],
    pull: 0.35,
};
/// From a rough start.
pub(crate) const START: Schedule = Schedule {
    iterations: 20,
    ahead: 0,
    sigma: [0.15, 0.04],
    distance: [0.20, 0.08],
    pull: 0.5,
};
/// Iterations over which kernel and reach shrink; fewer lose fast limbs, more cost time.
pub(crate) const ANNEAL: usize = 4;

/// Residuals of a fit and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FitTerms {
    /// Method of the correspondence search.
    pub association: Association,
    /// Weight of edge-to-edge pairs.
    pub edge_weight: f64,
    /// Weight of the free-space residual.
    pub free_space: f64,
    /// Factor on the rest-pose prior.
    pub rest_weight: f64,
    /// Reduce the prior of angles in full view to [`crate::TrackerModel`]'s shares.
    pub eased: bool,
    /// Floor for feet out of view.
    pub standing: Option<FloorStance>,
    /// Hands detected beyond sleeves without return, left and right, camera frame, metres.
    pub hands: [Option<P3d>; 2],
}

/// From a rough start. Windows reject a reading of wrong normal and go on to the next, where a kd-tree rejects the pair;
/// outlines and a stronger prior hold limbs that are not near their readings yet.
pub(crate) const START_TERMS: FitTerms = FitTerms {
    association: Association::Projective,
    edge_weight: 0.3,
    free_space: 0.0,
    rest_weight: 1.0,
    eased: false,
    standing: None,
    hands: [None; 2],
};

/// For comparisons of many hypotheses: outlines tell little between them and cost the most.
pub(crate) const HYPOTHESIS_TERMS: FitTerms = FitTerms {
    edge_weight: 0.0,
    ..START_TERMS
};

impl FitTerms {
    /// From frame to frame, as configured.
    pub(crate) fn tracking(config: &TrackerConfig) -> Self {
        Self {
            association: config.association,
            edge_weight: config.edge_weight,
            free_space: config.free_space,
            rest_weight: config.rest_weight,
            eased: true,
            standing: None,
            hands: [None; 2],
        }
    }
}
