//! Settings of the pose fit: schedules, priors, prediction, filter, hidden feet, sleeves without return.

use super::settings;
use serde::{Deserialize, Serialize};

/// Iterations of one fit, and how its kernel and reach shrink.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    /// Most iterations.
    pub iterations: usize,
    /// Shrinking iterations to skip, because the start is good already.
    pub ahead: usize,
    /// Width of the robust kernel at the first iteration and after `anneal`, metres.
    pub sigma: [f64; 2],
    /// Longest pair at the first iteration and after `anneal`, metres.
    pub distance: [f32; 2],
    /// Reach of the pull from unexplained readings while the kernel shrinks, metres; 0 switches it off.
    pub pull: f32,
}

settings! {
    /// Settings of the pose fit.
    pub struct FitSettings {
        /// Distance at which a reading without model point, or a visible point without reading, counts in the cost, metres.
        /// Larger weighs coverage above closeness.
        pub unexplained: f64 = 0.10,
        /// Information below which an angle counts as hidden, per point, m²/rad²; a shank in view has 7·10⁻⁴. Larger lets
        /// the prior act against readings.
        pub hidden: f64 = 1e-5,
        /// Information below which the floor acts on an angle, per point, m²/rad²: a strip of shank at the image rim. Larger
        /// helps a body of wrong size by 1 mm and costs one of right size as much (waist-up sequence, docs/decisions).
        pub barely_seen: f64 = 3e-5,
        /// Prior weight of a hidden leg, per point and squared radian. Larger straightens legs in half view.
        pub hidden_leg_pull: f64 = 2e-5,
        /// Prior weight of a hidden leg whose foot is planted: a straight knee is then no more likely than a bent one.
        pub planted_leg_pull: f64 = 2e-6,
        /// Weight of a detected hand, per point. It decides against arms without a reading (2·10⁻⁶ per squared radian) and
        /// hardly moves seen ones (10⁻³).
        pub hand_weight: f64 = 1e-3,
        /// Weight of a point of an arm inside the trunk, per point, likewise.
        pub clearance_weight: f64 = 1e-3,
        /// Width of the kernel in comparisons of poses, metres. Larger lets outliers decide between poses.
        pub compared_sigma: f64 = 0.05,
        /// Iterations over which kernel and reach shrink; fewer lose fast limbs, more cost time.
        pub anneal: usize = 4,
        /// Weight of the newest displacement in its running mean: four frames' memory. Noise averages out of it, motion does
        /// not.
        pub filter_memory: f64 = 0.25,
        /// Uncertainty of the running mean relative to that of one frame. Smaller follows slow motion closer and trembles
        /// more (0.15 / 0.25: 3.36 / 3.66 mm behind, 0.63 / 0.49 mm from frame to frame).
        pub mean_uncertainty: f64 = 0.25,
        /// Schedule from frame to frame: 4 iterations lose 0.1 mm, 16 gain nothing. The first distance is Table 1's 0.2 m
        /// less the share that prediction saves; the last is three times the residual of a body of wrong size.
        pub track: Schedule = Schedule {
            iterations: 8,
            ahead: 0,
            sigma: [0.08, 0.03],
            distance: [0.12, 0.06],
            pull: 0.35,
        },
        /// Schedule from a rough start.
        pub start: Schedule = Schedule {
            iterations: 20,
            ahead: 0,
            sigma: [0.15, 0.04],
            distance: [0.20, 0.08],
            pull: 0.5,
        },
        /// Weight of edge-to-edge pairs from a rough start: outlines hold limbs that are not near their readings yet.
        pub start_edges: f64 = 0.3,
        /// Factor on the rest-pose prior from a rough start. Smaller lets limbs without readings turn.
        pub start_rest: f64 = 1.0,
        /// Joints where an eye sees them.
        pub seen_joints: SeenJointSettings = SeenJointSettings::default(),
        /// Prediction from the last poses.
        pub prediction: PredictionSettings = PredictionSettings::default(),
        /// Hidden feet on the floor.
        pub standing: StandingSettings = StandingSettings::default(),
        /// Hands beyond sleeves without return.
        pub hands: HandAssignmentSettings = HandAssignmentSettings::default(),
    }

    /// Settings of the pull on joints to where an eye sees them.
    pub struct SeenJointSettings {
        /// Weight of a sure joint, per point: a hand in view has 10⁻³.
        pub weight: f64 = 3e-3,
        /// Error of the eye, metres: joints nearer than that stay where the readings hold them.
        pub uncertainty: f64 = 0.05,
        /// Width of the robust kernel, metres. Larger follows proposals of another limb.
        pub sigma: f64 = 0.3,
        /// Iterations of a fit with the pull.
        pub iterations: usize = 6,
    }

    /// Settings of the prediction.
    pub struct PredictionSettings {
        /// Loss of explained readings, against the last fit, up to which a prediction needs no coarse iterations. Larger
        /// skips in faster motion.
        pub as_good_explained: f64 = 0.015,
        /// Bound on the residual of such a prediction: factor on the last residual, and allowance, metres.
        pub as_good_residual: [f64; 2] = [1.2, 0.3e-3],
        /// Motion per frame above which coarse iterations are never skipped, metres. Unbounded costs 1.3 mm on jacks
        /// (decision 030).
        pub slow: f64 = 0.02,
        /// Motion per frame below which nothing is extrapolated, metres: it is jitter of the fit, which prediction would
        /// sustain.
        pub at_rest: f64 = 3e-3,
        /// Longest extrapolation, in intervals between frames; 0 predicts nothing.
        pub longest: f64 = 3.0,
        /// Damping of the extrapolated motion; a limb that stops overshoots less than with 1.
        pub damping: f64 = 0.9,
    }

    /// Settings of hidden feet on the floor.
    pub struct StandingSettings {
        /// Share of the difference by which the remembered place and direction follow the found ones per frame. A place
        /// follows within ten frames; a direction, which the readings hold less, within sixty.
        pub memory_gain: [f64; 2] = [0.3, 0.05],
        /// Share of the difference by which the greatest height of the hips follows a greater one per frame: noise averages
        /// out. Larger follows noise.
        pub rise: f64 = 0.1,
        /// Depth of a hidden foot below the floor that starts a search for a bent knee, metres: from a straight leg, a
        /// descent leads down first.
        pub below: f64 = 0.03,
        /// Step of the search over knee angles, radians: 2 cm of the foot. Larger leaves feet farther off the floor.
        pub bend_step: f64 = 0.05,
        /// Share of a knee (0 to 1) without readings from which its bend is free to choose. Smaller bends knees in view.
        pub free: f64 = 0.5,
    }

    /// Settings of the assignment of detected hands to arms.
    pub struct HandAssignmentSettings {
        /// Distance up to which a hand is left to the hand residual, metres; a farther one gets an arm pose by inverse
        /// kinematics. Smaller jumps from hand to hand.
        pub followed: f64 = 0.15,
        /// Points tested along a forearm.
        pub forearm_points: usize = 5,
        /// Points of a forearm with a reading from which on it counts as seen.
        pub seen_points: usize = 3,
        /// Points in measured free space from which on an arm does not lead to its hand.
        pub air_points: usize = 2,
        /// Depth difference up to which a reading belongs to the forearm, metres. Larger takes the trunk behind for the
        /// forearm.
        pub forearm_depth: f64 = 0.10,
        /// Arm lengths from the shoulder beyond which a hand belongs to another person. Smaller drops hands of long arms.
        pub stretch: f64 = 1.15,
    }
}
