//! What can be chosen about a tracker.

use crate::registration::Association;
use serde::{Deserialize, Serialize};

/// Settings of a tracker. The default is what the measurements in docs/benchmarks chose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerConfig {
    /// How correspondences are found.
    pub association: Association,
    /// Points of the template that take part in pose tracking.
    pub samples: usize,
    /// Use every n-th cell in the search from the data to the model.
    pub data_step: usize,
    /// Pixels per cell side; `None` chooses by focal length.
    pub stride: Option<u32>,
    /// Most iterations of the pose per frame.
    pub iterations: usize,
    /// Weight of point-to-point beside point-to-plane (1).
    pub point_to_point: f64,
    /// Weight of point-to-plane.
    pub point_to_plane: f64,
    /// Weight of edge-to-edge pairs (λₑ of eq. 12, here on metric residuals).
    pub edge_weight: f64,
    /// Adapt the body's size and shape at the start.
    pub adapt_size: bool,
    /// Frames over which size and shape are adapted.
    pub calibration_frames: u32,
    /// Fit surface displacements (section 3.3).
    pub displacements: bool,
    /// Track the pose with the displaced surface (the paper's way) instead of the body without displacements.
    pub displaced_pose: bool,
    /// Displacements are updated at every n-th frame.
    pub displacement_interval: u32,
    /// Predict the pose from the last two frames.
    pub predict: bool,
    /// Pull the model towards readings that nothing explains.
    pub pull: bool,
    /// Prior of a shape coefficient (one standard deviation = 1), per point, m².
    pub shape_prior: f64,
    /// Standard deviation of a bone's scale, where the template has a shape space and where it has none.
    pub scale_deviation: [f64; 2],
    /// Multiplies the pull towards the rest pose.
    pub rest_weight: f64,
    /// Damping per point (λᵣ of eq. 12): metres² for the root's translation, radians² for angles.
    pub damping: f64,
    /// Readings beyond this (metres) are ignored.
    pub farthest: f32,
}

impl Default for TrackerConfig {
    fn default() -> Self {
        Self {
            association: Association::Projective,
            samples: 1600,
            data_step: 2,
            stride: None,
            iterations: 8,
            point_to_point: 0.1,
            point_to_plane: 1.0,
            edge_weight: 0.1,
            adapt_size: true,
            calibration_frames: 60,
            displacements: true,
            displaced_pose: false,
            displacement_interval: 3,
            predict: true,
            pull: true,
            shape_prior: 5e-7,
            scale_deviation: [0.05, 0.15],
            rest_weight: 0.5,
            damping: 1e-4,
            farthest: 8.0,
        }
    }
}
