//! Settings of synthetic scans.

use tryon_geometry::settings;

settings! {
    /// Cloth, cameras and light of synthetic scans. Colours are sRGB, 0 to 255.
    pub struct ScanSettings {
        /// Least rate of the simulation (1/s).
        pub simulation_rate: f64 = 60.0,
        /// Steps at the first pose before the first scan: dressed cloth still sways.
        pub settling_steps: usize = 12,
        /// Smallest garment that follows the bones (m): smaller parts are buttons and are left out.
        pub smallest: f32 = 0.08,
        /// Least distance of such a garment from the skin or the one below it, at rest (m).
        pub skinned_gap: f32 = 3e-3,
        /// Depth by which a layer is drawn below the one over it (m): cloth that reaches into the layer below still hides it.
        pub layer_inset: f32 = 0.01,
        /// Distance within which cloth counts as over a vertex (m): a little more than the edges of cloth.
        pub cover_radius: f32 = 0.025,
        /// Largest height of a vertex over the cloth that should cover it (m).
        pub poke: f32 = 0.02,
        /// Near plane of all cameras (m).
        pub near: f32 = 0.3,
        /// Heights of the scanner's rings of cameras (m): below the knees, chest, above the head.
        pub ring_heights: [f32; 3] = [0.4, 1.25, 2.6],
        /// Distance of these cameras from the vertical through the subject (m).
        pub ring_distance: f32 = 2.2,
        /// Height of the point that they aim at (m).
        pub ring_aim: f32 = 1.0,
        /// Depth within which a point is on the visible surface (m).
        pub tolerance: f32 = 0.003,
        /// Cosine of the angle between normal and ray below which scanners lose the surface.
        pub min_cosine: f32 = 0.2,
        /// Candidate points drawn at once, as a multiple of the points still missing.
        pub oversampling: f64 = 1.3,
        /// Difference of depths between neighbouring pixels from which they lie at a silhouette (m).
        pub silhouette: f32 = 0.06,
        /// Depth to the background beside a silhouette that has none (m).
        pub background: f32 = 0.4,
        /// Distance that a flying pixel needs to be no point of the subject (m).
        pub flying_gap: f32 = 0.02,
        /// Height about which the poses of cameras err: the middle of the subject (m).
        pub middle: f32 = 0.9,
        /// Half the side of the floor and of the wall (m).
        pub room: f32 = 4.0,
        /// Distance of the wall behind the subject (m).
        pub wall: f32 = -1.6,
        /// Colours of floor and wall.
        pub room_colors: [[u8; 3]; 2] = [[150, 112, 76], [196, 194, 188]],
        /// Step of the hue from garment to garment: golden ratio, so that hues stay apart.
        pub hue_step: f32 = 0.618,
        /// Ratio of brightness between neighbouring garments of [`ScanPalette::LowContrast`](super::ScanPalette).
        pub contrast: f32 = 1.06,
        /// Directions of the light and of a weaker one, world; y is up.
        pub lights: [[f32; 3]; 2] = [[0.35, 0.75, 0.55], [-0.6, 0.3, -0.7]],
        /// Shares of ambient light, light and weaker light.
        pub shade: [f32; 3] = [0.50, 0.42, 0.20],
        /// Change of red, green and blue in a light that is wholly warm.
        pub warmth: [f32; 3] = [0.5, 0.0, -0.5],
        /// Brightness of a place that no camera sees, over that of an open one.
        pub occluded: f32 = 0.55,
    }
}
