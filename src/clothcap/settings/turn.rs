//! Settings of a capture from one camera.

use super::settings;

settings! {
    /// Settings of a capture from one camera before which the subject turns.
    pub struct TurnConfig {
        /// Iterations of the registration; 0 fuses the tracked poses as they are.
        pub iterations: usize = 14,
        /// Side of a cell whose points are one in the scan, metres.
        pub cell: f32 = 0.006,
        /// Key frames of a whole turn: one every 15°, so that each place is seen by eight within 60° of its normal.
        pub key_frames: usize = 24,
        /// Steps on the first frame before the others: the tracker finds the subject in one and measures its size in the next.
        pub first_steps: u64 = 3,
        /// Time between these steps, nanoseconds.
        pub interval_ns: u64 = 33_000_000,
        /// Points in the comparison of scan and body.
        pub samples: usize = 1500,
        /// Largest gap between the yaws of a whole turn, degrees: a camera sees 60° to either side of the direction it faces.
        pub whole_turn_gap: f64 = 60.0,
        /// Points of a frame.
        pub points: FramePointSettings = FramePointSettings::default(),
        /// Points of all frames.
        pub cloud: FusedCloudSettings = FusedCloudSettings::default(),
        /// Registration.
        pub views: MultiViewSettings = MultiViewSettings::default(),
    }

    /// Settings of the points of one frame.
    pub struct FramePointSettings {
        /// Distance from the tracked body within which a reading is the subject for certain, metres.
        pub certain: f32 = 0.05,
        /// Farthest that cloth and hair stand off the tracked body, metres.
        pub farthest: f32 = 0.16,
        /// Height over a known floor below which readings are floor, metres.
        pub floor: f32 = 0.025,
        /// Largest step of depth between neighbouring pixels of one surface, as a share of the depth.
        pub step: f32 = 0.02,
        /// Half the side of the window of a local plane, pixels: at 2 m, 11 mm to either side.
        pub window: i32 = 3,
        /// Least readings of a local plane.
        pub least: usize = 20,
        /// Pixels beside a step of depth that are left out: sensors mix both surfaces there.
        pub rim: i32 = 2,
        /// Least cosine between normal and ray: at 75° a pixel of error is 15 mm of depth.
        pub grazing: f32 = 0.26,
    }

    /// Settings of the points of all frames in one pose.
    pub struct FusedCloudSettings {
        /// Farthest that a point of the subject lies off the surface, metres.
        pub farthest: f32 = 0.06,
        /// Smallest cosine between the normals of point and surface.
        pub normals: f32 = 0.3,
        /// Weight above which a point of several frames is kept: two grazing readings or half a frontal one.
        pub least_weight: f32 = 0.3,
    }

    /// Settings of the joint registration of all frames.
    pub struct MultiViewSettings {
        /// Points of a frame that are paired in an iteration.
        pub samples: usize = 900,
        /// Difference of yaws below which frames see one place, radians.
        pub overlap: f64 = 1.1,
        /// Smallest cosine between the normals of a pair.
        pub normals: f32 = 0.7,
        /// Longest pair in the first and the last iteration, metres.
        pub reach: [f64; 2] = [0.08, 0.02],
        /// Width of the kernel in the first and the last iteration, metres.
        pub sigma: [f64; 2] = [0.04, 0.01],
        /// Standard deviation of a pair, metres.
        pub deviation: f64 = 0.01,
        /// Number of independent pairs of a frame: neighbours share noise and cloth.
        pub independent: f64 = 300.0,
        /// Distance that parts may move apart at their joint, metres.
        pub joint: f64 = 0.03,
        /// Turn of a part against its parent beyond the tracked pose, radians; legs and heads are round and spin without it.
        pub bend: f64 = 0.5,
        /// Motion of a frame in one iteration, metres and radians.
        pub step: f64 = 0.1,
        /// The same of the reference: its points stay at the place where they were seen.
        pub held: f64 = 1e-4,
    }
}
