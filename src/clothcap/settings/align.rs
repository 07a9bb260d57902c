//! Settings of the single-mesh alignment: start, body model, arms, legs, free surface.

use super::settings;
use serde::{Deserialize, Serialize};
use tryon_geometry::linear::{CgAccuracy, CgSettings};
use tryon_geometry::par::Par;

/// Unknowns, kernel and length of one stage of the body model's fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitStage {
    /// Width of the Geman–McClure kernel, metres.
    pub sigma: f64,
    /// Most iterations.
    pub iterations: usize,
    /// Fit shape coefficients and bone scales too.
    pub shape: bool,
    /// Factor on the standard deviations of joint angles from those of the start.
    pub freedom: f64,
}

impl FitStage {
    /// Stage of the pose alone.
    pub const fn posed(sigma: f64, iterations: usize) -> Self {
        Self {
            sigma,
            iterations,
            shape: false,
            freedom: 1.0,
        }
    }

    /// Stage of pose and shape.
    pub const fn shaped(sigma: f64, iterations: usize) -> Self {
        Self {
            shape: true,
            ..Self::posed(sigma, iterations)
        }
    }

    /// The same stage with another freedom of the pose.
    pub const fn with_freedom(self, freedom: f64) -> Self {
        Self { freedom, ..self }
    }
}

/// Kernel and coupling of one stage of the free surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceStage {
    /// Coupling length, metres: shorter displacements are suppressed. Its square is w_c of eq. 3 for data weighted by area.
    pub coupling: f64,
    /// Width of the Geman–McClure kernel, metres.
    pub sigma: f64,
    /// Most iterations.
    pub iterations: usize,
    /// Most scan points in an iteration; the others are matched in the end.
    pub points: usize,
}

impl SurfaceStage {
    const fn new(coupling: f64, sigma: f64, iterations: usize, points: usize) -> Self {
        Self {
            coupling,
            sigma,
            iterations,
            points,
        }
    }
}

settings! {
    /// Settings of a single-mesh alignment.
    pub struct AlignmentSettings {
        /// Search of the person.
        pub search: PersonSearchSettings = PersonSearchSettings::default(),
        /// Body model.
        pub model: ModelFitSettings = ModelFitSettings::default(),
        /// Search of lost arms.
        pub arms: ArmSearchSettings = ArmSearchSettings::default(),
        /// Course of the cloth around the legs.
        pub legs: LegSettings = LegSettings::default(),
        /// Free surface.
        pub surface: FreeSurfaceSettings = FreeSurfaceSettings::default(),
        /// Scan points in a fit of the model to the first scan. More cost time.
        pub samples: usize = 6000,
        /// Scan points in a fit of a later pose.
        pub later_samples: usize = 3000,
        /// Stages after a start.
        pub fine: [FitStage; 3] = [
            FitStage::shaped(0.10, 10),
            FitStage::shaped(0.05, 12),
            FitStage::shaped(0.03, 12),
        ],
        /// Stages of a later pose.
        pub later: [FitStage; 2] = [FitStage::posed(0.08, 8), FitStage::posed(0.03, 10)],
        /// Mean robust distance in the last pose below which no turn is tried, metres: a back is farther from a front.
        pub facing: f64 = 0.02,
        /// Mean robust distance above which a later pose is lost and the person is searched anew, metres.
        pub lost: f64 = 0.03,
    }

    /// Settings of the search of a person in virtual depth cameras.
    pub struct PersonSearchSettings {
        /// Steps of the tracker on one view.
        pub steps: u64 = 3,
        /// Time from one step to the next, nanoseconds.
        pub interval_ns: u64 = 33_000_000,
        /// Scan points in the comparison of starts.
        pub samples: usize = 1500,
        /// Stages of the fits that are compared.
        pub stages: [FitStage; 2] = [FitStage::posed(0.15, 6), FitStage::shaped(0.08, 6)],
        /// Mean robust distance above which a start explains no person, metres. Right starts had 16 to 27 mm.
        pub worst: f64 = 0.05,
        /// Mean robust distance below which a unit and up axis is taken without trying others, metres.
        pub certain: f64 = 0.035,
        /// Component of the up axis below whose negative a frame is upside down.
        pub upright: f64 = 0.5,
        /// Factor on the error of frames that stand on their head: few files do, and raised arms look like legs.
        pub downward: f64 = 1.5,
        /// Share of the scan's points left out at each end of an axis: strays.
        pub strays: f64 = 0.002,
        /// Nearest point drawn, metres.
        pub nearest: f32 = 0.1,
        /// Faces a point, two on a whole surface, below which a scan is drawn as a cloud.
        pub torn: f64 = 1.4,
        /// Side of a drawn point of a cloud as a multiple of the distance between points: closes the gaps.
        pub splat: f32 = 2.5,
    }

    /// Settings of the body model's fit.
    pub struct ModelFitSettings {
        /// Standard deviation of a scan point from the body, metres.
        pub deviation: f64 = 0.012,
        /// Number of independent points: neighbours share the cloth between. More weigh data above priors.
        pub independent: f64 = 800.0,
        /// Weight of tangential beside normal distances: limbs move along themselves only by it.
        pub tangential: f64 = 0.05,
        /// Smallest cosine between normals of a pair, for oriented scans.
        pub normals: f32 = 0.3,
        /// Thickness of a fabric with the air below it where it lies on the body, metres.
        pub thickness: f64 = 0.003,
        /// Weight of cloth outside the body beside cloth inside of it: garments hang away from the body, never into it.
        pub loose: f64 = 0.06,
        /// The same before the garments are known. At 1 a body slides down until it fills wide trousers.
        pub unknown: f64 = 0.3,
        /// Weight of heads, hands and feet, which mostly are bare, beside the rest (w of eq. 5).
        pub bare: f64 = 2.0,
        /// Width of the kernel in comparisons of bodies, metres.
        pub compared_sigma: f64 = 0.10,
        /// Step of the difference quotient of a shape coefficient and of a bone's scale.
        pub shape_step: f64 = 0.02,
        /// Motion of the surface by a unit of a shape coefficient, in the test of convergence, metres.
        pub shape_lever: f64 = 0.02,
        /// Motion of the surface by a radian, in the same test, metres.
        pub lever: f64 = 0.25,
        /// Motion below which a stage ends, metres.
        pub converged: f64 = 1e-4,
        /// Share of its diagonal added to the normal matrix.
        pub damping: f64 = 1e-3,
        /// Addition to the diagonal beside it, for unknowns that no point determines.
        pub least_damping: f64 = 1e-6,
        /// Standard deviation of the joint angles of spine, collars, hands and feet from those of the start, radians.
        pub stiff_angles: f64 = 0.35,
        /// The same of the other joints, radians.
        pub free_angles: f64 = 1.2,
        /// Standard deviation of neck and head from the rest pose, radians; without it, heads of one-sided scans turn by 90°.
        pub straight_head: f64 = 0.12,
        /// The same of the spine, radians.
        pub straight_spine: f64 = 0.35,
        /// Standard deviation of the scale of a bone.
        pub scale_deviation: f64 = 0.05,
        /// Least and largest scale of a bone.
        pub scales: [f64; 2] = [0.7, 1.4],
        /// Largest shape coefficient, standard deviations.
        pub most_coefficient: f64 = 4.0,
    }

    /// Settings of the search of arms that a fit has lost.
    pub struct ArmSearchSettings {
        /// Most scan points that arms are compared with.
        pub points: usize = 3000,
        /// Distance at which a point counts fully, metres.
        pub farthest: f32 = 0.10,
        /// Distance of a scan point from the body without an arm above which the arm can explain it, metres.
        pub apart: f32 = 0.02,
        /// Stride through an arm's vertices.
        pub stride: usize = 4,
        /// Angles that are tried, within the limits of the joints.
        pub trials: usize = 200,
        /// Trials that are improved by random steps.
        pub improved: usize = 3,
        /// Standard deviations of these steps as shares of the limits.
        pub steps: [f64; 3] = [0.10, 0.04, 0.015],
        /// Random steps of each size.
        pub repeats: usize = 25,
        /// Stage of the last fit.
        pub stage: FitStage = FitStage::posed(0.08, 8),
        /// Error beside that of the lost arm from which another one is taken.
        pub better: f64 = 0.97,
        /// Error that another arm must save to be fitted: wrong arms of the scenes had at most 0.003, lost ones 0.02 to 0.04.
        pub gain: f64 = 0.01,
    }

    /// Settings of the choice between trousers and skirts.
    pub struct LegSettings {
        /// Shares of the way from leg to leg that are the middle of the tube between them.
        pub middle: [f32; 2] = [0.3, 0.7],
        /// Depths below the top of the tube that are read, metres: from seats of trousers to the shortest skirts.
        pub depths: [f32; 2] = [0.10, 0.25],
        /// Range of distances in front of the body in which cloth is searched, metres.
        pub reach: [f32; 2] = [-0.02, 0.25],
        /// Distance of a scan point from the line of sight of a vertex, metres.
        pub aside: f32 = 0.015,
        /// Smallest cosine between the normals of cloth and of the tube.
        pub facing: f32 = 0.85,
        /// Share of the tube's middle behind cloth from which legs are joined: skirts have 0.95, trousers 0.25, closed legs 0.5.
        pub least_seen: f64 = 0.75,
    }

    /// Settings of the free surface (eq. 4, 5).
    pub struct FreeSurfaceSettings {
        /// Stages of the first scan.
        pub first: [SurfaceStage; 4] = [
            SurfaceStage::new(0.10, 0.08, 4, 30_000),
            SurfaceStage::new(0.05, 0.06, 4, 30_000),
            SurfaceStage::new(0.025, 0.04, 4, 30_000),
            SurfaceStage::new(0.012, 0.03, 4, 30_000),
        ],
        /// Stages of a later scan, which starts at the clothed template in its pose (eq. 9).
        pub later: [SurfaceStage; 2] = [
            SurfaceStage::new(0.04, 0.05, 2, 7_500),
            SurfaceStage::new(0.012, 0.03, 3, 30_000),
        ],
        /// Coupling of hands, feet and head beside 1 elsewhere (w of eq. 5): scans are noisy there and no cloth covers them.
        pub firm: f64 = 8.0,
        /// Pull to the model's vertices beside that of the data: settles what no point and no edge determines.
        pub anchor: f64 = 1e-4,
        /// Pairs and solves.
        pub fit: SurfaceFitSettings = SurfaceFitSettings::default(),
    }

    /// Settings of a surface pulled to points: pairs, solves, and what an iteration skips.
    pub struct SurfaceFitSettings {
        /// Smallest cosine between normals of a pair.
        pub normals: f32 = 0.2,
        /// Motion of a face up to which points keep it, metres; 0 searches always. At 1 mm hems of low contrast are 1 mm worse.
        pub settled: f32 = 5e-4,
        /// Motion of a vertex up to which the next iteration holds it, metres; 0 solves all. It would still move by less.
        pub still: f32 = 1e-4,
        /// Mean motion of the vertices below which the iterations end, metres; 0 makes all.
        pub converged: f32 = 5e-5,
        /// Share of the vertices up to which they are solved apart. More are solved faster with all others, by factorisation.
        pub most_apart: f64 = 0.5,
        /// Residual beside that before at which a solve of some vertices ends.
        pub residual: f64 = 0.01,
        /// Most products of such a solve.
        pub products: usize = 100,
    }
}

impl SurfaceFitSettings {
    /// End of a solve of some vertices.
    pub(crate) fn stop(&self) -> CgSettings {
        CgSettings {
            accuracy: CgAccuracy::Residual(self.residual),
            iterations: self.products,
            par: Par::Seq,
        }
    }

    /// The same with every point searched and every vertex solved in each iteration, unless `skips`.
    pub(crate) fn skipping(self, skips: bool) -> Self {
        let [settled, still] = if skips {
            [self.settled, self.still]
        } else {
            [0.0; 2]
        };
        Self {
            settled,
            still,
            ..self
        }
    }
}
