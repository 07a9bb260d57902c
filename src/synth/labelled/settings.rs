//! Settings of labelled frames.

use tryon_geometry::settings;

settings! {
    /// Distributions of people, poses, cameras and losses. Pairs are ranges, shares are of frames.
    pub struct LabelledSettings {
        /// Statures (m).
        pub statures: [f64; 2] = [1.0, 2.05],
        /// Spread of the coefficients (standard deviations): wider than the population.
        pub spread: f64 = 1.3,
        /// Share of people with bumps.
        pub clothed: f64 = 0.6,
        /// Greatest height of bumps (m): a loose jacket, long hair.
        pub bumps: f32 = 0.035,
        /// Wavelengths of bumps (rad/m).
        pub waves: [f32; 2] = [4.0, 14.0],
        /// Widths of clothes over the skin (m): trunk, arms, legs.
        pub widths: [f32; 3] = [0.05, 0.025, 0.035],
        /// Share of poses from the routine.
        pub routine: f64 = 0.45,
        /// Share of key poses with both arms alike.
        pub alike: f64 = 0.45,
        /// Share of key poses with both arms to one side: a club, a bat, a bag that both hands hold.
        pub parallel: f64 = 0.08,
        /// Share of key poses part of the way to another.
        pub between: f64 = 0.4,
        /// Spread of the directions of arms, legs, and of the angles of chest and head (degrees).
        pub noise: [f64; 4] = [14.0, 8.0, 6.0, 12.0],
        /// Distance of elbows and wrists from the axis of the trunk below which an arm is inside it (m).
        pub inside: f64 = 0.12,
        /// Share of frames from the waist up.
        pub busts: f64 = 0.25,
        /// Distances of whole bodies and of busts (m).
        pub distances: [[f64; 2]; 2] = [[1.2, 4.5], [0.8, 2.0]],
        /// Heights of the camera (m).
        pub heights: [f64; 2] = [0.6, 2.2],
        /// Largest tilt (degrees).
        pub tilt: f64 = 25.0,
        /// Largest roll (degrees).
        pub roll: f64 = 5.0,
        /// Share of upright mounted cameras.
        pub portrait: f64 = 0.2,
        /// Largest part of the half width of the image by which a person stands beside its middle.
        pub aside: f64 = 0.5,
        /// Share of images of coarse depth.
        pub quantised: f64 = 0.3,
        /// Their steps (mm).
        pub quanta: [u16; 2] = [10, 20],
        /// Farthest reading (m).
        pub farthest: f32 = 8.0,
        /// Fewest cells of a frame.
        pub least_cells: usize = 150,
        /// Tries for a frame that shows enough of the person.
        pub tries: usize = 8,
        /// Largest difference between a cell's depth and the surface that labels it (m).
        pub same_surface: f32 = 0.06,
        /// Share of frames whose lowest cells are lost to the floor.
        pub floor_loss: f64 = 0.5,
        /// Height up to which they are (m).
        pub floor_height: [f64; 2] = [0.02, 0.06],
        /// Share of frames that lose cells at the outline, and of those cells.
        pub outline_loss: [f64; 2] = [0.3, 0.5],
        /// Share of frames in which furniture hides everything on one side of a border.
        pub hidden: f64 = 0.15,
        /// Share of horizontal borders.
        pub tables: f64 = 0.6,
        /// Heights of a horizontal border (a table, a counter), share of the way from pelvis to head.
        pub table_heights: [f64; 2] = [-0.3, 0.4],
        /// Distances of a vertical border from the pelvis (m).
        pub border_distances: [f64; 2] = [0.02, 0.3],
        /// Share of people in a skirt, and with long hair.
        pub skirts: f64 = 0.12,
        /// See `skirts`.
        pub long_hair: f64 = 0.2,
        /// Share of frames with furniture, floor or something held about the person.
        pub surrounded: f64 = 0.45,
        /// Share of those whose things segmentation takes for the person.
        pub joined: f64 = 0.6,
        /// Distance from the person's axis within which it does (m).
        pub joined_reach: [f32; 2] = [0.3, 0.9],
        /// Share of frames that show things and nobody.
        pub deserted: f64 = 0.08,
        /// Error of the direction of gravity, where it isn't known from a floor (degrees, standard deviation).
        pub gravity_error: f32 = 4.0,
    }
}
