//! Fit of one part to its scan points (eq. 15 to 21): data, boundary, coupling, Laplacian and boundary smoothness.

use super::part::ClothPart;
use crate::CaptureError;
use crate::align::{
    ActiveVertices, EVEN_EDGE, FaceCache, QuadraticEnergy, QueryCounts, QueryPoints, QuerySurface,
    ScanNormal, Stencil, VertexCounts,
};
use crate::scan::BodyScan;
use std::sync::Arc;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, edges, face_normal};
use tryon_geometry::spatial::{Bvh, PointTree, SurfacePoint};
use tryon_tracking::registration::GemanMcClure;

/// Smallest cosine between normals of a pair.
const NORMALS: f32 = 0.2;
/// Smallest cosine between normals of neighbours across a boundary.
const BESIDE: f32 = 0.7;
/// Pull to the start beside the data's: settles what no term determines.
const ANCHOR: f64 = 1e-4;
/// Mean motion of the vertices below which the fit ends, metres.
const CONVERGED: f32 = 5e-5;
/// Name of the solve in faults.
const STAGE: &str = "garment part";
/// Distance up to which a boundary point of the scan belongs to a ring, metres.
const RING_REACH: f32 = 0.06;

/// Weights of a part's energy; lengths whose squares weigh terms against data by area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartFitConfig {
    /// Width of the Geman–McClure kernel, metres.
    pub sigma: f64,
    /// Coupling length, metres (w_c of eq. 15).
    pub coupling: f64,
    /// Length of the Laplacian, metres (w_s).
    pub laplacian: f64,
    /// Weight of a boundary point beside a surface point (w_b). The paper's is 0.02 of the data's, per point.
    pub boundary: f64,
    /// Weight of boundary smoothness beside a surface point (w_a).
    pub smoothness: f64,
    /// Most iterations.
    pub iterations: usize,
    /// Most scan points in an iteration.
    pub points: usize,
    /// Motion of a face up to which the points on it keep it without a search, metres; 0 searches always.
    pub settled: f32,
    /// Motion of a vertex in an iteration up to which it is held in the next, metres; 0 solves all in each.
    pub still: f32,
}

impl Default for PartFitConfig {
    fn default() -> Self {
        Self {
            sigma: 0.03,
            coupling: 0.012,
            laplacian: 0.006,
            boundary: 2.0,
            smoothness: 2.0,
            iterations: 8,
            points: 15_000,
            settled: 0.0,
            still: 0.0,
        }
    }
}

/// Report of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartFitReport {
    /// Mean distance of the part's scan points from it, metres.
    pub error: f64,
    /// Mean distance of the scan's boundary points from the rings, metres; 0 without any.
    pub boundary_error: f64,
    /// BodyScan points with a partner.
    pub paired: usize,
    /// Solves.
    pub iterations: usize,
    /// Nearest-point queries.
    pub queries: QueryCounts,
    /// Vertices.
    pub vertices: VertexCounts,
}

/// BodyScan points of one part.
#[derive(Clone, Debug, Default)]
pub struct PartScan {
    points: Vec<P3>,
    normals: Vec<V3>,
    oriented: bool,
    /// Points between the part's label and another one.
    boundary: Vec<P3>,
    /// Vertex of the clothed template that each point may lie near.
    near: Vec<u32>,
}

impl PartScan {
    /// Points with a label, and the middles of the scan's edges to other labels. `near` gives the vertex of the clothed
    /// template that each point of the scan may lie near: searches start there.
    pub fn new(
        (scan, edges): (&BodyScan, &[[u32; 2]]),
        (labels, near): (&[u8], &[u32]),
        label: u8,
    ) -> Self {
        let own = |i: &usize| labels[*i] == label;
        let some: Vec<usize> = (0..scan.points.len()).filter(own).collect();
        let crosses = |e: &&[u32; 2]| {
            let [a, b] = e.map(|v| labels[v as usize] == label);
            let [n, m] = e.map(|v| &scan.normals[v as usize]);
            let of_scan = ScanNormal {
                normal: *m,
                oriented: scan.oriented,
            };
            // Edges of a cloud also join an arm and the torso behind it.
            a != b && (!scan.faces.is_empty() || of_scan.agrees(n, BESIDE))
        };
        let middle = |e: &[u32; 2]| {
            let [a, b] = e.map(|v| scan.points[v as usize]);
            nalgebra::center(&a, &b)
        };
        let edges = edges.iter().filter(crosses);
        Self {
            points: some.iter().map(|i| scan.points[*i]).collect(),
            normals: some.iter().map(|i| scan.normals[*i]).collect(),
            oriented: scan.oriented,
            boundary: edges.map(middle).collect(),
            near: some.iter().map(|i| near[*i]).collect(),
        }
    }
}

/// System of one part.
#[derive(Debug)]
pub struct PartFit {
    part: ClothPart,
    energy: QuadraticEnergy,
    edges: Vec<[u32; 2]>,
    /// Stencils: edges, then Laplacians, then rings.
    ranges: [usize; 3],
    bvh: Bvh,
    /// Faces around each vertex.
    around: Csr,
    neighbours: Arc<Csr>,
}

impl PartFit {
    /// Prepares the system; `rest` are the part's vertices in any pose, metres.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a part too large.
    pub fn new(part: &ClothPart, rest: &[P3]) -> Result<Self, CaptureError> {
        let n = part.nodes.len();
        let edges = edges(&part.faces);
        let neighbours = Csr::of_edges(n, &edges);
        let mut on_ring = vec![false; n];
        part.rings
            .iter()
            .flat_map(|r| &r.vertices)
            .for_each(|v| on_ring[*v as usize] = true);
        let mut stencils: Vec<Stencil> =
            edges.iter().map(|e| Stencil::edge(*e, EVEN_EDGE)).collect();
        let laplacian = |v: u32| {
            let row = neighbours.row(v as usize);
            let mut vertices = vec![v];
            vertices.extend(row);
            let mut factors = vec![1.0];
            factors.extend(row.iter().map(|_| -1.0 / row.len() as f64));
            Stencil {
                vertices,
                factors,
                weight: 1.0,
            }
        };
        let inner = (0..n as u32).filter(|v| !on_ring[*v as usize]);
        stencils.extend(inner.map(laplacian));
        let second = stencils.len();
        for ring in &part.rings {
            let k = ring.vertices.len();
            stencils.extend((0..k).map(|i| Stencil {
                vertices: [k + i - 1, i, i + 1].map(|j| ring.vertices[j % k]).to_vec(),
                factors: vec![1.0, -2.0, 1.0],
                weight: 1.0,
            }));
        }
        let corners = part.faces.iter().enumerate();
        let corners = corners.flat_map(|(k, f)| f.map(|v| (v, k as u32)));
        Ok(Self {
            around: Csr::from_pairs(n, &corners.collect::<Vec<_>>()),
            ranges: [edges.len(), second, stencils.len()],
            energy: QuadraticEnergy::new(n, stencils, &part.faces)?,
            bvh: Bvh::new(&part.faces, rest),
            part: part.clone(),
            edges,
            neighbours: Arc::new(neighbours),
        })
    }

    /// Moves `surface` onto the points; `model` is the posed multi-cloth model it is coupled to. Shapes `[vertices]`, metres.
    ///
    /// # Errors
    /// [`CaptureError::Solve`].
    pub fn run(
        &mut self,
        scan: &PartScan,
        model: &[P3],
        surface: &mut Vec<P3>,
        config: &PartFitConfig,
    ) -> Result<PartFitReport, CaptureError> {
        let area = area(&self.part, model);
        let vertex = area / model.len().max(1) as f64;
        let stride = scan.points.len().div_ceil(config.points.max(1)).max(1);
        let point = area / scan.points.len().div_ceil(stride).max(1) as f64;
        let mut report = PartFitReport::default();
        let mut cache = self.cache((scan, stride), config);
        let neighbours = self.neighbours.clone();
        let mut active = ActiveVertices::new(&neighbours, config.still);
        while report.iterations < config.iterations {
            let matches = self.pair((scan, stride), surface, config, &mut cache);
            self.assemble(model, (&matches, point), vertex, config);
            report.boundary_error = self.add_boundary(scan, surface, config.boundary * vertex);

            let faces = matches.iter().map(|m| self.part.faces[m.face as usize]);
            active.see(faces, ring_vertices(&self.part));
            report.iterations += 1;
            if active.solve(&mut self.energy, surface, STAGE)? < CONVERGED {
                break;
            }
        }
        active.finish(&mut self.energy, surface, STAGE)?;
        let matches = self.pair((scan, stride), surface, config, &mut cache);
        report.queries = cache.counts();
        report.vertices = active.counts();
        report.error = mean_distance(&matches);
        report.paired = matches.len();
        Ok(report)
    }

    /// Fills the system with all terms but those of the boundary; `point` and `vertex` are the areas of a scan point and of
    /// a vertex, m².
    fn assemble(
        &mut self,
        model: &[P3],
        (matches, point): (&[PartMatch], f64),
        vertex: f64,
        config: &PartFitConfig,
    ) {
        self.energy.reset();
        for (i, e) in self.edges.iter().enumerate() {
            let d = (model[e[0] as usize] - model[e[1] as usize]).cast::<f64>();
            self.energy
                .add_stencil(i, config.coupling * config.coupling, d.into());
        }
        // A Laplacian of size δ on an even mesh bends like δ / h², so its weight is length⁴ / h⁴ by area.
        let bend = (config.laplacian * config.laplacian / vertex).powi(2) * vertex;
        (self.ranges[0]..self.ranges[1]).for_each(|i| self.energy.add_stencil(i, bend, [0.0; 3]));
        let smooth = config.smoothness * vertex;
        (self.ranges[1]..self.ranges[2]).for_each(|i| self.energy.add_stencil(i, smooth, [0.0; 3]));
        for (v, p) in model.iter().enumerate() {
            self.energy.add_vertex(v as u32, ANCHOR * vertex, p);
        }
        for m in matches {
            self.energy
                .add_face_point(m.face, m.corners, point * m.weight, &m.target);
        }
    }

    /// Cache whose searches start at the faces near which the single mesh had the points, every `stride`-th of them.
    fn cache(&self, (scan, stride): (&PartScan, usize), config: &PartFitConfig) -> FaceCache {
        let mut cache = FaceCache::new(scan.points.len(), config.settled);
        for (i, node) in scan.near.iter().enumerate().step_by(stride) {
            if let Ok(v) = self.part.nodes.binary_search(node) {
                let last = self.around.row(v).last();
                last.into_iter().for_each(|f| cache.start_at(i, *f));
            }
        }
        cache
    }

    /// Places of every `stride`-th point.
    fn pair(
        &mut self,
        (scan, stride): (&PartScan, usize),
        surface: &[P3],
        config: &PartFitConfig,
        cache: &mut FaceCache,
    ) -> Vec<PartMatch> {
        self.bvh.refit(surface);
        cache.advance(&self.part.faces, surface);
        let kernel = GemanMcClure {
            sigma: config.sigma,
        };
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
        let matched = |(i, of_scan, found): (usize, ScanNormal, Option<SurfacePoint>)| {
            let found = found?;
            let face = &self.part.faces[found.face as usize];
            let own = face_normal(surface, face).try_normalize(f32::MIN_POSITIVE)?;
            of_scan.agrees(&own, NORMALS).then(|| PartMatch {
                face: found.face,
                corners: found.weights,
                target: scan.points[i],
                distance: found.distance,
                weight: kernel.weight(f64::from(found.distance * found.distance)),
            })
        };
        let found = cache.closest_each(&query, &points, NORMALS);
        found.into_iter().filter_map(matched).collect()
    }

    /// Pulls each ring vertex to the mean of the scan's boundary points nearest to it; their mean distance, metres.
    fn add_boundary(&mut self, scan: &PartScan, surface: &[P3], weight: f64) -> f64 {
        let ring: Vec<u32> = ring_vertices(&self.part).collect();
        let places: Vec<P3> = ring.iter().map(|v| surface[*v as usize]).collect();
        let tree = PointTree::new(&places);
        let mut sums = vec![(V3::zeros(), 0.0f32); ring.len()];
        let (mut total, mut count) = (0.0, 0.0);
        for p in &scan.boundary {
            if let Some((k, d)) = tree.nearest(p, RING_REACH) {
                sums[k].0 += p.coords;
                sums[k].1 += 1.0;
                total += f64::from(d.sqrt());
                count += 1.0;
            }
        }
        for (v, (sum, n)) in ring.iter().zip(&sums).filter(|(_, s)| s.1 > 0.0) {
            self.energy.add_vertex(*v, weight, &P3::from(sum / *n));
        }
        if count > 0.0 { total / count } else { 0.0 }
    }
}

#[derive(Clone, Copy, Debug)]
struct PartMatch {
    face: u32,
    corners: [f32; 3],
    target: P3,
    distance: f32,
    weight: f64,
}

fn ring_vertices(part: &ClothPart) -> impl Iterator<Item = u32> + '_ {
    part.rings.iter().flat_map(|r| &r.vertices).copied()
}

fn mean_distance(matches: &[PartMatch]) -> f64 {
    let sum: f64 = matches.iter().map(|m| f64::from(m.distance)).sum();
    sum / matches.len().max(1) as f64
}

fn area(part: &ClothPart, vertices: &[P3]) -> f64 {
    let twice = |f| f64::from(face_normal(vertices, f).norm());
    0.5 * part.faces.iter().map(twice).sum::<f64>()
}
