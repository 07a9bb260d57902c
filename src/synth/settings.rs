//! Settings of synthetic people: how they stand, step and are lit.

use tryon_geometry::settings;

settings! {
    /// Stances: feet, knees, leans, and the start of recorded motion.
    pub struct StanceSettings {
        /// Longest leg over a straight one: knees of a straight leg have no direction to bend in.
        pub slack: f64 = 0.997,
        /// Weight of the rest axis against the plane of the limb: a limb bent by less than about 3° has no plane.
        pub straight: f64 = 0.05,
        /// Half distance between the feet (m).
        pub half_stance: f64 = 0.125,
        /// The same in a squat (m).
        pub half_squat: f64 = 0.19,
        /// Height of the hips over the ankles in a squat, share of the leg: thighs a little above level.
        pub squat: f64 = 0.50,
        /// Height of a knee joint over the floor that it rests on (m).
        pub knee_radius: f64 = 0.055,
        /// Turn of the kneeling foot about the body's x axis (rad): instep to the floor.
        pub toes_back: f64 = 2.6,
        /// Height of the root joint of somebody seated (m): 10 cm above the seat of a chair.
        pub seated: f64 = 0.57,
        /// Lean of the trunk in squat and kneel (degrees).
        pub leans: [f64; 2] = [24.0, 6.0],
        /// Time of one step with each foot (s): an unhurried 100 steps a minute.
        pub cycle: f64 = 1.2,
        /// Share of the cycle that a foot is in the air.
        pub swing: f64 = 0.4,
        /// Height of a foot in mid-swing as a share of the step, and at most (m).
        pub lift: [f64; 2] = [0.25, 0.07],
        /// Time of the calibration pose before a clip (s): a tracker measures the body.
        pub hold: f64 = 1.0,
        /// Time of the blend into the clip after it (s).
        pub blend: f64 = 1.0,
    }

    /// Light on a synthetic person.
    pub struct LightSettings {
        /// Direction of the light from above, in front and a little from the left, world.
        pub key: [f64; 3] = [-0.45, 0.75, 0.55],
        /// Direction of a weak light from the right, world.
        pub fill: [f64; 3] = [0.8, 0.2, 0.5],
        /// Shares of ambient light, light from above, key light and fill light.
        pub shade: [f32; 4] = [0.42, 0.10, 0.52, 0.14],
        /// Width of key and fill light: the cosine at which they set is minus this. 0 is a point, 1 a wall of light.
        pub width: [f32; 2] = [0.0, 0.0],
        /// Share of the key light that the body keeps from itself and from the floor; 0 casts no shadows.
        pub cast: f32 = 0.0,
        /// Share of ambient occlusion: darkness of folds of the body that see little of the room.
        pub occlusion: f32 = 0.0,
        /// Radius of the shadow under a foot and under the body (m).
        pub shadow: [f32; 2] = [0.16, 0.55],
        /// Darkness of these shadows in their middle.
        pub shadow_depth: [f32; 2] = [0.45, 0.30],
    }

    /// Display figure: its base layer, head and hair.
    pub struct FigureSettings {
        /// Skin, sRGB.
        pub skin: [u8; 3] = [226, 187, 162],
        /// Hair, sRGB.
        pub hair: [u8; 3] = [74, 57, 47],
        /// Tank top, sRGB.
        pub top: [u8; 3] = [190, 182, 172],
        /// Leggings, sRGB.
        pub leggings: [u8; 3] = [116, 109, 103],
        /// Passes of smoothing of the head: 200 leave neither nose nor ears.
        pub smoothing: usize = 200,
        /// Passes of smoothing between head and neck.
        pub jaw: usize = 30,
        /// Passes of smoothing of the body under the base layer: 12 span the navel.
        pub span: usize = 12,
        /// Thickness of the hair and of its knot (m).
        pub thickness: [f32; 2] = [0.010, 0.040],
        /// Share of light that skin scatters into its shadow, red to blue.
        pub scatter: [f32; 3] = [0.16, 0.07, 0.04],
        /// Gloss of skin, cloth and hair: brightness of the highlight, share of white.
        pub gloss: [f32; 3] = [0.05, 0.0, 0.10],
    }

    /// Own clothes of an everyday person.
    pub struct StreetClothes {
        /// Number of the colours of skin and hair.
        pub person: u64 = 0,
        /// Colour of top or coat, sRGB.
        pub top: [u8; 3] = [52, 82, 60],
        /// Colour of the trousers, sRGB.
        pub trousers: [u8; 3] = [52, 60, 96],
        /// Sleeves reach the wrists.
        pub has_long_sleeves: bool = true,
        /// Distance from the skin at trunk and hips, thighs, arms (m); a coat that stands off reaches the knees. 0 for none.
        pub coat: [f32; 3] = [0.0; 3],
    }

    /// Things worn that hide the shape of a body, and its stoop.
    pub struct CoveringSettings {
        /// Share of the stoop that the neck takes.
        pub neck: f64 = -0.8,
        /// Passes of smoothing of a covering's thickness along the surface.
        pub smoothing: usize = 12,
        /// Thickness of a coat (m): trunk and hips, thighs, shins' upper part, arms.
        pub coat: [f32; 3] = [0.07, 0.10, 0.04],
        /// Thickness of hair on the skull and where it falls on neck and back (m).
        pub hair: [f32; 2] = [0.035, 0.065],
    }

    /// Rooms of shops.
    pub struct ShopSettings {
        /// Distance of the first place from the camera (m).
        pub away: [f64; 2] = [1.0, 4.0],
        /// Height of the camera (m).
        pub height: [f64; 2] = [0.8, 2.1],
        /// Roll of the camera to either side (degrees).
        pub roll: f64 = 4.0,
        /// Clearance between furniture and a place where somebody stands (m).
        pub clearance: f64 = 0.55,
        /// Pieces of a room, least and most.
        pub pieces: [usize; 2] = [5, 9],
        /// Trials to place each.
        pub trials: usize = 60,
        /// Heights on the axis of a piece of which one must be in view (m).
        pub heights: [f64; 3] = [0.3, 0.9, 1.4],
    }
}
