//! Settings of the maker of the embedded body.

use tryon_geometry::settings;

settings! {
    /// Meshing, skinning and shape space of the embedded body.
    pub struct BodySettings {
        /// Grid spacing of the polygoniser (m): three cells across a finger.
        pub cell: f64 = 0.0065,
        /// Smallest distance value kept at a grid node (m).
        pub node_gap: f64 = 1e-5,
        /// Target edge lengths (m): trunk and limbs, head, face, hand, foot. Together they give 12,000 to 14,000 vertices.
        pub edges: [f64; 5] = [0.0153, 0.0098, 0.0052, 0.0060, 0.0085],
        /// Rounds of remeshing; more change no angle by a degree.
        pub rounds: usize = 5,
        /// Rounds of flips and relaxation after them.
        pub last_rounds: usize = 2,
        /// Share of the way to the neighbours' centroid per relaxation.
        pub relaxation: f64 = 0.6,
        /// Newton steps that bring a relaxed vertex back to the surface.
        pub projection_steps: usize = 3,
        /// Projection steps onto a changed surface; from the third on, no vertex moves by 0.1 mm.
        pub shape_steps: usize = 4,
        /// Passes of smoothing of the offsets of the shape space along the surface.
        pub shape_smoothing: usize = 8,
        /// Share of the growth in length by which sections grow with stature: at the same mass-for-height, r(stature, girths)
        /// is about 0.3, and the deviation of girths is some 1.5 times that of stature, relative to the mean.
        pub section_growth: f64 = 0.45,
        /// Share by which the head grows with stature (head length has r ≈ 0.3 with stature).
        pub head_growth: f64 = 0.35,
        /// Relative growth of the limbs' bones in a direction that is then scaled to its target.
        pub limb_probe: f64 = 0.028,
        /// The same of the trunk's bones.
        pub torso_probe: f64 = 0.04,
        /// The chest under the armpits as an elliptic cylinder (m): half width, half depth and middle in z.
        pub chest: [f64; 3] = [0.165, 0.118, 0.0],
        /// Radius of the upper arm near the armpit (m).
        pub arm: f64 = 0.050,
        /// Passes of smoothing of weights: they take the kinks out of products of shares, over about 4 cm on the trunk.
        pub weight_smoothing: usize = 16,
        /// Smallest weight that is kept: four joints a vertex show no less.
        pub least_weight: f64 = 0.01,
    }
}
