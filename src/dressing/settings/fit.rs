//! Settings of size advice and of the fit map.

use super::settings;

settings! {
    /// Settings of size advice.
    pub struct WornSizeSettings {
        /// Least ease at chest, waist and hip by design, metres: a waistband needs none, it sits lower on a fuller body.
        pub least_ease: [f64; 3] = [0.04, -0.03, 0.02],
        /// Ease beyond the least from which a place counts as loose, metres: two sizes of the table.
        pub loose: f64 = 0.14,
        /// Girth that a waistband may lack, metres: it sits lower, or its button moves.
        pub sits_lower: f64 = 0.03,
        /// Girth by which a waistband may be wider than the hips, metres: its button moves. Wider ones slide off.
        pub held_by_button: f64 = 0.02,
        /// Hem height from which trousers are shorts, metres.
        pub shorts: f64 = 0.25,
    }

    /// Settings of the fit map.
    pub struct FitMapSettings {
        /// Distance off the skin beyond its layer's own at which cloth still touches, metres.
        pub touch: f32 = 3e-3,
        /// Stretch (95th percentile) from which a region is tight: a woven fabric's comfortable limit, a third of the 12 % and
        /// more that skin strains at joints (Kirk & Ibrahim 1966).
        pub tight_stretch: f64 = 0.05,
        /// Mean pressure from which a region is tight, Pa: a waistband is felt but tolerated at 1 to 2 kPa, and 6 to 10 kPa are
        /// uncomfortable (Denton 1972).
        pub tight_pressure: f64 = 1_000.0,
        /// Mean distance from which a region is loose, metres: 19 cm of girth.
        pub loose_gap: f64 = 0.03,
        /// Least cloth from which a region is reported, m²: a hand's breadth square.
        pub least_area: f64 = 0.006,
    }
}
