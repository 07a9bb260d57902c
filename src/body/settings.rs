//! Settings of the tape, of arms beside the trunk, and of rigs.

use tryon_geometry::settings;

settings! {
    /// Places of the tape on a body.
    pub struct TapeSettings {
        /// Navel between hip joints (0) and neck joint (1): omphalion 1.017 m at a stature of 1.692 m, ANSUR II means.
        pub navel: f64 = 0.24,
        /// Range of the narrowest part of the trunk, measured as `navel`.
        pub waist_between: [f64; 2] = [0.16, 0.5],
        /// The acromion lies above and a little outside the shoulder joint, 30° from the vertical (tangent).
        pub acromion_lean: f64 = 0.577,
        /// Lowest height of the fullest part of the chest, measured as `navel`.
        pub lower_chest: f64 = 0.55,
        /// The trunk's outline ends within this times the shoulder joints' half breadth where arms are apart from it.
        pub trunk_breadth: f64 = 1.25,
        /// Highest level of the seat above the hip joints, metres.
        pub seat_above: f64 = 0.06,
        /// Level of the thigh below the crotch, metres.
        pub thigh_below: f64 = 0.02,
        /// Range of the calf: below the knee and above the ankle, metres.
        pub calf: [f64; 2] = [0.05, 0.1],
        /// Shares of the way from neck to head at which the neck is thinnest.
        pub neck: [f64; 3] = [0.35, 0.5, 0.65],
        /// Share of the way along the upper arm of the biceps.
        pub biceps: f64 = 0.55,
        /// Share of the way along the forearm of the wrist.
        pub wrist: f64 = 0.97,
    }

    /// Settings of arms that are turned out of the trunk.
    pub struct ArmClearanceSettings {
        /// Points of the upper arm, as shares of the bone: armpits are no overlap, and elbows and forearms, turned out too, would
        /// leave the picture's arms.
        pub upper: [f64; 2] = [0.4, 0.6],
        /// Largest turn of a shoulder, radians: an arm through the chest is a fault of tracking, and stays.
        pub most_turn: f64 = 0.35,
    }

    /// Settings of the weights of a rigged mesh.
    pub struct RigSettings {
        /// Template vertices further than this from a mesh vertex lend it no weights, metres. A template on the mesh is within
        /// 5 cm even where hair or shoes stand off.
        pub reach: f32 = 0.15,
        /// Share of `reach` by which both skins are shifted along their normals before the search: it keeps the other side of
        /// a limb further away.
        pub shift: f32 = 0.3,
    }
}
