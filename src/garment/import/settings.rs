//! Settings of imports.

use tryon_geometry::settings;

settings! {
    /// Settings of the import of patterns and meshes.
    pub struct ImportSettings {
        /// Length below which an edge is removed together with its partner in a seam, metres: such edges come from seam
        /// arithmetic and give triangles a tenth as wide as the mesh.
        pub shortest_edge: f64 = 0.009,
        /// Height of the waist of the figure that patterns are drawn around, metres (GarmentCode's mean body, 1.72 m).
        pub figure_waist: f64 = 1.09,
        /// Height of the high point of its shoulder, metres.
        pub figure_shoulder: f64 = 1.457,
        /// Height of a garment's middle below which the figure's waist, not its floor, is y = 0, metres: trousers to the floor
        /// have 0.45, a hooded top around the waist 0.2.
        pub figure_middle: f64 = 0.32,
        /// Height of a panel's top above the waist from which it covers more than waist and hips, metres: waistbands end at it.
        pub above_waist: f64 = 0.06,
        /// Height of the chest of a figure of 1.5 m, metres: between it and `highest_waist` a panel's top may be either.
        pub lowest_chest: f64 = 1.1,
        /// Height of the waist of a figure of 2 m, metres.
        pub highest_waist: f64 = 1.28,
        /// Least width of a panel whose top is the shoulder, metres: lapels are narrower.
        pub trunk_width: f64 = 0.12,
        /// Height of a panel's top above the shoulder, or of its foot below, from which it stands on the neckline, metres.
        pub above_shoulder: f64 = 0.018,
        /// Least distance of a sleeve from the sagittal plane, metres.
        pub arm_gap: f64 = 0.08,
        /// Least distance of the middle of a sleeve from the sagittal plane, metres.
        pub arm_middle: f64 = 0.16,
        /// Largest overlap of a trouser leg with the other side, metres.
        pub leg_over_middle: f64 = 0.06,
        /// Least share of a hood's normal that points to the side.
        pub sideways: f64 = 0.8,
        /// Least height of a hood and of a trunk, metres: less is a collar.
        pub hood_height: f64 = 0.2,
        /// Least distance of a panel from the body's plane that tells front and back, metres.
        pub least_depth: f64 = 0.02,
        /// Largest difference in height of the tops of panels side by side in a ring, metres: levels are drawn 5 cm apart.
        pub ring_level: f64 = 0.045,
        /// Least angle around the body between panels side by side, radians.
        pub ring_turn: f64 = 0.1,
        /// Least depth of the top of a strapless garment's side seam below the high point of the shoulder, metres.
        pub armpit_below: f64 = 0.22,
        /// Heights of the girths, metres: under the armpit (from the shoulder point), waistband and hip line (from the waist).
        pub girth_levels: [f64; 3] = [-0.26, -0.01, -0.19],
        /// Largest relative deviation of the median edge of a flat rest shape from its length in space.
        pub same_scale: f64 = 0.05,
        /// The same for the quartiles of the edges.
        pub isometric: f64 = 0.25,
    }
}
