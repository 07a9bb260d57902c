//! Settings of the offline solver.

use super::settings;
use serde::{Deserialize, Serialize};

/// Order of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum TimeScheme {
    /// First order, dissipative.
    ImplicitEuler,
    /// Second order with a variable step.
    #[default]
    Bdf2,
}

settings! {
    /// Settings of the time integration.
    pub struct OfflineSettings {
        /// Order of the steps.
        pub scheme: TimeScheme = TimeScheme::Bdf2,
        /// Longest step (s).
        pub longest_step: f64 = 1.0 / 60.0,
        /// Halvings of the longest step before a step that is not solved is an error.
        pub halvings: u32 = 10,
        /// Local error of a step that is accepted: root mean square over the vertices, per second (m/s). A smaller one follows
        /// the exact motion longer, in more steps.
        pub error_rate: f64 = 0.01,
        /// Steps of one length before a longer one is tried: a two-step method needs two to settle.
        pub steps_before_growth: u32 = 4,
        /// Share of the allowed error below which the step doubles; a third-order local error grows eightfold.
        pub growth_share: f64 = 0.1,
        /// Stiffness of a pin (N/m): 1 µm for the weight of 1 kg. It adds to a diagonal block alone, so the condition of the
        /// preconditioned system does not suffer.
        pub pin_stiffness: f64 = 1e7,
        /// Newton's method.
        pub newton: NewtonSettings = NewtonSettings::default(),
        /// Contact; `None` lets surfaces pass through each other.
        pub contact: Option<ContactSettings> = Some(ContactSettings::default()),
        /// Spring of the obstacle's vertices.
        pub obstacle: ObstacleSpring = ObstacleSpring::default(),
        /// Regions that are still sleep; `None` computes every frame whole.
        pub sleep: Option<SleepSettings> = Some(SleepSettings::default()),
    }

    /// End and means of Newton's method.
    pub struct NewtonSettings {
        /// Root mean square motion of the vertices in one iteration that counts as solved (m), as the line search left it.
        pub tolerance: f64 = 1e-4,
        /// Largest motion of one vertex then (m).
        pub largest: f64 = 2e-3,
        /// Most iterations.
        pub iterations: usize = 100,
        /// Accuracy of conjugate gradients, as the share of [`tryon_geometry::linear::CgAccuracy::Decrease`].
        pub linear_share: f64 = 0.2,
        /// Most iterations of conjugate gradients.
        pub linear_iterations: usize = 2000,
        /// Accuracy, relative to that of other iterations, of one that would end the iteration.
        pub last_accuracy: f64 = 0.1,
        /// Accuracy of a step's first guess, likewise: the forces of the moving obstacle dwarf those of cloth.
        pub guess_accuracy: f64 = 1e-3,
        /// Share of the linear decrease that a step must reach (Armijo).
        pub sufficient_decrease: f64 = 1e-4,
        /// Halvings of a step before the line search gives up.
        pub max_halvings: usize = 40,
        /// Longest motion of a vertex in one iteration (m): longer ones make candidates of everything, which fills the memory.
        pub longest: f64 = 0.1,
    }

    /// Still air around garments.
    pub struct AirSettings {
        /// Density at 20 °C (kg/m³).
        pub density: f64 = 1.2,
        /// Drag coefficient of a square plate across the flow (Hoerner 1965, "Fluid-dynamic drag").
        pub drag: f64 = 1.18,
    }

    /// Contact of cloth with itself and with the obstacle.
    pub struct ContactSettings {
        /// Distance beyond the thickness at which the barrier begins (m).
        pub activation: f64 = 1e-3,
        /// Distance that nothing goes below (m).
        pub thickness: f64 = 0.0,
        /// Stiffness of the barrier (J).
        pub stiffness: f64 = 2e-5,
        /// Coulomb coefficient.
        pub friction: f64 = 0.3,
        /// Speed from which friction is full (m/s); what sticks creeps slower than that.
        pub creep: f64 = 5e-3,
        /// Displacement in one step from which friction is full at the latest (m): what sticks creeps less than that in a
        /// step, however long. A fifth of what a drape counts as settled; decision 079 has others.
        pub slip: f64 = 1e-4,
        /// Motion of vertices that the candidates allow for beyond that of the query (m). Larger: fewer queries, more pairs.
        pub margin: f64 = 1e-4,
        /// Share of the way to the first impact that a step takes, so that no distance becomes zero.
        pub impact_share: f64 = 0.8,
        /// Stiffness that keeps the gaps of a first guess (N/m): above that of membranes, so that these yield.
        pub gap_stiffness: f64 = 1e4,
        /// Longest reach of these springs (m).
        pub gap_reach: f64 = 0.01,
    }

    /// Spring between an obstacle vertex and its target: E = k δ² (√(1 + d²/δ²) − 1).
    pub struct ObstacleSpring {
        /// k (N/m): stiffness near the target. Smaller: skin yields visibly to cloth that lies on it.
        pub stiffness: f64 = 1e4,
        /// δ (m): displacement from which the force, at most k δ, saturates.
        pub give: f64 = 1e-3,
    }

    /// Sleep of vertices.
    pub struct SleepSettings {
        /// Distance from one place up to which a vertex counts as still (m).
        pub distance: f64 = 5e-4,
        /// Time that a vertex is still before it sleeps, and the longest that it sleeps (s).
        pub time: f64 = 0.25,
    }

    /// End of a static drape.
    pub struct DrapeSettings {
        /// Root mean square motion in a step of the longest length that counts as settled (m).
        pub tolerance: f64 = 1e-4,
        /// Motion of a single vertex that is negligible beside a root mean square of 1: the defaults of Newton's method.
        pub largest: f64 = 20.0,
        /// Motion in the last iteration of a loosely solved step by the motion that counts as settled.
        pub looseness: f64 = 5.0,
        /// First and longest step (s). A longer one nears the quasi-static limit, and its systems are harder to solve.
        pub steps: [f64; 2] = [1.0 / 60.0, 0.25],
        /// Most steps that are solved to what counts as settled, for the way to rest is of no interest.
        pub most_steps: usize = 60,
        /// Most steps after those, solved to the solver's tolerance; none for a finer mesh to go on from here.
        pub final_steps: usize = 60,
    }

    /// Repair of a start.
    pub struct OfflineStartSettings {
        /// Smoothing passes before a start is refused.
        pub passes: usize = 60,
        /// Passes after which one more ring of vertices takes part; as many without fewer crossings end the repair.
        pub passes_per_ring: usize = 15,
        /// Distance by which the obstacle shrinks in one pass (m).
        pub shrink: f64 = 5e-4,
        /// Displacement beyond which a repair is a change of the garment, and the start is refused (m).
        pub largest: f64 = 0.02,
        /// Share of the way to its neighbours' mean that a vertex moves in one pass.
        pub smoothing: f64 = 0.5,
    }
}
