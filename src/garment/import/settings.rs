//! Settings of imports.

use tryon_geometry::settings;

settings! {
    /// Settings of the import of patterns and meshes.
    pub struct ImportSettings {
        /// Length below which an edge is removed together with its partner in a seam, metres: such edges come from seam
        /// arithmetic and give triangles a tenth as wide as the mesh.
        pub shortest_edge: f64 = 0.009,
        /// Largest distance of a waist edge from the top of its panel, metres.
        pub near_top: f64 = 0.04,
        /// Heights of the girths, metres: under the armpit (from the shoulder point), waistband and hip line (from the waist).
        pub girth_levels: [f64; 3] = [-0.26, -0.01, -0.19],
        /// Largest relative deviation of the median edge of a flat rest shape from its length in space.
        pub same_scale: f64 = 0.05,
        /// The same for the quartiles of the edges.
        pub isometric: f64 = 0.25,
    }
}
