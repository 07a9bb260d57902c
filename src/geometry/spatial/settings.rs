//! Settings of an organised cloud.

use crate::settings;

settings! {
    /// Settings of the cells of an [`OrganisedCloud`](super::OrganisedCloud).
    pub struct CellSettings {
        /// A focal length of this many cells keeps about 1,500 cells on a person who fills the height of the image; twice as
        /// many changed the joint error by less than 0.3 mm and doubled the time (docs/benchmarks/tracking.md).
        pub cells_per_focal_length: f64 = 131.25,
        /// Readings of one cell belong together when they are within this distance (metres) plus `same_surface_slope` × z.
        pub same_surface: f32 = 0.02,
        /// Slope of that distance over the depth; depth noise of structured light grows to a few per cent of the distance at 4 m.
        pub same_surface_slope: f32 = 0.006,
        /// Neighbouring cells farther apart in depth than this (metres) lie on different surfaces.
        pub discontinuity: f32 = 0.06,
        /// A cell whose averaged depth is this far from its first reading (metres) was labelled by a corrupt pixel
        /// and is given up.
        pub misled: f32 = 0.25,
    }
}
