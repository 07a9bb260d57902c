//! Settings of the registration: correspondences and the residuals on them.

use super::settings;
use serde::{Deserialize, Serialize};

settings! {
    /// Settings of the registration.
    pub struct RegistrationSettings {
        /// Depth behind the drawn surface up to which a model point counts as visible (relaxed visibility), metres. Larger:
        /// occluded limbs pair with what covers them; smaller: noise hides points.
        pub relaxed_visibility: f32 = 0.05,
        /// Cosine between normal and view ray below which a model point is grazing and takes no pair: its reading is
        /// unreliable.
        pub least_facing: f32 = 0.1,
        /// Least depth that sizes a search window, metres; bounds the window of points at the lens.
        pub nearest_depth: f32 = 0.1,
        /// Largest half width of a window, cells, from the model and from the data: time against reach.
        pub max_window: [i32; 2] = [12, 6],
        /// Half width above which a window is sampled at every second cell: what it misses, the next iteration finds.
        pub thinned_window: [i32; 2] = [4, 3],
        /// Stride over readings without a pair that pull on the model: each scans all facing points.
        pub pull_stride: usize = 3,
        /// Edge pairs nearest in the image, of which the nearest in space wins (k_s of the paper).
        pub edge_candidates: usize = 5,
        /// Search radius of edge pairs in the image, cells.
        pub edge_reach: i32 = 7,
        /// Longest edge pair in space, metres (Table 1).
        pub longest_edge: f32 = 0.2,
        /// Depth step of an outline, metres: beside it lies a surface at least this much farther away, or nothing.
        pub outline_step: f32 = 0.06,
        /// Least width of the robust kernel on edges, metres: a point in free space may be far off its outline.
        pub edge_sigma: f64 = 0.10,
        /// Length beyond which a pair is a pull towards an unexplained reading, metres, and that pair's least kernel width,
        /// so that the pull is no outlier; at most the longest pair of a first iteration.
        pub pull_length: f64 = 0.12,
        /// Smallest cosine between normals of a pair (Table 1: 60°). Larger loses edges of limbs, smaller pairs front with
        /// back.
        pub cos_normal: f32 = 0.5,
        /// Displacement since its last query up to which a point keeps its reading, metres: a fifth of a cell. 0 queries
        /// always.
        pub reuse: f32 = 2e-3,
        /// Floor residual.
        pub floor: FloorSettings = FloorSettings::default(),
    }

    /// Settings of the floor residual; weights are per point of a frame.
    pub struct FloorSettings {
        /// Weight of the height of a standing joint. It decides against a knee without readings (2·10⁻⁵ per squared radian
        /// at a lever of 40 cm); a seen knee takes no part.
        pub height: f64 = 1e-2,
        /// The same for a planted foot: smaller, as an estimated floor is off by 1 to 2 cm, which an almost straight leg
        /// turns into a decimetre of the foot (docs/decisions).
        pub planted_height: f64 = 2e-3,
        /// Weight of the horizontal place of a planted ankle.
        pub place: f64 = 1e-3,
        /// Weight of the horizontal direction of a planted foot, at the distance of its ball from the ankle.
        pub direction: f64 = 1e-2,
        /// Width of the kernel on heights, metres: a foot on a stool is farther off and not pulled down.
        pub kernel: f64 = 0.15,
    }
}

/// Method of the correspondence search.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Association {
    /// Search windows in the images, both ways.
    #[default]
    Projective,
    /// Exact nearest neighbours in space by kd-tree, both ways (the paper's choice, from the model to the data).
    KdTree,
}
