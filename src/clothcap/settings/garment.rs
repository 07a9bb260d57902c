//! Settings of the garments: topology, parts, body under the cloth, penetration.

use super::align::{FitStage, SurfaceFitSettings};
use super::settings;

settings! {
    /// Settings of templates whose legs are joined in a tube.
    pub struct TopologySettings {
        /// Edges across the tube, metres.
        pub spacing: f32 = 0.02,
        /// Height below the crotch of the faces between the legs that the removal starts at, metres.
        pub inner: f32 = 0.15,
        /// Depth of the middle of the body below its front- or backmost points at the height where the lines part, metres.
        pub hollow: f32 = 0.012,
        /// Height over the lowest vertex of the shin at which lines end, metres.
        pub end: f32 = 0.03,
        /// Way below the apex on which a line comes to the middle of its leg, metres.
        pub spread: f32 = 0.12,
        /// Sideways distance from the line wanted that doubles the cost of an edge, metres.
        pub straight: f32 = 0.015,
        /// Half the height of the band whose mean is the middle of a leg, metres.
        pub band: f32 = 0.03,
        /// Half the width of the middle of the body, metres.
        pub middle: f32 = 0.008,
    }

    /// Settings of the cut of a template into parts, and of their trimming into cloth.
    pub struct PartCutSettings {
        /// Least number of faces of a piece; smaller ones are errors of the labels.
        pub least_faces: usize = 40,
        /// Least number of vertices of a ring that gets a name; smaller ones are holes.
        pub least_ring: usize = 12,
        /// Least share of a ring's vertices on one side of the body, or in a region, that names it after them.
        pub one_side: f64 = 0.8,
        /// Rings of vertices that are taken off and put on again: tabs of twice as many rings (1 cm each) are cut off.
        pub opening: usize = 2,
        /// Divisor of a part's faces below whose quotient a piece is no cloth of its own.
        pub least_share: usize = 20,
        /// Rounds of smoothing along the hems; boundaries of labels run along edges of the template, in teeth of an edge.
        pub hem_rounds: usize = 12,
        /// Rings that follow the smoothed hems.
        pub near_hem: usize = 3,
        /// Rounds of their smoothing.
        pub near_hem_rounds: usize = 6,
        /// Most rounds of smoothing around self-intersections.
        pub clearing_rounds: usize = 60,
        /// Rings around a self-intersection that are smoothed.
        pub clearing_rings: usize = 2,
    }

    /// Weights of a part's energy; lengths whose squares weigh terms against data by area.
    pub struct PartFitConfig {
        /// Width of the Geman–McClure kernel, metres.
        pub sigma: f64 = 0.03,
        /// Coupling length, metres (w_c of eq. 15).
        pub coupling: f64 = 0.012,
        /// Length of the Laplacian, metres (w_s).
        pub laplacian: f64 = 0.006,
        /// Weight of a boundary point beside a surface point (w_b). The paper's is 0.02 of the data's, per point.
        pub boundary: f64 = 2.0,
        /// Weight of boundary smoothness beside a surface point (w_a).
        pub smoothness: f64 = 2.0,
        /// Pull to the start beside the data's: settles what no term determines.
        pub anchor: f64 = 1e-4,
        /// Smallest cosine between normals across a boundary: edges of a cloud also join an arm and the torso behind it.
        pub beside: f32 = 0.7,
        /// Distance up to which a boundary point of the scan belongs to a ring, metres.
        pub ring_reach: f32 = 0.06,
        /// Most iterations.
        pub iterations: usize = 8,
        /// Most scan points in an iteration.
        pub points: usize = 15_000,
        /// Pairs and solves.
        pub fit: SurfaceFitSettings = SurfaceFitSettings::default(),
    }

    /// Settings of the body under the cloth (section 5.4). Its pose has little freedom: loose cloth does not hold limbs.
    pub struct UndressSettings {
        /// Scan points in the fit of the shape.
        pub samples: usize = 6000,
        /// Stages of the shape's fit.
        pub stages: [FitStage; 2] = [
            FitStage::shaped(0.05, 10).with_freedom(0.1),
            FitStage::shaped(0.03, 12).with_freedom(0.1),
        ],
        /// Mean robust distance of a scan from the body model above which it says nothing of the subject's shape, metres.
        pub misaligned: f64 = 0.03,
        /// Scan points in the fit of a later pose.
        pub later_samples: usize = 3000,
        /// Stage of a later pose.
        pub later: FitStage = FitStage::posed(0.03, 8).with_freedom(0.1),
        /// Distance that the body keeps below cloth, metres.
        pub margin: f32 = 0.003,
        /// Coupling length to the minimally clothed shape, metres.
        pub coupling: f64 = 0.03,
        /// Width of the kernel on skin, metres.
        pub sigma: f64 = 0.02,
        /// Iterations of the free surface.
        pub iterations: usize = 6,
        /// Most scan points in an iteration.
        pub points: usize = 30_000,
        /// Pull to the minimally clothed shape beside the data's.
        pub anchor: f64 = 0.02,
        /// Weight of a garment vertex that the body comes through, beside its area.
        pub push: f64 = 4.0,
        /// Pairs and solves: all vertices in all iterations.
        pub fit: SurfaceFitSettings = SurfaceFitSettings {
            still: 0.0,
            converged: 0.0,
            ..SurfaceFitSettings::default()
        },
    }

    /// Settings of garments moved out of bodies.
    pub struct PenetrationSettings {
        /// Distance that cloth keeps from the skin, metres.
        pub margin: f32 = 0.003,
        /// Distance below which a vertex is pushed, metres. Between the two lies what smoothing gives back.
        pub least: f32 = 0.001,
        /// Rounds of pushing and smoothing.
        pub rounds: usize = 5,
        /// Rounds of pushing alone.
        pub projections: usize = 10,
        /// Weight of a pushed vertex beside that of an edge.
        pub push: f64 = 4.0,
        /// Pull of each vertex to its place without contact.
        pub anchor: f64 = 0.05,
        /// Shares of the way to a neighbour outside that a vertex in a fold of the skin tries.
        pub ways: [f32; 4] = [0.25, 0.5, 0.75, 1.0],
        /// Solves: all vertices in all rounds.
        pub fit: SurfaceFitSettings = SurfaceFitSettings {
            still: 0.0,
            converged: 0.0,
            ..SurfaceFitSettings::default()
        },
    }
}
