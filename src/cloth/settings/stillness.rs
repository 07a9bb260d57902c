//! Settings of the sleep of still cloth. Pairs are for an exact and for a tracked body, unless said otherwise.

use super::settings;

settings! {
    /// Thresholds of the sleep of still cloth.
    pub struct StillnessSettings {
        /// Displacement of a still exact body, metres.
        pub still_body: f32 = 1e-3,
        /// Factor for skin without cloth on a tracked body: hands wander by 9 mm where skin under cloth stays within 4.
        pub bare_skin: f32 = 4.0,
        /// Factors within which a sleeping outfit follows a swaying tracked body: since sleep began, and per step.
        pub sway: [f32; 2] = [5.0, 2.0],
        /// Speed below which 95 % of still cloth are, m/s; shaken skirts swing at 0.04 to 0.13.
        pub still_cloth: [f32; 2] = [0.02, 0.15],
        /// Steps with body and cloth still after which the outfit falls asleep.
        pub still_steps: u32 = 10,
        /// Time for which cloth on a still body swings freely, s, before its speed is limited.
        pub free_swing: f64 = 0.6,
        /// Initial speed limit, m/s. With these limits a T-shirt over a skirt sleeps after 1.4 to 1.8 s, 1 to 4 mm (rms)
        /// from cloth that never slept; without, cloth between touching skins jumps for ever.
        pub speed_limit: f64 = 2.0,
        /// Half-life of the speed limit, s.
        pub speed_half_life: f64 = 0.15,
        /// Floor of the speed limit, m/s.
        pub speed_floor: f64 = 0.01,
        /// Speed below which an island may fall asleep, m/s. At 5 mm/s a ninth as much sleeps, at 10 mm/s cloth of coarse edges
        /// never does.
        pub island_speed: [f32; 2] = [0.02, 0.05],
        /// Steps below the sleep speed before an island falls asleep.
        pub slow_steps: u32 = 10,
        /// Factors of still skin within which a sleeping island follows a tracked body: since sleep began, and per step. With
        /// those of the whole outfit sleeves slept where a waving arm turns, 2 cm off.
        pub island_sway: [f32; 2] = [2.5, 1.0],
        /// Distance within which skin of other parts supports an island, and moving skin wakes it, metres.
        pub skin_distance: f32 = 0.03,
        /// Distance within which other moving cloth wakes an island: metres, and lengths of its edges.
        pub wake_distance: [f32; 2] = [0.008, 0.6],
        /// Relative elongation of a boundary edge that wakes an island.
        pub wake_elongation: f32 = 0.01,
        /// Rotation of a boundary edge that wakes an island, rad.
        pub wake_rotation: f32 = 0.07,
    }
}
