//! A sheet as coupled edge springs, softened where a step would be unstable.

use super::edge_stiffness::TriangleSprings;
use super::elements::{CurvedHinge, EdgeTriangle};
use super::mass_filter::MassFilter;
use super::stability::{
    FlatSheet, bending_eigenvalue, element_limits, hinge_limits, soften, without_outliers,
};
use crate::live::{Element, Sheet};
use crate::settings::SolverSettings;
use std::collections::BTreeMap;

/// Step that a sheet is made stable for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepSpec {
    /// Length of a substep (s).
    pub h: f64,
    /// Extrapolation of the positions that forces are evaluated at (substeps). Damps the fastest modes.
    pub lookahead: f64,
    /// Substeps between two evaluations of bending.
    pub bending_interval: usize,
    /// Degree of the mass filter, 0 for none. Each degree allows longer steps and slows the finest waves.
    pub filter_degree: usize,
}

/// Immutable. Arrays over vertices and over edges, the latter sorted by their ends.
#[derive(Clone, Debug)]
pub struct StableSheet {
    /// Mean share of the membrane stiffness that is kept, by area; below 1 where the step is too long.
    pub kept_stiffness: f64,
    /// Number of elements that keep less than all.
    pub soft_elements: usize,
    pub(super) inverse_mass: Vec<f32>,
    pub(super) ends: Vec<[u32; 2]>,
    pub(super) rest: Vec<f32>,
    pub(super) triangles: Vec<EdgeTriangle>,
    /// Vertex pairs with the bending stiffness between them (N/m).
    pub(super) bend: Vec<([u32; 2], f32)>,
    pub(super) bent: Vec<CurvedHinge>,
    /// Weight of each edge in the mass filter (kg).
    pub(super) filter_weight: Vec<f32>,
    /// Coefficients of the mass filter, the lowest (1) first.
    pub(super) filter: Vec<f32>,
    pub(super) damping: f32,
    pub(super) air: f32,
}

impl StableSheet {
    /// Compiles a sheet for a step.
    pub fn new(sheet: &Sheet, spec: &StepSpec, settings: &SolverSettings) -> Self {
        let edges = SortedEdges::new(sheet);
        // Symplectic Euler is stable to 4/h²; extrapolation lowers that.
        let ahead = 1.0 + 2.0 * spec.lookahead;
        let limit = 4.0 / (spec.h * spec.h * ahead * settings.stability_margin);
        let filter = MassFilter::of_sheet(sheet, edges.ends(), spec.filter_degree, settings);
        let limits = element_limits(sheet);
        let flat = FlatSheet::new(sheet);
        let keep = soften(limit, &limits, settings, |k| flat.eigenvalue(k, &filter));
        let area: f64 = sheet.elements.iter().map(|e| e.area).sum();
        let kept: f64 = sheet
            .elements
            .iter()
            .zip(&keep)
            .map(|(e, k)| e.area * k)
            .sum();
        let identity = filter.identity();
        let keep_bend = kept_bending(sheet, spec, &identity, settings);
        let (bend, bent) = bending(sheet, &keep_bend, &edges, settings.flat);
        Self {
            kept_stiffness: kept / area.max(f64::MIN_POSITIVE),
            soft_elements: keep.iter().filter(|k| **k < 1.0).count(),
            inverse_mass: sheet.mass.iter().map(|m| (1.0 / m) as f32).collect(),
            triangles: triangles(sheet, &keep, &edges),
            rest: edges.0.iter().map(|e| e.1 as f32).collect(),
            ends: edges.ends(),
            bend,
            bent,
            filter_weight: filter.weight.iter().map(|w| *w as f32).collect(),
            filter: filter.coefficients.iter().map(|c| *c as f32).collect(),
            damping: sheet.damping as f32,
            air: sheet.air as f32,
        }
    }
    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.inverse_mass.len()
    }
    /// Substeps of `h` seconds that bending forces may be kept for, within the settings' range: all but a few small hinges
    /// keep all their stiffness.
    pub fn bending_interval(sheet: &Sheet, h: f64, settings: &SolverSettings) -> usize {
        let keep = without_outliers(&hinge_limits(sheet), settings.outliers);
        let unfiltered = MassFilter::of_sheet(sheet, ends(sheet), 0, settings);
        let fastest = bending_eigenvalue(sheet, &keep, &unfiltered)
            .max(f64::MIN_POSITIVE)
            .sqrt();
        let [fewest, most] = settings.bending_interval;
        ((1.0 / (fastest * h)) as usize).clamp(fewest, most)
    }
    /// Longest step at which all but a few small elements keep all their stiffness (s), by the filter degree.
    pub fn stable_steps(
        sheet: &Sheet,
        lookahead: f64,
        settings: &SolverSettings,
    ) -> impl Fn(usize) -> f64 {
        let keep = without_outliers(&element_limits(sheet), settings.outliers);
        let flat = FlatSheet::new(sheet);
        move |degree| {
            let filter = MassFilter::of_sheet(sheet, ends(sheet), degree, settings);
            let fastest = flat.eigenvalue(&keep, &filter).max(f64::MIN_POSITIVE);
            (4.0 / (fastest * settings.stability_margin * (1.0 + 2.0 * lookahead))).sqrt()
        }
    }
}

/// Ends of the sheet's edges in its own order, the lower vertex first.
pub(super) fn ends(sheet: &Sheet) -> Vec<[u32; 2]> {
    let sorted = |(v, _): &([u32; 2], f64)| [v[0].min(v[1]), v[0].max(v[1])];
    sheet.edges.iter().map(sorted).collect()
}

/// Ends of edges, the lower vertex first, and lengths at rest (m); sorted by ends.
struct SortedEdges(Vec<([u32; 2], f64)>);

impl SortedEdges {
    fn new(sheet: &Sheet) -> Self {
        let lengths = sheet.edges.iter().map(|e| e.1);
        let mut all: Vec<([u32; 2], f64)> = ends(sheet).into_iter().zip(lengths).collect();
        all.sort_unstable_by_key(|e| e.0);
        Self(all)
    }
    fn ends(&self) -> Vec<[u32; 2]> {
        self.0.iter().map(|e| e.0).collect()
    }
    fn length(&self, a: u32, b: u32) -> f64 {
        let key = [a.min(b), a.max(b)];
        self.0[self.0.binary_search_by_key(&key, |k| k.0).unwrap_or(0)].1
    }
}

/// Triangles with a share `keep` of their stiffness.
fn triangles(sheet: &Sheet, keep: &[f64], edges: &SortedEdges) -> Vec<EdgeTriangle> {
    let triangle = |(e, keep): (&Element, &f64)| {
        let k = TriangleSprings::new(sheet, e)?.stiffness;
        let own = [0, 1, 2].map(|i| (k[(i, i)] * keep) as f32);
        let k = [(1, 2), (2, 0), (0, 1)].map(|i| (k[i] * keep) as f32);
        Some(EdgeTriangle {
            v: e.v,
            rest: [0, 1, 2].map(|i| edges.length(e.v[(i + 1) % 3], e.v[(i + 2) % 3]) as f32),
            k: [own[0], own[1], own[2], k[0], k[1], k[2]],
        })
    };
    let all = sheet.elements.iter().zip(keep);
    all.filter_map(triangle).collect()
}

/// Pairs of vertices with the bending stiffness between them (N/m), and hinges that are bent at rest.
type Bending = (Vec<([u32; 2], f32)>, Vec<CurvedHinge>);

/// Shares of the hinges' stiffness at which bending is stable.
fn kept_bending(
    sheet: &Sheet,
    spec: &StepSpec,
    unfiltered: &MassFilter,
    settings: &SolverSettings,
) -> Vec<f64> {
    // Forces that are kept for a time t are stable for ω t ≤ 1.
    let limit = 1.0 / (spec.h * spec.bending_interval.max(1) as f64).powi(2);
    soften(limit, &hinge_limits(sheet), settings, |k| {
        bending_eigenvalue(sheet, k, unfiltered)
    })
}

/// Bending of hinges with these shares of their stiffness; `flat`: angle of one that counts as flat (rad).
fn bending(sheet: &Sheet, keep: &[f64], edges: &SortedEdges, flat: f64) -> Bending {
    let mut pairs = BTreeMap::<[u32; 2], f64>::new();
    let mut bent = Vec::new();
    for (h, keep) in sheet.hinges.iter().zip(keep) {
        let w = h.w * keep;
        let size = h.c.iter().map(|c| c.abs()).sum::<f64>();
        if h.rest > flat * size * edges.length(h.v[0], h.v[1]) {
            bent.push(CurvedHinge {
                v: h.v,
                c: h.c.map(|c| c as f32),
                w: w as f32,
                rest: h.rest as f32,
            });
            continue;
        }
        for i in 0..4 {
            for j in 0..i {
                let key = [h.v[i].min(h.v[j]), h.v[i].max(h.v[j])];
                *pairs.entry(key).or_default() += w * h.c[i] * h.c[j];
            }
        }
    }
    let pairs = pairs.into_iter().map(|(v, w)| (v, w as f32));
    (pairs.collect(), bent)
}
