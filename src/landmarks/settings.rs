//! Settings of finding landmarks and of lifting them.

use tryon_geometry::settings;

settings! {
    /// Settings of the search for a person in colour. The first three are MediaPipe's.
    pub struct LandmarkSettings {
        /// Least probability of a person in the detector. Smaller finds people in more empty rooms.
        pub detection: f32 = 0.5,
        /// Overlap (intersection over union) above which two boxes are the same person's.
        pub same_person: f32 = 0.3,
        /// Least probability of a person in the region, below which the region is given up.
        pub presence: f32 = 0.5,
        /// Quarter turns of the picture that one frame tries while nobody is followed, 1 to 4, each one run of the detector.
        /// Fewer cost less and find people in rolled pictures some frames later.
        pub turns: usize = 4,
    }

    /// Settings of lifting landmarks by depth.
    pub struct LandmarkLiftSettings {
        /// Least probability that a landmark is visible, and that it is in the picture, for its depth to be taken.
        pub visible: f32 = 0.5,
        /// Half side of the square around a landmark from which depth is read (m). Larger bridges more holes and reaches
        /// over the edges of wrists.
        pub window: f32 = 0.015,
        /// Least share of the square's readings that must lie at the joint.
        pub share: f32 = 0.2,
        /// Least and largest size of a person over that of a grown-up; others are pictures on cups and walls, and have no joints.
        pub sizes: [f64; 2] = [0.4, 1.5],
        /// Depth by which readings may be nearer than the network expects them (m); nearer ones hide the joint. On `uva_turn`
        /// a shoulder behind the trunk lies 0.19 to 0.35 before its place, a seen one less than 0.15.
        pub nearer: f64 = 0.15,
        /// Depth by which readings may be farther (m); farther ones are the background beside the person.
        pub farther: f64 = 0.25,
    }
}
