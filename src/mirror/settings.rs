//! Settings of a worn outfit.

use tryon_geometry::settings;

settings! {
    /// Settings of putting on, carrying and watching an outfit.
    pub struct OutfitSettings {
        /// Longer edges of coarse garments: 2.4 times fewer vertices. Longer ones don't resolve sleeves.
        pub coarser: f64 = 1.55,
        /// Longest displacement of skin in one step of a carry, metres: 1.5 m/s at steps of 1/30 s, half the speed of fast arms.
        pub carry_stride: f32 = 0.05,
        /// Stretch that one edge in a hundred exceeds in a garment that is caught or torn: dances reach 0.25 for a frame.
        pub most_strain: f64 = 0.25,
        /// Largest median distance of a limb's cloth from where skin would carry it, metres: dances reach 63 mm.
        pub most_offset: f32 = 0.08,
        /// Mean displacement of a body part that is a jump, metres: a fast arm moves by 0.2 m in 1/30 s.
        pub jump: f32 = 0.25,
        /// Least speed of a jump, m/s.
        pub jump_speed: f64 = 7.0,
    }
}
