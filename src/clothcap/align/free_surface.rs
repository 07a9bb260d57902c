//! Free surface of a single-mesh alignment (eq. 3 to 5): vertices follow the scan, edges stay near those of the body model.

use super::active_vertices::{ActiveVertices, VertexCounts};
use super::face_cache::{FaceCache, QueryCounts, QueryPoints};
use super::face_walk::QuerySurface;
use super::model_fit::is_bare;
use super::pairing::ScanNormal;
use super::quadratic::{EVEN_EDGE, QuadraticEnergy, Stencil};
use crate::CaptureError;
use crate::scan::BodyScan;
use std::sync::Arc;
use tryon_body::Template;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, Face, vertex_normals};
use tryon_geometry::par::Par;
use tryon_geometry::spatial::{Bvh, SurfacePoint};
use tryon_tracking::registration::GemanMcClure;

/// Coupling of hands, feet and head beside 1 elsewhere (w of eq. 5): scans are noisy there and no cloth covers them.
const FIRM: f64 = 8.0;
/// Pull to the model's vertices beside that of the data: settles what no point and no edge determines.
const ANCHOR: f64 = 1e-4;
/// Smallest cosine between normals of a pair, for oriented scans.
const NORMALS: f32 = 0.2;
/// Motion below which a stage ends: mean over all vertices, metres.
const CONVERGED: f32 = 5e-5;

/// Motion of a face up to which points keep it, metres: closest points change by less than by noise. At 1 mm hems of
/// low contrast are 1 mm worse.
pub(crate) const SETTLED: f32 = 5e-4;

/// Motion of a vertex in an iteration up to which it is held in the next, metres: what it would still move is a
/// fraction of that.
pub(crate) const STILL: f32 = 1e-4;

/// Name of the solve in faults.
const STAGE: &str = "free surface";

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

/// Report of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceFitReport {
    /// Solves.
    pub iterations: usize,
    /// Mean distance of paired scan points from the surface, metres.
    pub error: f64,
    /// BodyScan points with a partner in the last iteration.
    pub paired: usize,
    /// Nearest-point queries.
    pub queries: QueryCounts,
    /// Vertices.
    pub vertices: VertexCounts,
}

/// Free surface over the mesh of a template.
#[derive(Debug)]
pub struct FreeSurface {
    energy: QuadraticEnergy,
    edges: Vec<[u32; 2]>,
    faces: Vec<Face>,
    around: Csr,
    neighbours: Arc<Csr>,
    bvh: Bvh,
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
        let edges: Vec<[u32; 2]> = template.topology().edges().iter().map(|e| e.v).collect();
        let stencil = |e: &[u32; 2]| {
            let w = 0.5 * (firm[e[0] as usize] + firm[e[1] as usize]);
            Stencil::edge(*e, EVEN_EDGE * w)
        };
        let mesh = template.mesh();
        let stencils = edges.iter().map(stencil).collect();
        Ok(Self {
            energy: QuadraticEnergy::new(mesh.vertices().len(), stencils, mesh.faces())?,
            edges,
            faces: mesh.faces().to_vec(),
            around: template.topology().vertex_faces().clone(),
            neighbours: Arc::new(template.topology().vertex_neighbours().clone()),
            bvh: Bvh::new(mesh.faces(), mesh.vertices()),
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
        let mut report = SurfaceFitReport::default();
        let mut cache = FaceCache::new(scan.points.len(), config.settled);
        let order = if config.settled > 0.0 {
            scan.order()
        } else {
            Vec::new()
        };
        let spread = |cache: &mut FaceCache| cache.spread(&order);
        let neighbours = self.neighbours.clone();
        let mut active = ActiveVertices::new(&neighbours, config.still);
        for stage in &config.stages {
            let stride = (scan.points.len() / stage.points.max(1)).max(1);
            let kernel = GemanMcClure { sigma: stage.sigma };
            active.begin();
            spread(&mut cache);
            for _ in 0..stage.iterations {
                let matches = self.pair((scan, stride), surface, &kernel, &mut cache);
                self.assemble((scan, stride), model, &matches, stage.coupling);
                let good = matches.iter().filter(|m| m.weight > 0.0);
                active.see(
                    good.map(|m| self.faces[m.face as usize]),
                    std::iter::empty(),
                );
                let motion = active.solve(&mut self.energy, surface, STAGE)?;
                report.iterations += 1;
                if motion < CONVERGED {
                    break;
                }
            }
            active.finish(&mut self.energy, surface, STAGE)?;
        }
        report.vertices = active.counts();
        let last = config.stages.last().map_or(0.03, |s| s.sigma);
        let kernel = GemanMcClure { sigma: last };
        // Labels are read off these matches: each is searched.
        cache.search_all();
        spread(&mut cache);
        self.matches = self.pair((scan, 1), surface, &kernel, &mut cache);
        Ok(SurfaceFitReport {
            queries: cache.counts(),
            ..measure(&self.matches, report)
        })
    }

    /// Fills the system with coupling, anchor and the matches of every `stride`-th scan point.
    fn assemble(
        &mut self,
        (scan, stride): (&BodyScan, usize),
        model: &[P3],
        matches: &[SurfaceMatch],
        coupling: f64,
    ) {
        // Each point stands for its share of the area, each vertex for its own.
        let per_point = self.area / matches.len().max(1) as f64;
        let per_vertex = ANCHOR * self.area / model.len().max(1) as f64;
        self.energy.reset();
        for (k, e) in self.edges.iter().enumerate() {
            let d = (model[e[0] as usize] - model[e[1] as usize]).cast::<f64>();
            self.energy.add_stencil(k, coupling * coupling, d.into());
        }
        for (v, p) in model.iter().enumerate() {
            self.energy.add_vertex(v as u32, per_vertex, p);
        }
        for (m, p) in matches.iter().zip(scan.points.iter().step_by(stride)) {
            if m.weight > 0.0 {
                let weight = per_point * m.weight;
                self.energy.add_face_point(m.face, m.corners, weight, p);
            }
        }
    }

    /// Place of each scan point on the surface of the last run, shape `[points]`.
    pub fn matches(&self) -> &[SurfaceMatch] {
        &self.matches
    }

    /// Matches of every `stride`-th scan point.
    fn pair(
        &mut self,
        (scan, stride): (&BodyScan, usize),
        surface: &[P3],
        kernel: &GemanMcClure,
        cache: &mut FaceCache,
    ) -> Vec<SurfaceMatch> {
        self.bvh.refit(surface);
        cache.advance(&self.faces, surface);
        let mut normals = Vec::new();
        vertex_normals(Par::Rayon, surface, &self.faces, &self.around, &mut normals);
        let query = QuerySurface {
            tree: &self.bvh,
            vertices: surface,
            around: &self.around,
        };
        let points = QueryPoints {
            points: &scan.points,
            normals: &scan.normals,
            oriented: scan.oriented,
            stride,
            left_out: &[],
        };
        let matched = |(_, of_scan, found): (usize, ScanNormal, Option<SurfacePoint>)| {
            let Some(found) = found else {
                return SurfaceMatch::default();
            };
            let face = &self.faces[found.face as usize];
            let corners = found.weights;
            let normal: V3 = (0..3).map(|k| normals[face[k] as usize] * corners[k]).sum();
            let e2 = f64::from(found.distance * found.distance);
            let agrees = of_scan.agrees(&normal, NORMALS);
            SurfaceMatch {
                face: found.face,
                corners,
                distance: found.distance,
                weight: if agrees { kernel.weight(e2) } else { 0.0 },
            }
        };
        let found = cache.closest_each(&query, &points, NORMALS);
        found.into_iter().map(matched).collect()
    }
}

/// Place of a scan point on the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceMatch {
    /// Triangle.
    pub face: u32,
    /// Barycentric coordinates in it.
    pub corners: [f32; 3],
    /// Distance, metres.
    pub distance: f32,
    /// Robust weight; 0 for a point that the surface does not explain.
    pub weight: f64,
}

impl SurfaceMatch {
    /// Corner of the triangle with the largest share, 0 to 2.
    pub fn nearest_corner(&self) -> usize {
        let [a, b, c] = self.corners;
        if a >= b && a >= c {
            0
        } else if b >= c {
            1
        } else {
            2
        }
    }
}

/// The report with the distances of the last matches.
fn measure(matches: &[SurfaceMatch], report: SurfaceFitReport) -> SurfaceFitReport {
    let good = matches.iter().filter(|m| m.weight > 0.0);
    let (sum, n) = good.fold((0.0, 0), |(s, n), m| (s + f64::from(m.distance), n + 1));
    SurfaceFitReport {
        error: sum / f64::from(n.max(1)),
        paired: n as usize,
        ..report
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
