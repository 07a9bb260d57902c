//! Settings of the shape: calibration, size, surface, bodies that were measured before.

use super::settings;

settings! {
    /// Settings of the shape.
    pub struct ShapeSettings {
        /// Most rounds of pose and size in the first frame. Fewer start with a size that is off.
        pub rounds: usize = 8,
        /// Rounds of a trial at another height.
        pub trial_rounds: usize = 2,
        /// Change of a coefficient, or of ten times a scale, below which size has settled. Smaller costs rounds.
        pub settled: f64 = 0.05,
        /// Residual of a first fit above which other heights are tried, metres. Along an upright body the surface hardly
        /// changes, so that a fit 10 cm too high settles there (6.6 mm against 2.1; sensor noise lies between).
        pub well_fitted: f64 = 4e-3,
        /// Displacement of the trials along the upright, metres. Larger leaves the reach of a fit.
        pub shift: f64 = 0.15,
        /// Frames over which residuals are compared: one alone may be of a pose in motion. Larger wears a stranger's size
        /// for longer.
        pub probation_frames: u32 = 8,
        /// Difference between the heights of fitted body and readings from which they are of two persons, metres: hair,
        /// soles and the grid take 3 cm. Smaller forgets who changed shoes.
        pub height_tolerance: f64 = 0.06,
        /// Iterations of a trial at another height: shifted from a fitted pose, eight rank it as twenty do.
        pub trial_iterations: usize = 8,
        /// Largest ratio of the least residual of `probation_frames` to the earlier one: fits of one person stay within a
        /// third, a girth 6 cm off doubles them.
        pub residual_ratio: f64 = 1.5,
        /// Allowance that is added to it, metres.
        pub residual_allowance: f64 = 5e-4,
        /// Bone scales and shape coefficients.
        pub size: BodySizeSettings = BodySizeSettings::default(),
        /// Displacements.
        pub surface: SurfaceSettings = SurfaceSettings::default(),
    }

    /// Settings of size and shape coefficients.
    pub struct BodySizeSettings {
        /// Prior of a coefficient (one standard deviation = 1), per point, m²: larger keeps the mean shape against readings.
        pub prior: f64 = 5e-7,
        /// Standard deviation of a bone's scale: with a shape space, which explains most of it, and without one. Larger lets
        /// single bones drift.
        pub scale_deviations: [f64; 2] = [0.05, 0.15],
        /// Weight λₛ of eq. 23, per point, m²: bones tied by symmetry differ by a tenth of what single ones do.
        pub tie: f64 = 5e-3,
        /// Frames with the longer pairs. Fewer keep a wrong stature.
        pub searching: u32 = 20,
        /// Point-to-point weight: two fifths of the pose's, as sizes must slide along limbs. Larger holds lengths at their
        /// first estimate.
        pub point_to_point: f64 = 0.02,
        /// Frames between two comparisons of the girths: half a second at 30 Hz.
        pub settling_frames: u32 = 15,
        /// Change of a girth over `settling_frames` below which the size has settled, metres: a quarter of a step of the
        /// size table. A first estimate is off by up to 4 cm and settles within 30 to 45 frames.
        pub settled_girth: f64 = 0.01,
        /// Factor on earlier information per frame: its pairs belonged to a body not yet adapted. Smaller forgets earlier
        /// poses.
        pub fade: f64 = 0.95,
        /// Frames of each view of the body that add to size and shape. More cost time, and follow clothes that are taken off.
        pub view_frames: u32 = 30,
        /// Change of a coefficient that weighs as much as a change of a scale, for convergence. Larger adds rounds.
        pub scale_change: f64 = 10.0,
        /// Longest pair in the first frames, metres: feet of a wrong stature start 10 cm away.
        pub first_reach: f32 = 0.15,
        /// Kernel width in the first frames, metres.
        pub first_sigma: f64 = 0.08,
        /// Longest pair after `searching` frames, metres.
        pub later_reach: f32 = 0.08,
        /// Kernel width after `searching` frames, metres.
        pub later_sigma: f64 = 0.04,
        /// Statures of adults, metres.
        pub adults: [f64; 2] = [1.3, 2.2],
        /// Least stature of a child, metres; it is also a height of adults who crouch or sit.
        pub least_child: f64 = 0.9,
        /// Regularisation of the eliminated pose, per point: far below any observed angle, keeps unobserved ones from absorbing
        /// all information.
        pub pose_ridge: f64 = 1e-7,
    }

    /// Settings of the surface displacements.
    pub struct SurfaceSettings {
        /// Weight of the Laplacian in eq. 17 (paper, section 3.3). Larger smooths folds away.
        pub laplacian: f32 = 4.0,
        /// Weight of the temporal term (paper, section 3.3). Larger calms the surface and follows new folds later.
        pub temporal: f32 = 6.0,
        /// Weight of equal neighbours (paper, section 3.3). Larger flattens folds.
        pub spatial: f32 = 2.0,
        /// Updates after which the temporal term acts (paper, section 3.3). Earlier freezes the first guess.
        pub temporal_from: u32 = 20,
        /// Pull to zero where there was never a reading: displacements explain only the remainder of shape. Larger pulls
        /// unseen sides in.
        pub ridge: f32 = 0.05,
        /// Longest displacement towards a reading, metres (paper, section 3.3). Larger takes arms for clothes.
        pub distance: f32 = 0.05,
        /// Deviation at which the temporal term weighs as much as a reading, metres; the paper leaves its unit open.
        pub unit_deviation: f32 = 0.005,
        /// Least deviation of a displacement, metres: the accuracy of averaged depth.
        pub least_deviation: f32 = 0.002,
        /// Conjugate gradient iterations per update; the next one starts from their result. More cost time.
        pub iterations: usize = 5,
        /// Depth behind the drawn body from which a vertex is occluded, metres.
        pub hidden: f32 = 0.04,
        /// Cosine between normal and viewing ray below which a reading is too grazing to measure a displacement. Smaller
        /// lets outlines bulge.
        pub grazing: f32 = 0.35,
        /// Cosine between the normals of vertex and reading below which they belong to different surfaces (Table 1: 60°).
        pub cos_normal: f32 = 0.5,
        /// Longest pair when the body is drawn for displacements, metres (paper, section 3.3).
        pub pair_distance: f32 = 0.05,
        /// Root mean square change below which displacements have settled, metres; 0 updates them at the same interval for
        /// ever.
        pub settled: f32 = 0.4e-3,
        /// Longest interval between updates of settled displacements, frames. Larger follows a changed coat later.
        pub longest_interval: u32 = 24,
    }
}
