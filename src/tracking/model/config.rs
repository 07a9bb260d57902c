//! Settings of a tracker.

use crate::registration::Association;
use crate::registration::residual::SurfaceNormals;
use serde::{Deserialize, Serialize};

/// Settings of a tracker; docs/benchmarks holds the measurements behind the defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerConfig {
    /// Correspondence search from frame to frame; an initial pose always searches in the images.
    pub association: Association,
    /// Sample points of the template in the pose fit.
    pub samples: usize,
    /// Stride over cells in the search from the data to the model.
    pub data_step: usize,
    /// Pixels per cell side; `None` chooses by focal length.
    pub stride: Option<u32>,
    /// Most iterations of the pose fit per frame.
    pub iterations: usize,
    /// Weight of point-to-point beside point-to-plane (1).
    pub point_to_point: f64,
    /// Weight of point-to-plane.
    pub point_to_plane: f64,
    /// Direction of point-to-plane.
    pub normals: SurfaceNormals,
    /// Weight pairs by the Geman–McClure kernel.
    pub robust: bool,
    /// Clamp joints to the template's limits.
    pub joint_limits: bool,
    /// Use pairs found from the readings' side too.
    pub both_ways: bool,
    /// Sum the normal equations in single precision.
    pub single_precision: bool,
    /// Update below which the fit has converged, metres at a lever of 25 cm (paper: 3 mm).
    pub converged: f64,
    /// Weight of edge-to-edge pairs (λₑ of eq. 12, here on metric residuals).
    pub edge_weight: f64,
    /// Weight of the free-space residual: no surface in front of a reading.
    pub free_space: f64,
    /// Adapt the body's size and shape at the start.
    pub adapt_size: bool,
    /// Try the proposals of the part forest where body and readings disagree.
    pub rescue: bool,
    /// Take a frame for live only if body and readings agree (see [`crate::Agreement`]).
    pub judge: bool,
    /// Let feet out of view stand on the floor, or on an estimated one.
    pub standing: bool,
    /// Frames over which size and shape are adapted.
    pub calibration_frames: u32,
    /// Fit surface displacements (section 3.3).
    pub displacements: bool,
    /// Fit the pose with the displaced surface (as the paper) instead of the body without displacements.
    pub displaced_pose: bool,
    /// Frames between updates of the displacements.
    pub displacement_interval: u32,
    /// Predict the pose from the last two frames.
    pub predict: bool,
    /// Uncertainty of a fit in the pose filter, in units of its residual; 0 switches the filter off. At 0.5 / 0.75 / 1 a
    /// subject at rest moves by 0.72 / 0.59 / 0.49 mm from frame to frame, and a slow one is 3.3 / 3.5 / 3.7 mm behind.
    pub calm: f64,
    /// Skip coarse iterations where the prediction explains its frame as well as the last pose did.
    pub skip_coarse: bool,
    /// Update displacements less often once they have settled.
    pub skip_settled: bool,
    /// Keep the pairs of points that hardly moved within a frame.
    pub skip_converged: bool,
    /// Reuse the last report while the depth image changes only by noise and the subject is at rest or absent; every sixth
    /// frame is processed in any case.
    pub skip_unchanged: bool,
    /// Pull the model towards unexplained readings.
    pub pull: bool,
    /// Prior of a shape coefficient (one standard deviation = 1), per point, m².
    pub shape_prior: f64,
    /// Standard deviation of a bone's scale: with a shape space, without one.
    pub scale_deviation: [f64; 2],
    /// Factor on the rest-pose prior.
    pub rest_weight: f64,
    /// Damping per point (λᵣ of eq. 12): metres² for the root's translation, radians² for angles.
    pub damping: f64,
    /// Largest depth of a reading, metres.
    pub farthest: f32,
}

impl Default for TrackerConfig {
    fn default() -> Self {
        Self {
            association: Association::KdTree,
            samples: 1000,
            data_step: 2,
            stride: None,
            iterations: 8,
            point_to_point: 0.05,
            point_to_plane: 1.0,
            normals: SurfaceNormals::Symmetric,
            robust: true,
            joint_limits: true,
            both_ways: true,
            single_precision: false,
            converged: 3e-3,
            edge_weight: 0.0,
            free_space: 0.0,
            adapt_size: true,
            rescue: true,
            judge: true,
            standing: true,
            calibration_frames: 60,
            displacements: true,
            displaced_pose: false,
            displacement_interval: 3,
            predict: true,
            calm: 0.75,
            skip_coarse: true,
            skip_settled: true,
            skip_converged: true,
            skip_unchanged: true,
            pull: true,
            shape_prior: 5e-7,
            scale_deviation: [0.05, 0.15],
            rest_weight: 0.5,
            damping: 1e-4,
            farthest: 8.0,
        }
    }
}

impl TrackerConfig {
    /// The paper's form (sections 3.2 to 3.4) for comparison: closest points by kd-tree from the model to the data,
    /// point-to-point, every vertex, edges, the displaced surface; no prediction, pull or skipping.
    pub fn paper() -> Self {
        Self {
            association: Association::KdTree,
            samples: usize::MAX,
            stride: Some(2),
            iterations: 20,
            point_to_point: 1.0,
            point_to_plane: 0.0,
            both_ways: false,
            converged: 3e-3,
            edge_weight: 0.3,
            rescue: false,
            judge: false,
            standing: false,
            displaced_pose: true,
            predict: false,
            calm: 0.0,
            skip_coarse: false,
            skip_settled: false,
            skip_converged: false,
            skip_unchanged: false,
            pull: false,
            ..Self::default()
        }
    }
}
