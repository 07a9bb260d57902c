//! Fit of one part to its scan points (eq. 15 to 21): data, boundary, coupling, Laplacian and boundary smoothness.

use super::part::ClothPart;
use crate::CaptureError;
use crate::align::{
    EVEN_EDGE, Pull, PullPlace, ScanPairing, ScanPoints, Stencil, SurfaceFit, SurfaceFitReport,
    SurfaceTerms, explained,
};
use crate::scan::BodyScan;
use crate::settings::{PartFitConfig, SurfaceFitSettings};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, edges, face_normal};
use tryon_geometry::spatial::PointTree;

/// Report of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartFitReport {
    /// Fit to the part's points.
    pub surface: SurfaceFitReport,
    /// Mean distance of the scan's boundary points from the rings, metres; 0 without any.
    pub boundary_error: f64,
}

/// Scan with labels, from which the points of each part are taken.
#[derive(Clone, Copy, Debug)]
pub struct LabelledScan<'a> {
    /// Scan.
    pub scan: &'a BodyScan,
    /// Its edges.
    pub edges: &'a [[u32; 2]],
    /// Label of each point.
    pub labels: &'a [u8],
    /// Vertex of the clothed template that each point may lie near: searches start there.
    pub near: &'a [u32],
}

/// Scan points of one part.
#[derive(Clone, Debug, Default)]
pub struct PartScan {
    /// Points and normals alone.
    scan: BodyScan,
    /// Points between the part's label and another one.
    boundary: Vec<P3>,
    /// Vertex of the clothed template that each point may lie near.
    near: Vec<u32>,
}

impl PartScan {
    /// Points with a label, and the middles of the scan's edges to other labels; these have normals that agree to `beside`.
    pub fn new(labelled: &LabelledScan<'_>, label: u8, beside: f32) -> Self {
        let LabelledScan {
            scan,
            edges,
            labels,
            near,
        } = *labelled;
        let own = |i: &usize| labels[*i] == label;
        let some: Vec<usize> = (0..scan.points.len()).filter(own).collect();
        let crosses = |e: &&[u32; 2]| {
            let [a, b] = e.map(|v| labels[v as usize] == label);
            let [n, m] = e.map(|v| v as usize);
            a != b && (!scan.faces.is_empty() || scan.agrees(m, &scan.normals[n], beside))
        };
        let middle = |e: &[u32; 2]| {
            let [a, b] = e.map(|v| scan.points[v as usize]);
            nalgebra::center(&a, &b)
        };
        let edges = edges.iter().filter(crosses);
        Self {
            scan: BodyScan {
                points: some.iter().map(|i| scan.points[*i]).collect(),
                normals: some.iter().map(|i| scan.normals[*i]).collect(),
                oriented: scan.oriented,
                ..BodyScan::default()
            },
            boundary: edges.map(middle).collect(),
            near: some.iter().map(|i| near[*i]).collect(),
        }
    }

    /// Pulls of the ring vertices at `surface` to the means of the boundary points within `reach` nearest to them, and the
    /// mean distance of these, metres.
    fn pull_rings(
        &self,
        ring: &[u32],
        surface: &[P3],
        weight: f64,
        reach: f32,
    ) -> (Vec<Pull>, f64) {
        let places: Vec<P3> = ring.iter().map(|v| surface[*v as usize]).collect();
        let tree = PointTree::new(&places);
        let mut sums = vec![(V3::zeros(), 0.0f32); ring.len()];
        let (mut total, mut count) = (0.0, 0.0);
        for p in &self.boundary {
            if let Some((k, d)) = tree.nearest(p, reach) {
                sums[k].0 += p.coords;
                sums[k].1 += 1.0;
                total += f64::from(d.sqrt());
                count += 1.0;
            }
        }
        let pulls = ring.iter().zip(&sums).map(|(v, (sum, n))| Pull {
            at: PullPlace::Vertex(*v),
            weight: if *n > 0.0 { weight } else { 0.0 },
            target: P3::from(sum / n.max(1.0)),
        });
        let mean = if count > 0.0 { total / count } else { 0.0 };
        (pulls.collect(), mean)
    }
}

/// System of one part.
#[derive(Debug)]
pub struct PartFit {
    part: ClothPart,
    ring: Vec<u32>,
    fit: SurfaceFit,
    pairing: ScanPairing,
}

impl PartFit {
    /// Prepares the system; `rest` are the part's vertices in any pose, metres.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a part too large.
    pub fn new(part: &ClothPart, rest: &[P3]) -> Result<Self, CaptureError> {
        let n = part.nodes.len();
        let neighbours = Csr::of_edges(n, &edges(&part.faces));
        let ring = part.rings.iter().flat_map(|r| &r.vertices);
        let ring: Vec<u32> = ring.copied().collect();
        let mut on_ring = vec![false; n];
        ring.iter().for_each(|v| on_ring[*v as usize] = true);
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
        let mut bends = Vec::new();
        for ring in &part.rings {
            let k = ring.vertices.len();
            bends.extend((0..k).map(|i| Stencil {
                vertices: [k + i - 1, i, i + 1].map(|j| ring.vertices[j % k]).to_vec(),
                factors: vec![1.0, -2.0, 1.0],
                weight: 1.0,
            }));
        }
        let groups = vec![inner.map(laplacian).collect(), bends];
        Ok(Self {
            fit: SurfaceFit::new("garment part", n, &part.faces, |_| EVEN_EDGE, groups)?,
            pairing: ScanPairing::new(&part.faces, rest, false),
            part: part.clone(),
            ring,
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
        let count = scan.scan.points.len();
        let points = ScanPoints::of(&scan.scan, count.div_ceil(config.points.max(1)));
        self.begin(scan, points.stride, &config.fit);
        // A Laplacian of size δ on an even mesh bends like δ / h², so its weight is length⁴ / h⁴ by area.
        let bend = (config.laplacian * config.laplacian / vertex).powi(2) * vertex;
        let terms = SurfaceTerms {
            model,
            coupling: config.coupling,
            smoothness: &[bend, config.smoothness * vertex],
            anchor: config.anchor * vertex,
            iterations: config.iterations,
            settings: &config.fit,
        };
        let mut boundary_error = 0.0;
        let mut report = self.fit.run(&terms, surface, |x| {
            let matches = self.pairing.pair(&points, x, config.sigma);
            let (rings, error) =
                scan.pull_rings(&self.ring, x, config.boundary * vertex, config.ring_reach);
            boundary_error = error;
            Ok(Some(points.pulls(&matches, area).chain(rings).collect()))
        })?;
        (report.error, report.paired) =
            explained(&self.pairing.pair(&points, surface, config.sigma));
        report.queries = self.pairing.counts();
        Ok(PartFitReport {
            surface: report,
            boundary_error,
        })
    }

    /// Starts searches at the faces near which the single mesh had the points, every `stride`-th of them.
    fn begin(&mut self, scan: &PartScan, stride: usize, settings: &SurfaceFitSettings) {
        self.pairing.begin(scan.near.len(), settings);
        for (i, node) in scan.near.iter().enumerate().step_by(stride) {
            if let Ok(v) = self.part.nodes.binary_search(node) {
                self.pairing.start_around(i, v);
            }
        }
    }
}

fn area(part: &ClothPart, vertices: &[P3]) -> f64 {
    let twice = |f| f64::from(face_normal(vertices, f).norm());
    0.5 * part.faces.iter().map(twice).sum::<f64>()
}
