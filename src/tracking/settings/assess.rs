//! Settings of the assessment: agreement, confidence, person or thing, seat.

use super::settings;

settings! {
    /// Settings of the assessment.
    pub struct AssessSettings {
        /// Width of a seam along outlines that counts for neither side, metres: loose clothes and a body of not quite the
        /// right shape. Larger hides thin limbs.
        pub seam: f32 = 0.035,
        /// Least width of the seam, cells: outlines are that coarse.
        pub least_seam: u16 = 2,
        /// Difference in depth above which body and reading are different surfaces, metres: thick clothes stay below.
        /// Smaller counts thick clothes as wrong.
        pub apart: f32 = 0.10,
        /// Confidence of the joints.
        pub confidence: ConfidenceSettings = ConfidenceSettings::default(),
        /// Person or thing.
        pub belief: BeliefSettings = BeliefSettings::default(),
        /// Facing as the pose does, or the opposite.
        pub facing: FacingSettings = FacingSettings::default(),
        /// Sightings in colour.
        pub sighting: SightingSettings = SightingSettings::default(),
        /// Seated or standing.
        pub seat: SeatSettings = SeatSettings::default(),
        /// Colours of clothes.
        pub clothes: ClothesColorSettings = ClothesColorSettings::default(),
    }

    /// Settings of the colours of clothes.
    pub struct ClothesColorSettings {
        /// Frames between two that are learnt: clothes keep their colours, and each costs 0.2 ms.
        pub interval: u64 = 8,
        /// Weight of a frame in the running mean. Larger learns who stands before the subject.
        pub newest: f32 = 0.2,
        /// Readings of a part below which its colours are noise.
        pub least_readings: f32 = 60.0,
        /// Likeness of the colours below which it is another person.
        pub least_likeness: f32 = 0.5,
    }

    /// Settings of the joints' confidence.
    pub struct ConfidenceSettings {
        /// Readings of a bone at which its confidence is half of the most. Larger doubts thin limbs.
        pub half_sure: f32 = 4.0,
        /// Information below which a degree of freedom is ambiguous, per point, m²/rad²: a twentieth of a shank in view.
        pub ambiguous: f64 = 3e-5,
        /// Factor on the confidence of a joint whose bone mostly gives no return.
        pub no_return_factor: f32 = 0.5,
        /// Factor on the confidence of an ambiguous joint.
        pub ambiguous_factor: f32 = 0.7,
        /// Factor on the confidence of a joint at its limit.
        pub at_limit_factor: f32 = 0.8,
        /// Share of a body part in free space from which its joints say so: outlines of well tracked limbs reach 0.2.
        /// Smaller doubts limbs in loose clothes.
        pub free: f32 = 0.25,
        /// Depth behind the drawn model from which a model point is occluded by it, metres. Larger takes occluded bones for
        /// ones without return.
        pub hidden: f32 = 0.05,
        /// Distance from a limit that counts as at the limit, radians.
        pub at_limit: f64 = 1e-3,
    }

    /// Settings of the sequential test for a person.
    pub struct BeliefSettings {
        /// Difference in depth up to which a reading covers the drawn body, metres: thick clothes stay below. Larger takes a
        /// wall behind for the body.
        pub covered: f32 = 0.10,
        /// Least cells of a head that decide on it; fewer are a head out of the image.
        pub least_head: f32 = 10.0,
        /// Covered share of a head in full view; the seam about it isn't covered. More says nothing: a head within a coat.
        pub full_head: f32 = 0.6,
        /// Covered share that stands for a head out of view.
        pub hidden_head: f32 = 0.45,
        /// Log odds of a start per unit of agreement, covered head and matched points: logistic regression on the starts of
        /// `tryon-bench people` (docs/decisions/047).
        pub start_weights: [f32; 3] = [18.3, 0.8, 7.0],
        /// Log odds of a start at zero.
        pub start_bias: f32 = -10.1,
        /// Log odds of a followed person per unit of agreement, similarity and covered head. Who was found whole may be
        /// hidden in part later: matched points say nothing any more.
        pub weights: [f32; 3] = [15.0, 8.6, 3.7],
        /// Log odds of a followed person at zero.
        pub bias: f32 = -11.4,
        /// Summed log odds from which a subject is a person. Larger starts later; the most likely of 300 starts of things
        /// had −2.5.
        pub sure: f32 = 3.0,
        /// Least log odds that earlier refusals leave: a mannequin that is taken away lets a person stand in its place.
        pub most_doubt: f32 = -6.0,
        /// Most frames in which a start may become sure. Larger follows things for longer.
        pub longest: u32 = 15,
        /// Weight of a new frame in the running log odds of a person. Larger loses one who hides the head for a moment.
        pub newest: f32 = 0.3,
        /// Running log odds below which a subject no longer is a person. Larger loses who bends down.
        pub keep: f32 = -0.5,
    }

    /// Settings of the test of the facing.
    pub struct FacingSettings {
        /// Summed log odds from which the facing is decided: 0.89. Larger starts later.
        pub sure: f32 = 2.1,
        /// Least belief in either facing in one frame: frames alike aren't independent. Smaller lets one frame turn a body.
        pub least: f32 = 0.03,
        /// Share of the sum that stays at the next classified frame. Larger remembers an error for longer.
        pub kept: f32 = 0.8,
        /// Greatest sum. Larger turns a body that is reversed later.
        pub most: f32 = 6.0,
        /// Factor on the cost of a reversed pose up to which the one that faces as the body parts do replaces it: front and
        /// back fit nearly alike. Larger trusts the body parts above the fit.
        pub dearer: f64 = 2.0,
        /// Log odds for the facing in whose direction a body walks, per frame: people walk backwards for a step or two. The
        /// sum of a walk alone, five times this, decides nothing.
        pub walk: f32 = 0.3,
        /// Speed along its front from which a body walks, m/s. Smaller hears of a body that sways.
        pub walking: f32 = 0.4,
    }

    /// Settings of sightings in colour.
    pub struct SightingSettings {
        /// Standard deviation of the yaw, radians: errors on `uva_turn` are 5° in the median and 30° at most. Smaller turns a
        /// body to a shoulder blade.
        pub yaw_deviation: f32 = 0.2,
        /// Belief that is left for each eighth of a turn: who is seen may be somebody else.
        pub least: f32 = 0.008,
        /// Age up to which a sighting counts, seconds: a trunk turns by 30° in it. Smaller drops what a busy machine saw.
        pub oldest: f64 = 0.3,
        /// Level distance of its trunk from the middle of the subject's readings up to which it is of the subject, metres.
        /// Larger hears of who stands beside.
        pub apart: f32 = 0.4,
    }

    /// Settings of the seat.
    pub struct SeatSettings {
        /// Length of the heel behind the ankle, metres: the end of what feet can bear. Larger seats who crouches later.
        pub heel: f64 = 0.05,
        /// Distance of the centre of mass behind the heels from which a seat bears the body, metres. Seated people have 0.15
        /// to 0.25; those who crouch or bend down keep it over their feet, less the errors of tracked legs.
        pub behind: f64 = 0.10,
        /// Cosine to the vertical below which a thigh is raised: more than 45° forward. Larger seats who takes a step.
        pub raised: f64 = 0.7,
        /// Frames in a row after which another posture counts; the first one counts at once. Smaller flickers.
        pub steady: u32 = 5,
    }
}
