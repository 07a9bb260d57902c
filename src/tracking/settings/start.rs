//! Settings of the start: gravity, outline, trunks, proposals of the part network, hypotheses of limbs.

use super::settings;

settings! {
    /// Settings of the start.
    pub struct StartSettings {
        /// Height of a camera whose floor is unknown, metres: the usual mount of a kiosk.
        pub assumed_height: f64 = 1.2,
        /// Certainty of another roll over that of an upright camera from which it is taken: people who bend down or lie are
        /// as certain in one as in the other.
        pub surer: f32 = 1.15,
        /// Half the depth of a chest, metres: readings lie on the front, joints in the middle. A wrong one starts the fit with
        /// wrong pairs.
        pub half_depth: f64 = 0.11,
        /// Horizontal distance from the torso within which the crown is searched, metres; farther out are raised arms.
        pub head_beside: f32 = 0.22,
        /// Height above the floor up to which segmentation takes readings for floor, metres: soles are that much lower.
        pub soles: f64 = 0.02,
        /// Height of a floor above the lowest reading from which it is another floor than the subject's, metres. Smaller
        /// mistakes noise for a step.
        pub afloat: f64 = 0.1,
        /// Share of the largest distance to the silhouette above which a cell is torso.
        pub torso_share: [u32; 2] = [8, 10],
        /// Turns about the vertical to try, radians, for either facing.
        pub yaws: [f64; 3] = [0.0, 0.6, -0.6],
        /// Best trunks of each facing that get arms and a full fit; each costs a quarter of the search. Front and back of a
        /// trunk cost nearly the same, so that they compare only after the full fit.
        pub finalists: [usize; 2] = [2, 1],
        /// Iterations of a trunk's fit: enough to rank yaws. More cost time.
        pub trunk_iterations: usize = 3,
        /// Cost of a fitted proposal above which the search goes on, m² per point: a lost foot costs as little as that.
        pub poor: f64 = 1.5e-4,
        /// Longest pairs by which trunks and final poses compare, metres.
        pub reach: [f32; 2] = [0.15, 0.10],
        /// Ratio of the first two variances above which the body is long enough for its axis to be its lean. Smaller leans
        /// by a raised arm.
        pub elongation: f64 = 4.0,
        /// Cosines between lean and vertical that count, 60° to 15°: arms bend the axis by less, and nobody leans more.
        pub lean_range: [f64; 2] = [0.5, 0.966],
        /// Poses from the part network.
        pub proposals: ProposalSettings = ProposalSettings::default(),
        /// Hypotheses of limbs.
        pub hypotheses: HypothesisSettings = HypothesisSettings::default(),
    }

    /// Settings of the poses from the part network.
    pub struct ProposalSettings {
        /// Longest pair in comparisons of poses that are not fitted yet, metres. Larger blurs the choice, smaller ranks by
        /// few pairs.
        pub reach: f32 = 0.15,
        /// Confidence above which the facing isn't doubted; 1 to 3 of 100 are wrong beyond it.
        pub sure: f32 = 0.95,
        /// Confidence below which the facing may be anything. Larger searches more often.
        pub doubtful: f32 = 0.6,
        /// Confidence of a proposed hand or foot that can contradict a pose.
        pub heavy: f32 = 0.35,
        /// Distance beyond which it does, metres: a third of the proposed hands are wrong, and right ones lie within 10 cm.
        pub far: f64 = 0.25,
        /// Cost of a start for each hand or foot that is far from its proposals, as a share. Larger believes the part network
        /// above the readings.
        pub disputed_cost: f64 = 0.15,
        /// Factor on the cost that a limb elsewhere undercuts. 1 moves limbs by noise.
        pub cheaper: f64 = 0.98,
        /// Turn from a pose of a moment ago beyond which another must be clearly better, radians: nobody turns around
        /// between two frames, while front and back may cost the same.
        pub turn: f64 = 1.75,
        /// Factor on the cost of a pose beyond `turn`.
        pub turn_cost: f64 = 1.5,
        /// Growth of the cost of a pose that faces away with the odds of the facing. Larger trusts the facing above the fit.
        pub against_facing: f64 = 0.2,
        /// Largest distance between the halves of one head, metres.
        pub head: f32 = 0.20,
        /// Least number of trunk joints for an alignment. Fewer leave the turn open.
        pub least_joints: usize = 3,
        /// Limb lengths from its root beyond which a proposed end is not this limb's. Larger reaches for strangers' hands.
        pub stretch: f64 = 1.2,
        /// Least weight of an end that a limb reaches for; a lighter one is noise and the limb keeps its rest pose.
        pub least_end: f32 = 0.1,
    }

    /// Settings of the hypotheses of arms and legs.
    pub struct HypothesisSettings {
        /// Bends of the elbow in the first pass over arms, radians.
        pub bends: [f64; 2] = [0.1, 1.4],
        /// Bends of elbow or knee in the second pass, radians.
        pub more_bends: [f64; 3] = [0.7, 1.4, 2.2],
        /// Turns of the upper arm about its own axis in the second pass, radians.
        pub twists: [f64; 5] = [-1.8, -0.9, 0.0, 0.9, 1.8],
        /// Turns of a thigh about its own axis with the knee at an extremity, radians.
        pub leg_twists: [f64; 3] = [-0.9, 0.0, 0.9],
        /// Cost of a bend, m² per point and squared radian; a hand of ten readings is worth 7·10⁻⁵. Without it a straight
        /// arm, explained by a bent one turned inside out, stays so.
        pub bend_cost: f64 = 1e-5,
        /// Cost of a twist, m² per point and squared radian, likewise.
        pub twist_cost: f64 = 3e-5,
        /// Upper arms that enter the second pass. Each costs 15 evaluations.
        pub arm_finalists: usize = 3,
        /// Limb lengths from its root beyond which an extremity is not this limb's. Larger reaches for the other hand.
        pub stretch: f64 = 1.15,
        /// Depth of a joint below its extremity on the skin, metres.
        pub behind: f64 = 0.02,
        /// Distance of a hinge from its root, in lengths of the upper bone, between which a point may be the hinge.
        pub hinge_range: [f64; 2] = [0.5, 1.4],
        /// Longest pair in comparisons of hypotheses, metres.
        pub reach: f32 = 0.15,
    }
}
