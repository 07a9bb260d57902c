//! Settings of the laws of measured fabrics.

use super::settings;

settings! {
    /// Repairs of measured data, which as they are would yield energy.
    pub struct ElasticSettings {
        /// Weight of compression against tension in the fading of the strain's size. Larger fades sooner: at a lateral
        /// contraction of 0.3 times the stretch, the size falls short of the stretch by 1 %.
        pub fading: f64 = 0.5,
        /// Least stiffness of a row of the stretching data (N/m). Fits of weak fabrics have negative eigenvalues: those would
        /// yield energy without bound.
        pub least_stretch: f64 = 5.0,
        /// Least stretching stiffness at rest and between the measured angles (N/m), below that at them so that the repair
        /// stays small.
        pub least_elsewhere: f64 = 1.0,
        /// Share of the repair between angles below which a direction counts as measured.
        pub measured: f64 = 0.02,
        /// Largest coupling over the geometric mean of two stiffnesses; from 1 on a sheet is unstable.
        pub largest_coupling: f64 = 0.9,
        /// Curvature from which yarn friction is full (1/m): KES-FB2 reaches its line at about 0.05/cm. Smaller: flat cloth is
        /// stiffer and Newton's systems harder.
        pub friction_onset: f64 = 5.0,
        /// Least rigidity (N·m), far below any fabric's.
        pub least_bend: f64 = 1e-8,
        /// Least twist stiffness over the rigidity about 45°, half of an isotropic sheet's.
        pub least_twist: f64 = 0.25,
    }
}
