//! Settings of the recovery: hidden limbs, repairs.

use super::settings;

settings! {
    /// Settings of the recovery.
    pub struct RecoverSettings {
        /// Arms that no reading shows.
        pub hidden: HiddenLimbSettings = HiddenLimbSettings::default(),
        /// Repairs.
        pub repair: RepairSettings = RepairSettings::default(),
    }

    /// Settings of limbs that no reading shows.
    pub struct HiddenLimbSettings {
        /// Gauss–Newton iterations: with the bound of a step they turn a limb by half a turn.
        pub iterations: usize = 6,
        /// Distance of a hidden bone inside the outline and behind the readings, metres: the radius of a limb.
        pub inset: f32 = 0.05,
        /// Bound of an angle's step, radians.
        pub most_step: f64 = 0.5,
        /// Damping per point, metres² over radians²: angles that no point needs stay.
        pub damping: f64 = 2e-3,
        /// Share of a hidden arm in free space above which it is put behind the readings. At 0.2 a forearm that is hidden
        /// for three frames is torn away (jacks 10.7 instead of 8.0 mm), at 0.45 arms come back late (9.0 mm).
        pub in_air: f32 = 0.3,
        /// Share of the elbow's angle that no reading holds from which on a forearm is hidden: visible ones stay below 0.2
        /// (jacks), hidden ones are above 0.99.
        pub unseen: f64 = 0.9,
        /// Share of a hidden arm that may be without return: 0.1 at most on recordings, 0.17 and more where a dark sleeve is
        /// before a wall.
        pub most_unknown: f32 = 0.13,
        /// Share of the area that may be uncovered meanwhile: an arm that is lost leaves readings uncovered where it is.
        pub most_uncovered: f32 = 0.02,
        /// Step of the finite differences, radians: larger is off by the limb's curvature, smaller by rounding.
        pub difference: f64 = 1e-4,
    }

    /// Settings of the repairs.
    pub struct RepairSettings {
        /// Interval between checks of a pose that agrees, frames: a check costs 2 ms, half a step.
        pub checked: u32 = 8,
        /// Wrong share of the area above which a repair is tried. Good tracks have 0.01 to 0.13 (decision 043); half of the
        /// frames of a good upper body pass 0.06.
        pub wrong: f32 = 0.08,
        /// Wrong share of the area above which the whole body is tried, not limbs alone; it costs three times as much.
        pub body_wrong: f32 = 0.12,
        /// Share of a part in free space above which one is tried; the forearms of a good upper body reach 0.39.
        pub part_wrong: f32 = 0.4,
        /// Shortest and longest wait after a repair without success, frames: loose clothes never agree.
        pub wait: [u32; 2] = [1, 120],
        /// Factor on the wrong share from which there is no waiting. Larger repairs a lost limb later.
        pub worse: f32 = 1.5,
        /// Factor on the cost that a better pose undercuts. 1 changes poses by noise.
        pub cheaper: f64 = 0.95,
        /// Frames for which a detected hand holds its arm after it was seen last: detection flickers. Larger leaves an arm in
        /// the air for longer.
        pub hand_memory: u32 = 15,
        /// Frames after which a limb in the air rests unseen: fast ones lag by three (jacks).
        pub stuck: u32 = 4,
        /// Share of a part in free space above which a stuck one is tried at rest. Smaller moves limbs that are right.
        pub part_in_air: f32 = 0.15,
        /// Factor on the cost that a pose at rest keeps below: what is unseen has no cost.
        pub no_dearer: f64 = 1.05,
        /// Factor on the wrong share that a better pose undercuts: cost alone takes a fast arm for a bent one.
        pub agrees: f32 = 0.7,
        /// Longest pair in comparisons, metres.
        pub reach: f32 = 0.10,
    }
}
