//! A sheet as stiffness between the edges of its triangles, fitted to a step.

use super::fold_limit::{Diagonal, diagonals};
use super::mass_filter::Filter;
use super::stability::{
    bending_eigenvalue, element_limits, laid_flat, membrane_eigenvalue, soften,
};
use crate::cloth::{Element, Sheet};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// How a sheet is fitted to a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepSpec {
    /// The step it shall be stable at, s.
    pub h: f64,
    /// How far ahead of positions forces are evaluated, in steps: damps what changes within few steps, by its square.
    pub ahead: f64,
    /// Only the edges' own stiffness: the paper's mass-spring model.
    pub springs_only: bool,
    /// Steps from one evaluation of bending to the next.
    pub bend_every: usize,
    /// Degree of the smoothing of accelerations: 0 is none, each more allows about as many times longer steps as it
    /// is high, and makes the finest waves slower (not softer).
    pub smooth: usize,
}

/// A triangle: its corners, lengths of its edges at rest (each opposite the corner of its number), and stiffness between
/// their lengthenings, N/m: 00, 11, 22, 12, 20, 01.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Triangle {
    pub(super) v: [u32; 3],
    pub(super) rest: [f32; 3],
    pub(super) k: [f32; 6],
}

/// A hinge that is bent at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bent {
    pub(super) v: [u32; 4],
    pub(super) c: [f32; 4],
    /// Stiffness, N/m.
    pub(super) w: f32,
    /// Length of Σ cₖ xₖ at rest.
    pub(super) rest: f32,
}

/// Immutable. Arrays over vertices and over edges, the latter sorted by their ends.
#[derive(Clone, Debug)]
pub struct StableSheet {
    /// Share of the membrane stiffness that is kept, mean over the area; less than 1 where the step is too long.
    pub softened: f64,
    /// Elements that keep less than 99 %.
    pub soft_elements: usize,
    pub(super) inverse_mass: Vec<f32>,
    pub(super) ends: Vec<[u32; 2]>,
    pub(super) rest: Vec<f32>,
    pub(super) triangles: Vec<Triangle>,
    /// Vertex pairs and the stiffness of bending between them, N/m.
    pub(super) bend: Vec<([u32; 2], f32)>,
    pub(super) bent: Vec<Bent>,
    pub(super) diagonals: Vec<Diagonal>,
    /// Weight of each edge in the smoothing of accelerations, kg.
    pub(super) smooth: Vec<f32>,
    /// Coefficients of the smoothing, the lowest (1) first.
    pub(super) smoothing: Vec<f32>,
    pub(super) damping: f32,
}

/// Room between the step and the stability limit (ratio of eigenvalues): folds and strain turn and stiffen elements, and
/// the eigenvalue is an estimate from below. With 1.12 a crumpled square on the sphere exploded, with 1.2 none did.
const MARGIN: f64 = 1.3;
/// Elements that may be too stiff for a step that still counts as comfortable (share).
const FEW: f64 = 0.05;

/// Hooke's law of a triangle as stiffness between lengthenings of its edges (edge k is opposite corner k), N/m, and the
/// unit directions of these edges at rest.
pub(super) fn edge_stiffness(
    sheet: &Sheet,
    e: &Element,
) -> Option<(Matrix3<f64>, [Vector2<f64>; 3])> {
    let d = Matrix2::new(e.b[1][0], e.b[1][1], e.b[2][0], e.b[2][1]);
    let r = d.try_inverse()?;
    let (p, q) = (r.column(0).into_owned(), r.column(1).into_owned());
    let edges = [q - p, -q, p];
    let length = edges.map(|e| e.norm());
    // Lengthening of edge i from the strain (xx, yy, xy): rᵀEr / |r|.
    let g = Matrix3::from_fn(|i, j| {
        let [x, y] = [edges[i].x, edges[i].y];
        [x * x, y * y, 2.0 * x * y][j] / length[i]
    });
    let m = &sheet.membrane;
    let plane = 2.0 * m.mu + m.lambda;
    let hooke = Matrix3::new(
        plane + m.along[0],
        m.lambda,
        0.0,
        m.lambda,
        plane + m.along[1],
        0.0,
        0.0,
        0.0,
        4.0 * m.mu,
    );
    let inverse = g.try_inverse()?;
    let directions = std::array::from_fn(|i| edges[i] / length[i]);
    Some((inverse.transpose() * hooke * inverse * e.area, directions))
}

/// Corners, stiffness between the lengthenings of the edges (edge k is opposite corner k, N/m) and rest lengths of every
/// triangle.
pub fn triangles(sheet: &Sheet) -> Vec<([u32; 3], Matrix3<f64>, [f64; 3])> {
    let of = |e: &Element| {
        let r = Matrix2::new(e.b[1][0], e.b[1][1], e.b[2][0], e.b[2][1]).try_inverse()?;
        let (p, q) = (r.column(0).into_owned(), r.column(1).into_owned());
        Some((
            e.v,
            edge_stiffness(sheet, e)?.0,
            [(q - p).norm(), q.norm(), p.norm()],
        ))
    };
    sheet.elements.iter().filter_map(of).collect()
}

impl StableSheet {
    /// Compiles a sheet for a step size.
    pub fn new(sheet: &Sheet, fit: &StepSpec) -> Self {
        let mut edges: Vec<([u32; 2], f64)> = sheet
            .edges
            .iter()
            .map(|(v, l)| ([v[0].min(v[1]), v[0].max(v[1])], *l))
            .collect();
        edges.sort_unstable_by_key(|e| e.0);
        let find = |a: u32, b: u32| {
            edges
                .binary_search_by_key(&[a.min(b), a.max(b)], |k| k.0)
                .unwrap_or(0)
        };
        // How much stiffness per inertia the step can carry: symplectic Euler ends at 4/h², looking ahead costs.
        let limit = 4.0 / (fit.h * fit.h * (1.0 + 2.0 * fit.ahead) * MARGIN);
        let filter = filter(sheet, edges.iter().map(|e| e.0).collect(), fit.smooth);
        let limits = element_limits(sheet, fit.springs_only);
        let flat = laid_flat(sheet);
        let keep = soften(limit, &limits, |k| {
            membrane_eigenvalue(&flat, k, fit.springs_only, &filter)
        });
        let area: f64 = sheet.elements.iter().map(|e| e.area).sum();
        let triangle = |(e, keep): (&Element, &f64)| {
            let (k, _) = edge_stiffness(sheet, e)?;
            let between = if fit.springs_only { 0.0 } else { *keep };
            let rest = |i: usize| edges[find(e.v[(i + 1) % 3], e.v[(i + 2) % 3])].1 as f32;
            let own = [0, 1, 2].map(|i| (k[(i, i)] * keep) as f32);
            let k = [(1, 2), (2, 0), (0, 1)].map(|i| (k[i] * between) as f32);
            Some(Triangle {
                v: e.v,
                rest: [rest(0), rest(1), rest(2)],
                k: [own[0], own[1], own[2], k[0], k[1], k[2]],
            })
        };
        let triangles = sheet
            .elements
            .iter()
            .zip(&keep)
            .filter_map(triangle)
            .collect();
        let mut bending = std::collections::BTreeMap::<[u32; 2], f64>::new();
        let mut bent = Vec::new();
        // Bending is kept for several steps: its own limit is ω·(that time) ≤ 1.
        let bend_limit = 1.0 / (fit.h * fit.bend_every.max(1) as f64).powi(2);
        let stiff = hinge_limits(sheet);
        let length = |a: u32, b: u32| edges[find(a, b)].1;
        let plain = filter.without();
        let bend_keep = soften(bend_limit, &stiff, |k| bending_eigenvalue(sheet, k, &plain));
        for (h, keep) in sheet.hinges.iter().zip(&bend_keep) {
            let w = h.w * keep;
            if h.rest > FLAT * h.c.iter().map(|c| c.abs()).sum::<f64>() * length(h.v[0], h.v[1]) {
                bent.push(Bent {
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
                    *bending.entry(key).or_default() += w * h.c[i] * h.c[j];
                }
            }
        }
        Self {
            softened: sheet
                .elements
                .iter()
                .zip(&keep)
                .map(|(e, k)| e.area * k)
                .sum::<f64>()
                / area.max(f64::MIN_POSITIVE),
            soft_elements: keep.iter().filter(|k| **k < 0.99).count(),
            inverse_mass: sheet.mass.iter().map(|m| (1.0 / m) as f32).collect(),
            ends: edges.iter().map(|e| e.0).collect(),
            rest: edges.iter().map(|e| e.1 as f32).collect(),
            triangles,
            bend: bending.into_iter().map(|(v, w)| (v, w as f32)).collect(),
            bent,
            diagonals: diagonals(sheet)
                .map(|(ends, flat)| Diagonal {
                    ends,
                    flat: flat as f32,
                })
                .collect(),
            smooth: filter.weight.iter().map(|w| *w as f32).collect(),
            smoothing: filter.w.iter().map(|c| *c as f32).collect(),
            damping: sheet.damping as f32,
        }
    }
    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.inverse_mass.len()
    }
    /// The lowest degree of smoothing with a step of at least `enough` seconds, or the highest, and that step, s.
    pub fn choose_filter(sheet: &Sheet, ahead: f64, enough: f64) -> (usize, f64) {
        let step = Self::stable_steps(sheet, ahead);
        let mut found = (0, step(0));
        while found.1 < enough && found.0 < HIGHEST {
            found = (found.0 + 1, step(found.0 + 1));
        }
        found
    }
    /// Small steps of `h` seconds that bending forces may be kept for: as many as all but a few small hinges allow with all
    /// their stiffness, within `KEPT`.
    pub fn bending_interval(sheet: &Sheet, h: f64) -> usize {
        let limits = hinge_limits(sheet);
        let usual = usual(&limits);
        let keep: Vec<f64> = limits.iter().map(|l| (usual / l).min(1.0)).collect();
        let plain = filter(sheet, sheet.edges.iter().map(|e| e.0).collect(), 0);
        let fastest = bending_eigenvalue(sheet, &keep, &plain)
            .max(f64::MIN_POSITIVE)
            .sqrt();
        ((1.0 / (fastest * h)) as usize).clamp(KEPT[0], KEPT[1])
    }
    /// Longest step at which all but a few small elements keep all their stiffness, s.
    pub fn stable_step(sheet: &Sheet, ahead: f64, smooth: usize) -> f64 {
        Self::stable_steps(sheet, ahead)(smooth)
    }
    /// [`Self::stable_step`] of any degree of smoothing.
    pub fn stable_steps(sheet: &Sheet, ahead: f64) -> impl Fn(usize) -> f64 {
        let limits = element_limits(sheet, false);
        let usual = usual(&limits);
        let keep: Vec<f64> = limits
            .iter()
            .map(|l| (usual / l.max(f64::MIN_POSITIVE)).min(1.0))
            .collect();
        let flat = laid_flat(sheet);
        move |smooth| {
            let ends = sheet
                .edges
                .iter()
                .map(|(v, _)| [v[0].min(v[1]), v[0].max(v[1])])
                .collect();
            let fastest = membrane_eigenvalue(&flat, &keep, false, &filter(sheet, ends, smooth));
            (4.0 / (fastest.max(f64::MIN_POSITIVE) * MARGIN * (1.0 + 2.0 * ahead))).sqrt()
        }
    }
}

/// What all but a few do not exceed.
fn usual(limits: &[f64]) -> f64 {
    let mut all = limits.to_vec();
    all.sort_unstable_by(f64::total_cmp);
    let n = all.len().max(1);
    all.get(((n as f64 * (1.0 - FEW)) as usize).min(n - 1))
        .copied()
        .unwrap_or(1.0)
}

/// For each hinge the most that one of its vertices has to bear of bending over its mass, 1/s²: a hinge's share of that is
/// bounded by w|c|².
fn hinge_limits(sheet: &Sheet) -> Vec<f64> {
    let mut borne = vec![0.0; sheet.mass.len()];
    for h in &sheet.hinges {
        let size = h.w * h.c.iter().map(|c| c * c).sum::<f64>();
        h.v.iter()
            .for_each(|v| borne[*v as usize] += size / sheet.mass[*v as usize]);
    }
    let worst = |h: &crate::cloth::Hinge| {
        h.v.iter()
            .map(|v| borne[*v as usize])
            .fold(f64::MIN_POSITIVE, f64::max)
    };
    sheet.hinges.iter().map(worst).collect()
}

/// A hinge is flat if it is bent by less at rest, rad: what rounding of coordinates makes of a flat sheet.
const FLAT: f64 = 1e-4;
/// Fewest and most steps that bending is kept for: fewer cost more than the stiffness of a few narrow hinges is worth, more
/// gain little.
const KEPT: [usize; 2] = [3, 6];
/// The highest degree: a third one gains another quarter and costs as much.
const HIGHEST: usize = 2;

/// The filter of a sheet, with the edges' own stiffness as weights.
pub(super) fn filter(sheet: &Sheet, ends: Vec<[u32; 2]>, degree: usize) -> Filter {
    let mut order: Vec<([u32; 2], usize)> = ends.iter().enumerate().map(|(i, e)| (*e, i)).collect();
    order.sort_unstable();
    let mut own = vec![0.0; ends.len()];
    for e in &sheet.elements {
        let Some((k, _)) = edge_stiffness(sheet, e) else {
            continue;
        };
        for i in 0..3 {
            let (a, b) = (e.v[(i + 1) % 3], e.v[(i + 2) % 3]);
            if let Ok(at) = order.binary_search_by_key(&[a.min(b), a.max(b)], |o| o.0) {
                own[order[at].1] += k[(i, i)];
            }
        }
    }
    Filter::new(
        ends,
        &own,
        sheet.mass.iter().map(|m| 1.0 / m).collect(),
        degree,
    )
}
