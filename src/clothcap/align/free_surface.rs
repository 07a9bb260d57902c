//! Free surface of a single-mesh alignment (eq. 3 to 5): vertices follow the scan, edges stay near those of the body model.

use super::model_fit::is_bare;
use super::quadratic::EVEN_EDGE;
use super::scan_pairing::{SETTLED, ScanPairing, ScanPoints, SurfaceMatch, explained};
use super::surface_fit::{CONVERGED, STILL, SurfaceFit, SurfaceFitReport, SurfaceTerms};
use crate::CaptureError;
use crate::scan::BodyScan;
use tryon_body::Template;
use tryon_geometry::math::P3;

/// Coupling of hands, feet and head beside 1 elsewhere (w of eq. 5): scans are noisy there and no cloth covers them.
const FIRM: f64 = 8.0;
/// Pull to the model's vertices beside that of the data: settles what no point and no edge determines.
const ANCHOR: f64 = 1e-4;

/// Kernel and coupling of one stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceStage {
    /// Coupling length, metres: displacements that vary over shorter distances are suppressed. Its square is w_c of eq. 3
    /// for data weighted by area.
    pub coupling: f64,
    /// Width of the Geman–McClure kernel, metres.
    pub sigma: f64,
    /// Most iterations.
    pub iterations: usize,
    /// Most scan points in an iteration; the others are matched in the end.
    pub points: usize,
}

/// Stages of a free-surface fit, coarse to fine.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceFitConfig {
    /// Stages.
    pub stages: Vec<SurfaceStage>,
    /// Motion of a face up to which the points on it keep it without a search, metres; 0 searches always.
    pub settled: f32,
    /// Motion of a vertex in an iteration up to which it is held in the next, metres; 0 solves all in each.
    pub still: f32,
}

impl SurfaceFitConfig {
    /// Stages of a later frame, which starts at the clothed template in its pose (eq. 9).
    pub fn later() -> Self {
        let stage = |coupling, sigma, iterations, points| SurfaceStage {
            coupling,
            sigma,
            iterations,
            points,
        };
        Self {
            stages: vec![stage(0.04, 0.05, 2, 7_500), stage(0.012, 0.03, 3, 30_000)],
            settled: SETTLED,
            still: STILL,
        }
    }
}

impl Default for SurfaceFitConfig {
    fn default() -> Self {
        let stage = |coupling, sigma, iterations| SurfaceStage {
            coupling,
            sigma,
            iterations,
            points: 30_000,
        };
        Self {
            stages: vec![
                stage(0.10, 0.08, 4),
                stage(0.05, 0.06, 4),
                stage(0.025, 0.04, 4),
                stage(0.012, 0.03, 4),
            ],
            settled: 0.0,
            still: 0.0,
        }
    }
}

/// Free surface over the mesh of a template.
#[derive(Debug)]
pub struct FreeSurface {
    fit: SurfaceFit,
    pairing: ScanPairing,
    area: f64,
    matches: Vec<SurfaceMatch>,
}

impl FreeSurface {
    /// Prepares the system of a template.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a mesh too large.
    pub fn new(template: &Template) -> Result<Self, CaptureError> {
        let firm = firmness(template);
        let edge = |e: [u32; 2]| EVEN_EDGE * (0.5 * (firm[e[0] as usize] + firm[e[1] as usize]));
        let mesh = template.mesh();
        let (vertices, faces) = (mesh.vertices(), mesh.faces());
        Ok(Self {
            fit: SurfaceFit::new("free surface", vertices.len(), faces, edge, Vec::new())?,
            pairing: ScanPairing::new(faces, vertices, true),
            area: mesh.area(),
            matches: Vec::new(),
        })
    }

    /// Moves `surface` onto the scan; `model` is the posed body it is coupled to. Shapes `[vertices]`, metres.
    ///
    /// # Errors
    /// [`CaptureError::Solve`].
    pub fn run(
        &mut self,
        scan: &BodyScan,
        model: &[P3],
        surface: &mut Vec<P3>,
        config: &SurfaceFitConfig,
    ) -> Result<SurfaceFitReport, CaptureError> {
        let order = if config.settled > 0.0 {
            scan.order()
        } else {
            Vec::new()
        };
        self.pairing.begin(scan.points.len(), config.settled);
        let mut report = SurfaceFitReport::default();
        for stage in &config.stages {
            let points = ScanPoints::of(scan, scan.points.len() / stage.points.max(1));
            let terms = SurfaceTerms {
                model,
                coupling: stage.coupling,
                smoothness: &[],
                anchor: ANCHOR * self.area / model.len().max(1) as f64,
                iterations: stage.iterations,
                converged: CONVERGED,
                still: config.still,
            };
            self.pairing.spread(&order);
            let fitted = self.fit.run(&terms, surface, |x| {
                let matches = self.pairing.pair(&points, x, stage.sigma);
                Ok(Some(points.pulls(&matches, self.area).collect()))
            })?;
            report.iterations += fitted.iterations;
            report.vertices += fitted.vertices;
        }
        let last = config.stages.last().map_or(0.03, |s| s.sigma);
        // Labels are read off these matches: each is searched.
        self.pairing.search_all();
        self.pairing.spread(&order);
        self.matches = self.pairing.pair(&ScanPoints::of(scan, 1), surface, last);
        (report.error, report.paired) = explained(&self.matches);
        report.queries = self.pairing.counts();
        Ok(report)
    }

    /// Place of each scan point on the surface of the last run, shape `[points]`.
    pub fn matches(&self) -> &[SurfaceMatch] {
        &self.matches
    }
}

/// Coupling of each vertex: [`FIRM`] for hands, feet and head, else 1.
fn firmness(template: &Template) -> Vec<f64> {
    (0..template.mesh().vertices().len())
        .map(|v| {
            let segment = template.parts().segment(template.weights().dominant(v));
            if is_bare(segment) { FIRM } else { 1.0 }
        })
        .collect()
}
