//! Correspondences between model points and depth readings: inputs, result and settings of the search.

use crate::settings::{Association, RegistrationSettings};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::{OrganisedCloud, PointTree};

/// Depth readings of the subject in one frame, camera frame.
#[derive(Clone, Copy)]
pub struct Observation<'a> {
    /// Labelled and refined readings of the whole image.
    pub grid: &'a OrganisedCloud,
    /// Cells of the subject, ascending.
    pub cells: &'a [u32],
    /// Per cell of the grid: true where the outline is an occlusion or the image rim and must not be matched.
    pub false_edges: &'a [bool],
    /// Cells on the subject's true outline.
    pub true_edges: &'a [u32],
    /// Kd-tree over the points of `cells`; required by [`Association::KdTree`] only.
    pub tree: Option<&'a PointTree>,
}

/// Points of the model in the camera frame; the first three slices have the same length.
#[derive(Clone, Copy)]
pub struct ModelPoints<'a> {
    /// Positions, metres.
    pub positions: &'a [P3],
    /// Unit outward normals.
    pub normals: &'a [V3],
    /// Bone of each point.
    pub bones: &'a [u8],
    /// Parent of each bone.
    pub parents: &'a [Option<usize>],
    /// Mean distance between points, metres.
    pub spacing: f32,
}

/// A model point and a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Model point.
    pub model: u32,
    /// Cell of the reading.
    pub cell: u32,
    /// Found from the reading's side.
    pub from_data: bool,
}

/// Bounds of Table 1 and reach of one iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairingConfig {
    /// Method of the search.
    pub association: Association,
    /// Longest pair, metres (Table 1: 0.2).
    pub distance: f32,
    /// Reach of the pull from readings without a pair to the model, metres; 0 switches it off.
    pub pull: f32,
    /// Stride over readings in the search from the data to the model.
    pub data_step: usize,
    /// Bounds that hold for every iteration.
    pub settings: RegistrationSettings,
}

/// Counts of one search.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairingStats {
    /// Model points visible to the camera.
    pub visible: usize,
    /// Model points that face away or are occluded.
    pub hidden: usize,
    /// Visible points without a pair at cells without any reading: neither right nor wrong.
    pub unknown: usize,
    /// Pairs from the model's side.
    pub from_model: usize,
    /// Readings searched from the data's side.
    pub readings: usize,
    /// Of them, those with a pair within the distance.
    pub explained: usize,
    /// Pairs dropped by relaxed bijective consistency, eq. 9.
    pub inconsistent: usize,
    /// Tree queries saved by an earlier answer.
    pub reused: usize,
}
