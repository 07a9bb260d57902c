//! Settings of the explicit solver.

use super::settings;

settings! {
    /// Settings of the explicit solver.
    pub struct SolverSettings {
        /// Substep above which accelerations need no smoothing, s. At 1/2400 s, with more smoothing, still cloth never slept.
        pub unsmoothed_step: f64 = 1.0 / 3600.0,
        /// Longest substep, s: beyond it contact is resolved too rarely.
        pub max_substep: f64 = 1e-3,
        /// Fewest and most substeps between two evaluations of bending. Fewer cost more than narrow hinges need; more gain
        /// little.
        pub bending_interval: [usize; 2] = [3, 6],
        /// Safety factor of the stability limit (ratio of eigenvalues): strain stiffens elements, and the eigenvalue is a lower
        /// bound. With 1.12 a crumpled square on the sphere diverged, with 1.2 none did.
        pub stability_margin: f64 = 1.3,
        /// Share of elements that may be too stiff for a step which counts as stable for the sheet. More soften visible cloth.
        pub outliers: f64 = 0.05,
        /// Share of the limit that ends the softening. Nearer takes more iterations; farther softens more than needed.
        pub near_limit: f64 = 0.96,
        /// Under-relaxation of the softening's correction. Nearer to 1 overshoots the limit in the last iteration.
        pub relaxation: f64 = 0.985,
        /// Range of that correction in one iteration (ratio): a wider one oscillates on sheets with slivers.
        pub correction: [f64; 2] = [0.3, 1.5],
        /// Angle of a hinge that counts as flat at rest (rad): rounding of the coordinates of a flat sheet.
        pub flat: f64 = 1e-4,
        /// Start of the mass filter's Chebyshev argument beyond 1, times the degree squared: every wave keeps a twentieth of
        /// its acceleration. Smaller leaves some waves nearly without forces; larger shortens the step.
        pub filter_damping: f64 = 1.0,
        /// Safety factor of the mass filter's largest eigenvalue, whose estimate is a lower bound. Larger filters less.
        pub eigenvalue_margin: f64 = 1.03,
        /// Quantile of the vertices' stiffness over mass that normalises the filter's weights. Larger lets slivers weaken it.
        pub usual_quantile: f64 = 0.9,
        /// Stretch ratio above which cloth is exempt from speed limits: held open in an armpit, sleeves tear (p99 0.26
        /// instead of 0.16).
        pub taut: f32 = 1.15,
        /// Stretch ratio above which contact constraints are released: more than knitwear is worn at.
        pub overstretched: f32 = 1.5,
        /// Speed that a vertex may gain towards a surface between two searches for reachable planes (m/s): over 0.85 ms 120
        /// times gravity. Smaller misses contacts; larger keeps planes out of reach.
        pub speed_gain: f32 = 1.0,
        /// Share of a penetration that one substep removes. Larger jitters; smaller leaves cloth inside for longer.
        pub recovered: f32 = 0.2,
        /// Speed at which cloth below the skin comes out, m/s; faster, a body that closes on itself throws it.
        pub body_recovery: f32 = 1.0,
        /// The same for cloth on the wrong side of cloth, where the body may be in the way.
        pub cloth_recovery: f32 = 0.3,
    }
}
