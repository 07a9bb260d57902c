//! Settings of an inspection: measured regions, the person who must fit, limits of findings.

use tryon_geometry::settings;

settings! {
    /// Settings of the measurements.
    pub struct InspectionSettings {
        /// Depth images kept for the search of the floor. More cost memory, fewer miss a floor that people hide for a while.
        pub kept_images: usize = 5,
        /// Time between kept images (s).
        pub keep_every: f64 = 1.0,
        /// Farthest reading used (m): beyond it the noise of every camera here exceeds a hand's width.
        pub farthest: f32 = 8.0,
        /// Depth below which a reading is too near (m): most cameras read nothing reliable nearer.
        pub too_near: f32 = 0.5,
        /// Shares of the readings that are nearer than the nearest and the farthest surface. The extremes themselves are
        /// stray pixels.
        pub range_shares: [f64; 2] = [0.01, 0.99],
        /// Step of the camera's clock against the time of arrival that counts as a jump (s): more than buffers of any driver
        /// hold.
        pub clock_step: f64 = 0.25,
        /// Share of the readings in the picture's middle that are nearer than the back of the room.
        pub room_share: f64 = 0.9,
        /// Height assumed where no floor is found (m): a camera on a shelf.
        pub assumed_height: f64 = 1.0,
    }

    /// Person who must fit into the picture.
    pub struct PersonSize {
        /// Height with shoes and hair (m): 95 % of men are smaller (ISO 7250-2, 1.88 m barefoot in Europe).
        pub height: f64 = 1.95,
        /// Width with the arms held out a little (m).
        pub width: f64 = 1.2,
        /// Largest distance (m): beyond it noise exceeds 4 cm and a hand has few pixels.
        pub farthest: f64 = 4.5,
    }

    /// Limits of findings; pairs are the limits of good and of usable.
    pub struct FindingLimits {
        /// Least rate (1/s). Tracking follows walking people from 12 a second.
        pub rate: [f64; 2] = [24.0, 12.0],
        /// Jitter of the interval between frames, share of the interval.
        pub jitter: [f64; 2] = [0.1, 0.35],
        /// Share of lost frames.
        pub lost: [f64; 2] = [0.02, 0.1],
        /// Share of the middle without depth. People in dark clothes have some.
        pub holes: [f64; 2] = [0.15, 0.4],
        /// Share of the lower part without depth, and how much it exceeds that of the middle.
        pub floor_holes: [f64; 2] = [0.35, 0.7],
        /// Least excess of the holes in the lower part over those in the middle that are the floor's.
        pub floor_excess: f64 = 0.1,
        /// Share of the whole picture without depth from which nothing else can be judged. A round image in a square picture has
        /// a fifth.
        pub blind: f64 = 0.6,
        /// Share of washed-out colour in holes that tells sunlight, and its ratio to that elsewhere.
        pub washed_out: [f64; 2] = [0.25, 3.0],
        /// Mean brightness of holes in the lower part that are a dark floor, of 255.
        pub dark: f64 = 70.0,
        /// Noise over that of the sensor's model.
        pub noise: [f64; 2] = [1.6, 3.0],
        /// Share of readings that are too near.
        pub too_near: [f64; 2] = [0.02, 0.2],
        /// Share of the picture covered by things nearer than a whole person fits.
        pub in_the_way: [f64; 2] = [0.08, 0.3],
        /// Tilt of the camera to either side (degrees): beyond the second the floor search fails.
        pub tilt: [f64; 2] = [25.0, 38.0],
        /// Roll of the camera (degrees): beyond the second the floor search fails.
        pub roll: [f64; 2] = [6.0, 18.0],
        /// Space between the distance from which a person fits and the back of the room (m): to turn around in.
        pub space: [f64; 2] = [0.5, 0.1],
    }
}
