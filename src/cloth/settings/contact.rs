//! Settings of the body as cloth meets it.

use super::settings;
use serde::{Deserialize, Serialize};
use tryon_geometry::par::Par;

/// Resolution of the depth maps: 8 mm a pixel where fine, else 16.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapDetail {
    /// The one that looks from the real camera (the paper's view-dependent resolution).
    #[default]
    InView,
    /// All four.
    Everywhere,
    /// None.
    Nowhere,
}

settings! {
    /// Settings of a collision body.
    pub struct CollisionConfig {
        /// Displacement between steps from which on a vertex is followed fully, metres; 0 follows the posed body exactly.
        pub noise_deadband: f64 = 0.0,
        /// Clearance between parts that press on each other and in bent joints, metres: two layers of cloth.
        pub clearance: f32 = 0.013,
        /// Threads.
        #[serde(skip)]
        pub par: Par = Par::Rayon,
        /// Steps a second that `least_share` is meant for.
        pub filter_rate: f64 = 30.0,
        /// Share of the smallest displacement that is followed per step: noise of 1 mm moves cloth at 1.5 mm/s, and no offset
        /// persists for longer than a second.
        pub least_share: f32 = 0.05,
        /// Separation of parts that press on each other.
        pub parts: PartClearanceSettings = PartClearanceSettings::default(),
        /// Separation of the segments of bent joints.
        pub joints: JointClearanceSettings = JointClearanceSettings::default(),
        /// Rings by which the mask of interior skin grows into skin of unknown side: 4 cm of the embedded body. A heavy one
        /// needs three.
        pub interior_rings: usize = 8,
        /// Distance off the skin at which the winding number is taken, metres: less than a fabric's thickness, above rounding.
        pub off_skin: f32 = 1e-3,
        /// Queries of the skin.
        pub surface: SkinQuerySettings = SkinQuerySettings::default(),
    }

    /// Settings of the separation of body parts that press on each other.
    pub struct PartClearanceSettings {
        /// Largest displacement, metres: deeper, the nearest skin no longer tells inside from outside.
        pub max_displacement: f32 = 0.035,
        /// Displacement of smoothed neighbours beyond their own, metres: cloth on them lies no deeper than that.
        pub max_extra: f32 = 0.005,
        /// Smoothing iterations over neighbours, and rings of neighbours that follow; fewer leave a step in the skin.
        pub smoothing: usize = 3,
    }

    /// Settings of the separation of the segments of bent joints.
    pub struct JointClearanceSettings {
        /// Cosines of the angle between segments where separation begins, 110°, and where it is full, 80°.
        pub bent: [f32; 2] = [-0.34, 0.17],
        /// Distance in front of the joint from which on separation is full, metres.
        pub front: f32 = 0.03,
        /// Thickness of a slice, metres.
        pub slice: f32 = 0.02,
        /// Clearance of segments that just touch, metres; penetrating ones get all, as cloth there lies in the skin by half of
        /// it.
        pub touching: f32 = 0.007,
    }

    /// Settings of the queries of a surface.
    pub struct SkinQuerySettings {
        /// Longest walk, edges (30 cm on a body of 13k vertices): a longer one began at a lost start.
        pub max_walk: usize = 40,
        /// Slack between the nearest vertex and the closest point of the faces around it, metres: an edge of the body.
        pub edge: f32 = 0.03,
        /// A corner with less barycentric weight has no part in a point.
        pub min_weight: f32 = 1e-4,
        /// Distance beyond which the direction to the query replaces the interpolated normal, metres.
        pub direct_normal: f32 = 2e-3,
        /// Cosine between that direction and the interpolated normal below which the latter stays.
        pub direct_normal_cosine: f32 = 0.5,
        /// Depth beyond which a result is distrusted, metres: a point outside the skin a step ago is not deeper.
        pub distrusted_depth: f32 = 0.01,
        /// Radius of the nearest-vertex query, metres: a vertex spacing of the body. With 25 mm a hood crumples on a slim neck.
        pub nearest: f32 = 0.015,
        /// Radius for vertices that the point is below, metres: with less, cloth between passing knees got 15 mm deep in a
        /// step.
        pub below: f32 = 0.025,
    }

    /// Settings of the virtual depth maps.
    pub struct MapSettings {
        /// Scale of the side and back maps, pixels a metre: a pixel is a body edge wide.
        pub coarse: f32 = 64.0,
        /// Scale of the map that looks from the real camera; the paper asks for a higher resolution there.
        pub fine: f32 = 128.0,
        /// Empty border, metres: a garment hangs outside the silhouette.
        pub border: f32 = 0.02,
        /// Largest side of a map, pixels: a broken body must not exhaust memory.
        pub largest: f32 = 1024.0,
    }
}
