//! Settings of scans made ready: frame, floor, neighbours in clouds.

use super::settings;

settings! {
    /// Settings of a scan made ready.
    pub struct ScanSettings {
        /// Least number of points of a person. Fewer leave whole limbs without one.
        pub least_points: usize = 500,
        /// Heights of people with raised arms or without feet, metres.
        pub heights: [f64; 2] = [0.7, 2.6],
        /// Range of the largest extent of a scan, metres: half a person, and one with a piece of the room.
        pub usable: [f64; 2] = [0.3, 20.0],
        /// Share of points left out at each end of an extent: strays.
        pub strays: f64 = 0.005,
        /// Share of the largest extent from which an axis may be the upright one; spread arms are as wide as a person is tall.
        pub upright: f64 = 0.7,
        /// Least cosine between the floor's normal and a given upright axis.
        pub level: f64 = 0.98,
        /// Largest distance between the points of two scans that are the same but for noise, metres.
        pub unchanged: f32 = 1e-4,
        /// Floor.
        pub floor: ScanFloorSettings = ScanFloorSettings::default(),
        /// Neighbours in clouds.
        pub cloud: CloudSettings = CloudSettings::default(),
    }

    /// Settings of the floor below a person.
    pub struct ScanFloorSettings {
        /// Points that planes are searched among.
        pub samples: usize = 2000,
        /// Planes that are tried; three points lie on a floor of a tenth of all once in 1000.
        pub trials: usize = 6000,
        /// Distance of a floor's points from its plane, as a share of the cloud's extent: 13 mm for a person.
        pub thickness: f32 = 0.007,
        /// Largest distance of a floor's points from its plane beside the thickness: those of several cameras disagree.
        pub most_spread: f32 = 2.5,
        /// Least share of the points that make a floor.
        pub least_share: f64 = 0.08,
        /// Most of the other points that lie below it, as a share of all.
        pub most_below: f64 = 0.01,
        /// Least height of what stands on it beside its width: a person's back is a plane too, with nothing standing on it.
        pub upright: f32 = 0.7,
        /// Least width of a floor beside the height of what stands on it: soles are none.
        pub least_width: f32 = 0.25,
        /// Share of points left out at each end of an extent: strays.
        pub strays: f64 = 0.01,
        /// Height of feet and of the rests of floors, metres.
        pub low: f32 = 0.05,
        /// Height of legs, metres.
        pub legs: f32 = 0.30,
        /// Farthest that feet and heels reach from legs, metres.
        pub foot: f32 = 0.22,
        /// Side of a cell in which that is searched, metres.
        pub foot_cell: f32 = 0.02,
    }

    /// Settings of neighbours, normals and strays of a cloud. Lengths are multiples of the mean distance between points.
    pub struct CloudSettings {
        /// Neighbours of a point in the plane of its normal: the fewest that make a plane.
        pub neighbours: [usize; 5] = [12, 24, 48, 96, 192],
        /// Radius of the search of the fewest.
        pub reach: f32 = 3.0,
        /// Variance across a plane beside the smaller one along it, up to which points make one.
        pub flat: f64 = 0.1,
        /// Neighbours of a point that share an edge with it.
        pub edges: usize = 6,
        /// Largest distance of these.
        pub edge: f32 = 2.0,
        /// Distance across which points are of one piece.
        pub link: f32 = 3.0,
        /// Largest share of the points of a piece that is a stray.
        pub stray: f64 = 1e-3,
        /// Directions from which points are seen.
        pub directions: usize = 40,
        /// Side of a cell of the pictures of these: closes gaps.
        pub seen_cell: f32 = 2.5,
        /// Depth in a cell up to which points are seen, metres: cloth against the light, and noise.
        pub seen_depth: f32 = 0.03,
        /// Least sum of the cosines to the directions from which a point is seen: one, straight.
        pub least_facing: f32 = 1.0,
        /// Share of the points from which signs are told.
        pub most_known: f64 = 0.8,
    }
}
