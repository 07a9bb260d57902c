//! Settings of the first drape: schedule, substeps, contact, untangling, hoods.

use super::settings;

settings! {
    /// Settings of the drape.
    pub struct OutfitDrapeSettings {
        /// Substeps and bodies.
        pub schedule: ScheduleSettings = ScheduleSettings::default(),
        /// Rate of velocity damping (1/s): a skirt swings out in a quarter of a second.
        pub damping: f64 = 5.0,
        /// Largest speed of cloth that is put on (m/s).
        pub max_speed: f64 = 2.0,
        /// Largest speed of a fine sheet that was smoothed locally (m/s). Compressed cloth springs back at 2 m/s, and through
        /// itself.
        pub max_compressed_speed: f64 = 0.3,
        /// Substeps between two contact queries: cloth at 1 m/s moves 1.6 cm at 2 ms.
        pub query_interval: usize = 8,
        /// Substeps between two queries of a hood against itself.
        pub hood_interval: usize = 4,
        /// Substeps between two untangling iterations of a sheet that intersects.
        pub untangle_interval: usize = 2,
        /// Passes over the edges in a substep. With one, trousers of 40 rows hang a tenth too long.
        pub sweeps: usize = 4,
        /// Contact.
        pub contact: DrapeContactSettings = DrapeContactSettings::default(),
        /// Cloth that friction holds down.
        pub held_down: HeldDownSettings = HeldDownSettings::default(),
        /// Motion with the skin.
        pub follow: FollowSettings = FollowSettings::default(),
        /// Untangling.
        pub untangle: UntangleSettings = UntangleSettings::default(),
        /// Hoods.
        pub hood: HoodDrapeSettings = HoodDrapeSettings::default(),
    }

    /// Settings of the schedule: hang in the canonical pose, follow the body, settle, refine.
    pub struct ScheduleSettings {
        /// Substep on the coarse mesh, s.
        pub coarse_step: f64 = 2e-3,
        /// Substeps that close seams and gaps.
        pub closing: usize = 60,
        /// Share of gravity while seams close. Larger lets open panels fall.
        pub closing_gravity: f64 = 0.1,
        /// Substeps of the first drape, 0.5 s: cloth that started 2 cm off the body hangs.
        pub draping: usize = 260,
        /// Bodies from the canonical to the tracked pose and substeps on each; 16 are at most 8° apart for a half-turn of the arm.
        pub following: [usize; 2] = [16, 12],
        /// The same with untangling: from farther bodies cloth is moved into other cloth.
        pub untangled_following: [usize; 2] = [24, 8],
        /// Untangling iterations on each of these bodies.
        pub clearing: usize = 6,
        /// Most untangling iterations in the tracked pose; most garments need none.
        pub cleared: usize = 120,
        /// Substeps in the tracked pose.
        pub settling: usize = 80,
        /// Substep on the fine mesh, s.
        pub fine_step: f64 = 1e-3,
        /// Substeps on the fine mesh: they add the wrinkles that the coarse one lacks.
        pub finishing: usize = 90,
        /// Attempts to settle until the fine garment is free of itself off the arms: hoods may fold in a way that nothing
        /// untangles.
        pub attempts: usize = 4,
    }

    /// Settings of coming to rest in the simulator.
    pub struct SettlingSettings {
        /// Fewest and most steps; further ones only untangle.
        pub steps: [usize; 2] = [12, 60],
        /// Length of a step, s.
        pub step: f64 = 1.0 / 60.0,
        /// Largest speed, m/s: a drape starts with forces of thousands of its weights.
        pub max_speed: f32 = 0.3,
    }

    /// Settings of the contact with skin and outer garments.
    pub struct DrapeContactSettings {
        /// Distance beyond which a plane is ignored (m).
        pub reach: f64 = 0.10,
        /// Radius around its point within which a plane approximates the surface (m).
        pub plane_size: f64 = 0.10,
        /// Distance outside an outer garment beyond which a vertex is not under it (m): a bell of a skirt stands out less, the
        /// other side of the body is farther.
        pub outer_reach: f32 = 0.15,
        /// Distance below a hem up to which an inner garment may stand out as far (m): an edge of the coarse mesh, whose
        /// triangles cross the hem.
        pub hem: f32 = 0.05,
        /// Distance kept under an outer garment (m): a little more than the 2.5 mm between two layers on the skin.
        pub under: f64 = 0.003,
        /// Coulomb coefficient against sliding up the trunk; sliding down and around is free. With none, tight hems roll up to
        /// the neck.
        pub held_down: f64 = 0.5,
        /// Largest motion of one projection out of the body (m): deeper vertices come out over several substeps.
        pub lift: f64 = 0.01,
        /// Depth in other skin beyond which skin supports no cloth (m).
        pub closed: f64 = 0.03,
        /// Depth that is left at the end (m): a millimetre more than tangled cloth may sink.
        pub deep: f64 = 0.003,
        /// Length of the difference of two skins' normals from which they face each other: √2 at a right angle.
        pub facing: f64 = 1.41,
        /// Distance from its own skin beyond which cloth may lie on the other half (m): a shirt hangs beside a forearm.
        pub halved: f64 = 0.06,
        /// Distance of either layer from the middle plane (m): half of that between two layers on the skin.
        pub half_gap: f64 = 0.00125,
    }

    /// Settings of cloth around the trunk that friction keeps from sliding up.
    pub struct HeldDownSettings {
        /// Distance from sleeves within which skin does not hold cloth down [m of cloth]. Smaller stretches a lowered arm's
        /// sleeve (p99 0.34 instead of 0.05 on a T-shirt that fits).
        pub sleeve: f64 = 0.15,
        /// The same distance from the shoulders [m of cloth]: armholes without a sleeve are within 24 cm.
        pub top: f64 = 0.34,
    }

    /// Settings of the motion with the skin between two bodies.
    pub struct FollowSettings {
        /// Distance from the skin up to which cloth follows it (m); the share fades to zero at twice that.
        pub within: f64 = 0.04,
        /// The same for sleeves. Smaller, and an arm that bends leaves a wide sleeve.
        pub sleeve_within: f64 = 0.07,
    }

    /// Settings of untangling.
    pub struct UntangleSettings {
        /// Growth of a tangled vertex's slack in one iteration (m).
        pub slack_step: f64 = 0.001,
        /// Largest slack (m): between two skins the offset is the only clearance.
        pub max_slack: f64 = 0.005,
        /// Share of the slack that a vertex keeps in an iteration without intersection.
        pub slack_decay: f64 = 0.98,
        /// Iterations between two relaxations of lengths and contacts, both of which may intersect anew.
        pub relax_interval: usize = 2,
        /// Iterations with relaxation; later ones only limit stretch.
        pub relaxed: usize = 10,
        /// Time step of a relaxation (s).
        pub relax_step: f64 = 1e-3,
        /// Iterations without progress before local smoothing. A hood folds over itself in three layers, none of which is on
        /// the wrong side.
        pub stuck: usize = 16,
        /// Most local smoothings.
        pub max_smoothings: usize = 4,
        /// Depth under the skin that is allowed in later iterations (m). Deeper shows skin in the armpits of a heavy subject.
        pub allowed_depth: f64 = 0.002,
        /// Stretch ratio that later iterations allow. Below 1.19 (p99) a hood in folds on the neck did not come free.
        pub max_stretch: f64 = 1.07,
    }

    /// Settings of the self-contact of a hood that is put on.
    pub struct HoodDrapeSettings {
        /// Distance of two folds (m); at most a quarter of the edges.
        pub thickness: f32 = 0.01,
        /// Distance below which folds are in contact (m). With 18 mm, as in worn garments, hoods have a quarter more
        /// intersections after a second and a half.
        pub reach: f32 = 0.026,
        /// Separation of nearer folds between two queries (m).
        pub separation: f64 = 0.001,
        /// Largest speed (m/s): two millimetres between two queries. Limited only near other folds, one in seven hoods
        /// intersects itself.
        pub max_speed: f64 = 0.3,
    }
}
