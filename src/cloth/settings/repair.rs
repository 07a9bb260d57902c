//! Settings of the repair of worn garments.

use super::settings;

settings! {
    /// Settings of the repair of worn garments.
    pub struct ClothRepairSettings {
        /// Largest displacement of an untangling query, metres. With 3 mm sleeves and hoods have three times the crossings.
        pub max_displacement: f64 = 0.006,
        /// Height above the skin below which nothing is moved, metres: less than a fabric's thickness.
        pub min_height: f64 = 5e-4,
        /// Distance beyond which skin does not constrain the displacement, metres.
        pub near_skin: f64 = 0.02,
        /// Time after which a still body's garments are not queried, s: what has no clearance would never rest.
        pub max_still_time: f64 = 1.0,
        /// Vertices that determine a rotation; joints with fewer move with the whole body.
        pub joint_vertices: f64 = 12.0,
        /// Untangling of a sheet.
        pub untangler: UntanglerSettings = UntanglerSettings::default(),
    }

    /// Settings of the untangling of a sheet.
    pub struct UntanglerSettings {
        /// Largest motion of an edge against a triangle in one iteration (m). A third of it leaves intersections from one pose
        /// to the next.
        pub step: f64 = 0.003,
        /// Distance at which vertices from the wrong side are placed (m).
        pub gap: f64 = 0.001,
        /// Least sine of the angle between an edge and a triangle: flatter ones would displace the contour without bound.
        pub min_sine: f64 = 0.05,
        /// Turn of the contour (length of a sum of unit vectors) below which the displacement is less than a whole step.
        pub straight: f64 = 1.0,
        /// Weight of the edge's steepness against the contour's direction (Volino & Magnenat-Thalmann, eq. 5).
        pub steepness: f64 = 2.0,
        /// Share of its sheet's vertices below which a part that is cut off is on the wrong side.
        pub cut_off: f64 = 0.3,
    }
}
