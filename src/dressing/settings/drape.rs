//! Settings of the drape.

use super::settings;

settings! {
    /// Settings of the drape: hang in the canonical pose, follow the body, come to rest.
    pub struct OutfitDrapeSettings {
        /// Length of a step, s.
        pub step: f64 = 1.0 / 60.0,
        /// Steps in the canonical pose, each from rest: at 1 m/s seams shrink to their lengths, and cloth lies on the skin.
        /// With its momentum cloth leaps by 5 cm, collars under long hair.
        pub hanging: usize = 16,
        /// Largest speed meanwhile, m/s: panels start at up to seven times their lengths.
        pub hanging_speed: f32 = 1.0,
        /// Friction on skin meanwhile, over the fabric's: with it cloth stays stretched over shoulders and hips.
        pub hanging_friction: f32 = 0.0,
        /// Steps, and bodies, from the canonical to the tracked pose: half a turn of an arm are 8° each.
        pub following: usize = 24,
        /// Largest speed meanwhile, m/s: that of hands.
        pub following_speed: f32 = 3.0,
        /// Fewest and most steps in the tracked pose; further ones only untangle.
        pub settling: [usize; 2] = [24, 60],
        /// Largest speed there, m/s: faster, cloth swings on.
        pub settling_speed: f32 = 0.3,
    }
}
