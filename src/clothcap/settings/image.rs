//! Settings of textures and pictures.

use super::settings;

settings! {
    /// Settings of textures.
    pub struct TextureSettings {
        /// Side of a texel over the distance between the scan's colours. Smaller ones make larger images.
        pub texel: f32 = 0.5,
        /// Least and largest side of a texel, metres.
        pub texels: [f32; 2] = [0.001, 0.004],
        /// Brightness of a garment without a coloured point, 0 to 255.
        pub grey: f32 = 160.0,
        /// Painting.
        pub paint: PaintSettings = PaintSettings::default(),
    }

    /// Settings of charts and of their atlas.
    pub struct ChartSettings {
        /// Gain of an axis for each neighbour that has it, beside the cosine to the normal. Larger: fewer charts, distorted more.
        pub neighbour: f32 = 0.3,
        /// Least cosine between a face and the axis that it takes from its neighbours: stretches by 3 at most.
        pub steepest: f32 = 0.33,
        /// Rounds over all faces.
        pub rounds: usize = 8,
        /// Number of faces below which a chart is given to its neighbours where their axes allow it.
        pub least_faces: usize = 24,
        /// Side of a cell of the search for overlaps, metres.
        pub cell: f32 = 0.016,
        /// Side of a texel from which no larger one is tried, metres.
        pub largest_texel: f32 = 1.0,
        /// Halvings of the interval in which the size of a texel is searched.
        pub bisections: usize = 20,
    }

    /// Settings of texels painted with the points of a scan.
    pub struct PaintSettings {
        /// Smallest cosine between the normals of a point and of the garment.
        pub normals: f32 = 0.2,
        /// Largest distance of a point from the garment that it colours, metres.
        pub near: f32 = 0.03,
        /// Width of the kernel over the distance between points: larger values blur prints, smaller ones show single points.
        pub sigma: f32 = 0.5,
        /// Reach of the kernel over its width.
        pub reach: f32 = 3.0,
        /// Sum of the kernel's weights from which a texel counts as seen: a point at a distance of 2.4 widths.
        pub seen: f32 = 0.056,
        /// Weight of the interpolated colours of the vertices beside the points': joins what was seen to what is filled in.
        pub filled: f32 = 0.005,
    }

    /// Settings of the stages' pictures.
    pub struct PictureSettings {
        /// Scale, pixels a metre.
        pub scale: f32 = 300.0,
        /// Width and height of a panel, metres.
        pub panel: [f32; 2] = [1.3, 2.0],
        /// Height of the panel's lower rim over the lowest vertex, metres.
        pub below: f32 = 0.06,
        /// Background, sRGB.
        pub paper: [u8; 3] = [245; 3],
        /// Direction of the light in the picture: from the left above, behind the viewer.
        pub light: [f32; 3] = [-0.4, 0.6, 0.7],
        /// Brightness without direct light.
        pub ambient: f32 = 0.35,
        /// Side of a point of a cloud, pixels.
        pub dot: i32 = 2,
        /// Directions of a stage about the vertical from the body's front, radians: front, side, back.
        pub views: [f32; 3] = [0.0, 1.2, std::f32::consts::PI],
    }
}
