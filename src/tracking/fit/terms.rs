//! Residual weights of the pose fit.

use super::standing::FloorStance;
use crate::settings::{Association, FitSettings, TrackerConfig};
use tryon_geometry::math::P3d;

/// Residuals of a fit and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FitTerms {
    /// Method of the correspondence search.
    pub association: Association,
    /// Weight of edge-to-edge pairs.
    pub edge_weight: f64,
    /// Factor on the rest-pose prior.
    pub rest_weight: f64,
    /// Reduce the prior of angles in full view to [`crate::TrackerModel`]'s shares.
    pub eased: bool,
    /// Floor for feet out of view.
    pub standing: Option<FloorStance>,
    /// Hands detected beyond sleeves without return, left and right, camera frame, metres.
    pub hands: [Option<P3d>; 2],
}

impl FitTerms {
    /// From a rough start. Windows reject a reading of wrong normal and go on to the next, where a kd-tree rejects the pair;
    /// outlines and a stronger prior hold limbs that are not near their readings yet.
    pub(crate) fn start(settings: &FitSettings) -> Self {
        Self {
            association: Association::Projective,
            edge_weight: settings.start_edges,
            rest_weight: settings.start_rest,
            eased: false,
            standing: None,
            hands: [None; 2],
        }
    }

    /// For comparisons of many hypotheses: outlines tell little between them and cost the most.
    pub(crate) fn hypothesis(settings: &FitSettings) -> Self {
        Self {
            edge_weight: 0.0,
            ..Self::start(settings)
        }
    }

    /// From frame to frame, as configured.
    pub(crate) fn tracking(config: &TrackerConfig) -> Self {
        Self {
            association: config.association,
            edge_weight: config.edge_weight,
            rest_weight: config.rest_weight,
            eased: true,
            standing: None,
            hands: [None; 2],
        }
    }
}
