//! Settings of the canonical pose and of the body's cross-sections.

use super::settings;

settings! {
    /// Settings of the cross-sections.
    pub struct SectionSettings {
        /// Canonical pose in which the body is cut.
        pub canonical: CanonicalSettings = CanonicalSettings::default(),
        /// Distance between two cross-sections, metres: wider misses waists, narrower only costs time.
        pub spacing: f32 = 0.01,
        /// Share of the gap between crotch and inseam that trousers climb where thighs touch; at 1 they never come to rest.
        pub fork_rise: f32 = 0.5,
        /// Half width of the sagittal strip in which the crotch is searched, metres; a wider one meets the thighs.
        pub crotch_strip: f32 = 0.012,
        /// Lowest height of a crotch over stature: below are knees and feet.
        pub lowest_crotch: f32 = 0.3,
        /// Crotch below the hip joints where no skin is found in the strip, metres.
        pub crotch_drop: f32 = 0.08,
        /// Heights above the crotch between which the hip is widest: from (m), to [share of the trunk].
        pub hip_range: [f32; 2] = [0.02, 0.32],
        /// Heights above the crotch between which the waist is narrowest, shares of the trunk.
        pub waist_range: [f32; 2] = [0.30, 0.62],
        /// Heights of hip joints and shoulders over stature, for skeletons without these joints (ANSUR II).
        pub joint_heights: [f32; 2] = [0.52, 0.8],
    }

    /// Settings of the canonical pose.
    pub struct CanonicalSettings {
        /// Upper arms below the horizontal, radians: armpits open, shoulders not shrugged.
        pub arms_down: f64 = 0.60,
        /// Legs from the vertical, radians. Larger keeps trouser legs apart, smaller leaves less to follow.
        pub legs_out: f64 = 0.10,
    }
}
