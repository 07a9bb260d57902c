//! What can be chosen about a tracker.

use crate::registration::Association;
use serde::{Deserialize, Serialize};

/// What distance between surfaces means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Normals {
    /// Along the model's normal (point-to-plane).
    Model,
    /// Along the mean of the model's and the reading's normal (the symmetric metric of Rusinkiewicz 2019).
    #[default]
    Symmetric,
}

/// Settings of a tracker. The default is what the measurements in docs/benchmarks chose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerConfig {
    /// How correspondences are found from frame to frame; a first placement always searches in the images.
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
    /// Direction of point-to-plane.
    pub normals: Normals,
    /// Far pairs count less (Geman–McClure) instead of as much as near ones.
    pub robust: bool,
    /// Joints stay within the template's limits.
    pub joint_limits: bool,
    /// Readings look for the model too, not only the model for readings.
    pub both_ways: bool,
    /// Sum the normal equations in single precision.
    pub single_precision: bool,
    /// An update below this ends the iteration, metres at a lever of 25 cm; the paper stops at 3 mm.
    pub converged: f64,
    /// Weight of edge-to-edge pairs (λₑ of eq. 12, here on metric residuals).
    pub edge_weight: f64,
    /// Weight of the free-space constraint: no surface in front of what was measured.
    pub free_space: f64,
    /// Adapt the body's size and shape at the start.
    pub adapt_size: bool,
    /// Look for an arm again when too little of the person is explained.
    pub rescue: bool,
    /// Feet out of view stand on the floor, on an estimated one where none is seen.
    pub standing: bool,
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
    /// The last pose counts as much as a frame that differs from it by so many times the frame's residual; 0 takes every
    /// frame as it is. 0.5 / 0.75 / 1: a still person moves by 0.72 / 0.59 / 0.49 mm from picture to picture, a slowly
    /// moving one is 3.3 / 3.5 / 3.7 mm off.
    pub calm: f64,
    /// Leave out coarse iterations where the prediction explains the frame as well as the last pose did its own.
    pub skip_coarse: bool,
    /// Fit displacements less often once they have settled.
    pub skip_settled: bool,
    /// Points that have hardly moved since they were paired in the same frame keep their pairs.
    pub skip_converged: bool,
    /// Keep the last pose while a person stands still, and the last answer while nobody is there, where the picture shows the
    /// same but for noise; every sixth frame is gone through whatever it shows.
    pub skip_unchanged: bool,
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
            association: Association::KdTree,
            samples: 1000,
            data_step: 2,
            stride: None,
            iterations: 8,
            point_to_point: 0.05,
            point_to_plane: 1.0,
            normals: Normals::Symmetric,
            robust: true,
            joint_limits: true,
            both_ways: true,
            single_precision: false,
            converged: 3e-3,
            edge_weight: 0.0,
            free_space: 0.0,
            adapt_size: true,
            rescue: true,
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
    /// The paper's own form (sections 3.2 to 3.4), for comparison: closest points by kd-tree from the model to the data,
    /// point-to-point, every vertex, edges, no prediction, pull or skipping, and the displaced surface in the pose.
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
