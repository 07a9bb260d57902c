//! Settings of remeshing and repair.

use crate::settings;

settings! {
    /// Settings of isotropic remeshing.
    pub struct RemeshSettings {
        /// Edges longer than this times their target are split (Botsch & Kobbelt 2004).
        pub split: f64 = 4.0 / 3.0,
        /// Edges shorter than this times their target are collapsed (Botsch & Kobbelt 2004).
        pub collapse: f64 = 4.0 / 5.0,
        /// Smallest cosine between a face's normals before and after a collapse; larger keeps more folds and more short edges.
        pub collapse_turn: f64 = 0.3,
        /// A flip may not make the smallest angle worse than this share of it.
        pub flip_keeps: f64 = 0.6,
        /// Sine of a smallest angle below which a flip need not improve valences if it improves that sine by `flip_gain`.
        pub flip_poor: f64 = 0.3,
        /// Least ratio of that sine after a flip to that before.
        pub flip_gain: f64 = 1.3,
        /// Smallest cosine between the normals beside a flipped edge and after it (60°).
        pub flip_turn: f64 = 0.5,
        /// Smallest cosine between the normals beside a flipped edge where creases are kept (46°).
        pub flip_crease: f64 = 0.7,
        /// A vertex lies on a crease where its faces' normals sum to less than this share of their lengths: nothing to slide in.
        pub relax_crease: f64 = 0.8,
        /// Distance from the mirror plane that an inner vertex keeps, over its target edge length.
        pub off_plane: f64 = 0.1,
    }

    /// Settings of [`repair`](crate::mesh::repair); lengths are shares of the longest side of the bounding box.
    pub struct MeshRepairSettings {
        /// Distance up to which vertices are joined, and height up to which a face has no area: rounding of six digits.
        /// Zero joins none.
        pub weld: f32 = 1e-5,
        /// Largest thickness of a double layer, over the size of its part: 14 mm of a shirt.
        pub layer_share: f32 = 0.02,
        /// Least share of the area with a face of opposite normal behind it.
        pub layer_least: f32 = 0.7,
        /// Least ratio of the areas of the two sheets.
        pub layer_alike: f32 = 0.75,
    }
}
