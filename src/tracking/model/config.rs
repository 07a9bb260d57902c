//! Settings of a tracker.

use crate::registration::Association;
use crate::registration::residual::SurfaceNormals;
use serde::{Deserialize, Serialize};

/// Settings of a tracker. Gains and losses are of the mean joint error over the nine scenes of docs/benchmarks/tracking.md,
/// which is 9.1 mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerConfig {
    /// Correspondence search from frame to frame; an initial pose always searches in the images. `KdTree`: the
    /// projective search costs 0.9 mm.
    pub association: Association,
    /// Sample points of the template in the pose fit: 2,000 gain 0.4 mm at up to half as long again, 500 lose 0.9 mm.
    pub samples: usize,
    /// Stride over cells in the search from the data to the model: 1 gains nothing, 4 loses 0.1 mm.
    pub data_step: usize,
    /// Pixels per cell side; `None` chooses by focal length.
    pub stride: Option<u32>,
    /// Most iterations of the pose fit per frame: 4 lose 0.1 mm, 16 gain nothing.
    pub iterations: usize,
    /// Weight of point-to-point beside point-to-plane: without it limbs along the view creep, more slows them.
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
    /// Update below which the fit has converged, metres at a lever of 25 cm (paper: 3 mm).
    pub converged: f64,
    /// Weight of edge-to-edge pairs from frame to frame (λₑ of eq. 12, here on metric residuals); 0 switches them off.
    pub edge_weight: f64,
    /// Weight of the free-space residual from frame to frame: no surface in front of a reading; 0 switches it off.
    pub free_space: f64,
    /// Adapt the body's size and shape at the start.
    pub adapt_size: bool,
    /// Try the proposals of the part forest where body and readings disagree.
    pub rescue: bool,
    /// Take a frame for live only if body and readings agree (see [`crate::Agreement`]).
    pub judge: bool,
    /// Let feet out of view stand on the floor, or on an estimated one.
    pub standing: bool,
    /// Frames over which size and shape are adapted, two seconds at 30 Hz; fewer fix the size on fewer poses.
    pub calibration_frames: u32,
    /// Fit surface displacements (section 3.3).
    pub displacements: bool,
    /// Fit the pose with the displaced surface (as the paper) instead of the body without displacements.
    pub displaced_pose: bool,
    /// Frames between updates of the displacements; settled ones wait longer. Smaller costs time.
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
    /// Factor on the rest-pose prior: 0 loses 0.3 mm.
    pub rest_weight: f64,
    /// Damping per point (λᵣ of eq. 12): metres² for the root's translation, radians² for angles. Flat from 10⁻⁵ to 10⁻⁴,
    /// 10⁻³ loses 2 mm.
    pub damping: f64,
    /// Largest depth of a reading, metres: the range of the sensors.
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
