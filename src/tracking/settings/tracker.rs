//! Settings of a tracker as a whole.

use super::settings;
use super::{
    AssessSettings, Association, FitSettings, ModelSettings, RecoverSettings, RegistrationSettings,
    SegmentSettings, ShapeSettings, StartSettings, StepSettings,
};

settings! {
    /// Settings of a tracker. Gains and losses are of the mean joint error over the nine scenes of docs/benchmarks/tracking.md,
    /// which is 9.1 mm.
    pub struct TrackerConfig {
        /// Correspondence search from frame to frame; an initial pose always searches in the images. `KdTree`: the
        /// projective search costs 0.9 mm.
        pub association: Association = Association::KdTree,
        /// Sample points of the template in the pose fit: 2,000 gain 0.4 mm at up to half as long again, 500 lose 0.9 mm.
        pub samples: usize = 1000,
        /// Stride over cells in the search from the data to the model: 1 gains nothing, 4 loses 0.1 mm.
        pub data_step: usize = 2,
        /// Pixels per cell side; `None` chooses by focal length.
        pub stride: Option<u32> = None,
        /// Weight of point-to-point beside point-to-plane: without it limbs along the view creep, more slows them.
        pub point_to_point: f64 = 0.05,
        /// Weight of point-to-plane, along the mean of both normals.
        pub point_to_plane: f64 = 1.0,
        /// Weight pairs by the Geman–McClure kernel.
        pub robust: bool = true,
        /// Use pairs found from the readings' side too.
        pub both_ways: bool = true,
        /// Update below which the fit has converged, metres at a lever of 25 cm (paper: 3 mm).
        pub converged: f64 = 3e-3,
        /// Weight of edge-to-edge pairs from frame to frame (λₑ of eq. 12, here on metric residuals); 0 switches them off.
        pub edge_weight: f64 = 0.0,
        /// Adapt the body's size and shape at the start.
        pub adapt_size: bool = true,
        /// Try the proposals of the part network where body and readings disagree.
        pub rescue: bool = true,
        /// Let feet out of view stand on the floor, or on an estimated one.
        pub standing: bool = true,
        /// Frames over which size and shape are adapted, two seconds at 30 Hz; fewer fix the size on fewer poses.
        pub calibration_frames: u32 = 60,
        /// Fit surface displacements (section 3.3).
        pub displacements: bool = true,
        /// Fit the pose with the displaced surface (as the paper) instead of the body without displacements.
        pub displaced_pose: bool = false,
        /// Frames between updates of the displacements; settled ones wait longer. Smaller costs time.
        pub displacement_interval: u32 = 3,
        /// Uncertainty of a fit in the pose filter, in units of its residual; 0 switches the filter off. At 0.5 / 0.75 / 1 a
        /// subject at rest moves by 0.72 / 0.59 / 0.49 mm from frame to frame, and a slow one is 3.3 / 3.5 / 3.7 mm behind.
        pub calm: f64 = 0.75,
        /// Skip coarse iterations where the prediction explains its frame as well as the last pose did.
        pub skip_coarse: bool = true,
        /// Reuse the last report while the depth image changes only by noise and the subject is at rest or absent; every
        /// sixth frame is processed in any case.
        pub skip_unchanged: bool = true,
        /// Factor on the rest-pose prior: 0 loses 0.3 mm.
        pub rest_weight: f64 = 0.5,
        /// Damping per point (λᵣ of eq. 12): metres² for the root's translation, radians² for angles. Flat from 10⁻⁵ to
        /// 10⁻⁴, 10⁻³ loses 2 mm.
        pub damping: f64 = 1e-4,
        /// Largest depth of a reading, metres: the range of the sensors.
        pub farthest: f32 = 8.0,
        /// Segmentation.
        pub segment: SegmentSettings = SegmentSettings::default(),
        /// Registration.
        pub registration: RegistrationSettings = RegistrationSettings::default(),
        /// Limbs and trunk of the template.
        pub model: ModelSettings = ModelSettings::default(),
        /// Pose fit.
        pub fit: FitSettings = FitSettings::default(),
        /// Size and surface.
        pub shape: ShapeSettings = ShapeSettings::default(),
        /// Assessment.
        pub assess: AssessSettings = AssessSettings::default(),
        /// First pose.
        pub start: StartSettings = StartSettings::default(),
        /// Recovery.
        pub recover: RecoverSettings = RecoverSettings::default(),
        /// Step.
        pub step: StepSettings = StepSettings::default(),
    }
}

impl TrackerConfig {
    /// The paper's form (sections 3.2 to 3.4) for comparison: closest points by kd-tree from the model to the data,
    /// point-to-point, every vertex, edges, the displaced surface; no prediction, pull, skipping or doubt.
    pub fn paper() -> Self {
        let mut paper = Self {
            samples: usize::MAX,
            stride: Some(2),
            point_to_point: 1.0,
            point_to_plane: 0.0,
            both_ways: false,
            edge_weight: 0.3,
            rescue: false,
            standing: false,
            displaced_pose: true,
            calm: 0.0,
            skip_coarse: false,
            skip_unchanged: false,
            ..Self::default()
        };
        paper.fit.track.iterations = 20;
        (paper.fit.track.pull, paper.fit.start.pull) = (0.0, 0.0);
        paper.fit.prediction.longest = 0.0;
        paper.registration.reuse = 0.0;
        paper.shape.surface.settled = 0.0;
        paper.without_doubt()
    }

    /// The same settings with every frame taken for live, however little body and readings agree.
    pub fn without_doubt(mut self) -> Self {
        self.step.most_wrong = f32::MAX;
        (self.assess.belief.sure, self.assess.belief.keep) = (f32::MIN, f32::MIN);
        self
    }
}
