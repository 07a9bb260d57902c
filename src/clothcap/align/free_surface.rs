//! Free surface of a single-mesh alignment (eq. 3 to 5): vertices follow the scan, edges stay near those of the body model.

use super::model_fit::bare_vertices;
use super::quadratic::EVEN_EDGE;
use super::scan_pairing::{ScanPairing, ScanPoints, SurfaceMatch, explained};
use super::surface_fit::{SurfaceFit, SurfaceFitReport, SurfaceTerms};
use crate::CaptureError;
use crate::scan::BodyScan;
use crate::settings::{FreeSurfaceSettings, SurfaceStage};
use tryon_body::Template;
use tryon_geometry::math::P3;

/// Free surface over the mesh of a template.
#[derive(Debug)]
pub struct FreeSurface {
    fit: SurfaceFit,
    pairing: ScanPairing,
    settings: FreeSurfaceSettings,
    area: f64,
    matches: Vec<SurfaceMatch>,
}

impl FreeSurface {
    /// Prepares the system of a template.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a mesh too large.
    pub fn new(template: &Template, settings: FreeSurfaceSettings) -> Result<Self, CaptureError> {
        let firmness = |bare| if bare { settings.firm } else { 1.0 };
        let firm: Vec<f64> = bare_vertices(template).into_iter().map(firmness).collect();
        let edge = |e: [u32; 2]| EVEN_EDGE * (0.5 * (firm[e[0] as usize] + firm[e[1] as usize]));
        let mesh = template.mesh();
        let (vertices, faces) = (mesh.vertices(), mesh.faces());
        Ok(Self {
            fit: SurfaceFit::new("free surface", vertices.len(), faces, edge, Vec::new())?,
            pairing: ScanPairing::new(faces, vertices, true),
            settings,
            area: mesh.area(),
            matches: Vec::new(),
        })
    }

    /// Moves `surface` onto the scan; `model` is the posed body it is coupled to. Shapes `[vertices]`, metres. Unless it
    /// `skips`, every point is searched and every vertex solved in each iteration.
    ///
    /// # Errors
    /// [`CaptureError::Solve`].
    pub fn run(
        &mut self,
        scan: &BodyScan,
        model: &[P3],
        surface: &mut Vec<P3>,
        stages: &[SurfaceStage],
        skips: bool,
    ) -> Result<SurfaceFitReport, CaptureError> {
        let settings = self.settings.fit.skipping(skips);
        let order = if settings.settled > 0.0 {
            scan.order()
        } else {
            Vec::new()
        };
        self.pairing.begin(scan.points.len(), &settings);
        let mut report = SurfaceFitReport::default();
        for stage in stages {
            let points = ScanPoints::of(scan, scan.points.len() / stage.points.max(1));
            let terms = SurfaceTerms {
                model,
                coupling: stage.coupling,
                smoothness: &[],
                anchor: self.settings.anchor * self.area / model.len().max(1) as f64,
                iterations: stage.iterations,
                settings: &settings,
            };
            self.pairing.spread(&order);
            let fitted = self.fit.run(&terms, surface, |x| {
                let matches = self.pairing.pair(&points, x, stage.sigma);
                Ok(Some(points.pulls(&matches, self.area).collect()))
            })?;
            report.iterations += fitted.iterations;
            report.vertices += fitted.vertices;
        }
        let last = stages.last().map_or(0.03, |s| s.sigma);
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
