//! Surface pulled to points: pair → couple → anchor → solve. Points pull at places of the surface, its edges stay near
//! those of a model, its vertices near the model's, and the sparse system of all is solved until nothing moves.

use super::active_vertices::{ActiveVertices, VertexCounts};
use super::quadratic::{Pull, QuadraticEnergy, Stencil};
use super::scan_pairing::QueryCounts;
use crate::CaptureError;
use crate::settings::SurfaceFitSettings;
use std::ops::Range;
use std::sync::Arc;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Csr, Face, edges};

/// Terms beside the pulls, and the end of the iterations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceTerms<'a> {
    /// Surface that it is coupled and anchored to, metres, shape `[vertices]`.
    pub(crate) model: &'a [P3],
    /// Coupling length, metres: displacements that vary over shorter distances are suppressed.
    pub(crate) coupling: f64,
    /// Weight of each group of stencils.
    pub(crate) smoothness: &'a [f64],
    /// Weight of each vertex's pull to the model's: settles what no other term determines.
    pub(crate) anchor: f64,
    pub(crate) iterations: usize,
    pub(crate) settings: &'a SurfaceFitSettings,
}

/// Report of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceFitReport {
    /// Solves.
    pub iterations: usize,
    /// Mean distance of paired scan points from the surface, metres.
    pub error: f64,
    /// Scan points with a partner in the last iteration.
    pub paired: usize,
    /// Nearest-point queries.
    pub queries: QueryCounts,
    /// Vertices.
    pub vertices: VertexCounts,
}

#[derive(Debug)]
pub(crate) struct SurfaceFit {
    /// Name of the solve in faults.
    stage: &'static str,
    energy: QuadraticEnergy,
    edges: Vec<[u32; 2]>,
    /// Stencils of each group, after those of the edges.
    groups: Vec<Range<usize>>,
    neighbours: Arc<Csr>,
}

impl SurfaceFit {
    /// Prepares the system of so many vertices; `edge` is the coupling of an edge, `groups` are further stencils whose
    /// values vanish at best.
    pub(crate) fn new(
        stage: &'static str,
        vertices: usize,
        faces: &[Face],
        edge: impl Fn([u32; 2]) -> f64,
        groups: Vec<Vec<Stencil>>,
    ) -> Result<Self, CaptureError> {
        let edges = edges(faces);
        let mut stencils: Vec<Stencil> =
            edges.iter().map(|e| Stencil::edge(*e, edge(*e))).collect();
        let group = |all: Vec<Stencil>| {
            let first = stencils.len();
            stencils.extend(all);
            first..stencils.len()
        };
        let groups = groups.into_iter().map(group).collect();
        Ok(Self {
            stage,
            energy: QuadraticEnergy::new(vertices, stencils, faces)?,
            neighbours: Arc::new(Csr::of_edges(vertices, &edges)),
            edges,
            groups,
        })
    }

    /// Moves the vertices `x` of the surface, metres. `pair` gives the pulls at a surface, or `None` to end.
    pub(crate) fn run(
        &mut self,
        terms: &SurfaceTerms<'_>,
        x: &mut Vec<P3>,
        mut pair: impl FnMut(&[P3]) -> Result<Option<Vec<Pull>>, CaptureError>,
    ) -> Result<SurfaceFitReport, CaptureError> {
        let neighbours = self.neighbours.clone();
        let mut active = ActiveVertices::new(&neighbours, terms.settings);
        let mut iterations = 0;
        while iterations < terms.iterations {
            let Some(pulls) = pair(x)? else {
                break;
            };
            self.energy.reset();
            self.couple(terms);
            self.anchor(terms);
            active.see(pulls.iter().flat_map(|p| self.energy.add_pull(p)));
            iterations += 1;
            if active.solve(&mut self.energy, x, self.stage)? < terms.settings.converged {
                break;
            }
        }
        active.finish(&mut self.energy, x, self.stage)?;
        Ok(SurfaceFitReport {
            iterations,
            vertices: active.counts(),
            ..SurfaceFitReport::default()
        })
    }

    pub(crate) fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// Edges near those of the model, and the groups of stencils near zero.
    fn couple(&mut self, terms: &SurfaceTerms<'_>) {
        for (k, [a, b]) in self.edges.iter().enumerate() {
            let d = (terms.model[*a as usize] - terms.model[*b as usize]).cast::<f64>();
            let scale = terms.coupling * terms.coupling;
            self.energy.add_stencil(k, scale, d.into());
        }
        for (group, weight) in self.groups.iter().zip(terms.smoothness) {
            let all = group.clone();
            all.for_each(|k| self.energy.add_stencil(k, *weight, [0.0; 3]));
        }
    }

    fn anchor(&mut self, terms: &SurfaceTerms<'_>) {
        for (v, p) in (0..).zip(terms.model) {
            self.energy.add_vertex(v, terms.anchor, p);
        }
    }
}
