//! Stability limits of explicit steps: a bound for every element, and the largest eigenvalue of the flat sheet.

use super::edge_stiffness::TriangleSprings;
use super::mass_filter::{MassFilter, noise};
use crate::live::{Element, Hinge, Sheet};
use crate::settings::SolverSettings;
use nalgebra::{Matrix6, Rotation2, Vector2, Vector3, Vector6};

/// Iterations of [`soften`]: enough for an eigenvalue within a few percent of the limit.
const SOFTEN_ITERATIONS: usize = 8;
/// Iterations of the power method. A Rayleigh quotient converges twice as fast as its vector: a few percent are left.
const POWER_ITERATIONS: usize = 40;

/// Largest eigenvalue of each element over the mass at its corners [1/s²]. No eigenvalue of the sheet is above the
/// largest of these (Irons and Treharne 1971).
pub(super) fn element_limits(sheet: &Sheet) -> Vec<f64> {
    let mut area = vec![0.0; sheet.mass.len()];
    for e in &sheet.elements {
        for v in e.v {
            area[v as usize] += e.area;
        }
    }
    let limit = |e: &Element| {
        let springs = TriangleSprings::new(sheet, e)?;
        // Each corner lends the element its mass in proportion to the element's area around it.
        let mass =
            e.v.map(|v| sheet.mass[v as usize] * e.area / area[v as usize]);
        Some(element_limit(&springs, mass))
    };
    let all = sheet.elements.iter();
    all.map(|e| limit(e).unwrap_or(0.0)).collect()
}

fn element_limit(springs: &TriangleSprings, mass: [f64; 3]) -> f64 {
    let u: [Vector6<f64>; 3] = std::array::from_fn(|i| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let mut u = Vector6::zeros();
        for d in 0..2 {
            u[2 * a + d] -= springs.directions[i][d];
            u[2 * b + d] += springs.directions[i][d];
        }
        u
    });
    let mut m = Matrix6::zeros();
    for i in 0..3 {
        for j in 0..3 {
            m += u[i] * u[j].transpose() * springs.stiffness[(i, j)];
        }
    }
    let scale = Vector6::from_fn(|i, _| 1.0 / mass[i / 2].sqrt());
    let scaled = Matrix6::from_fn(|i, j| m[(i, j)] * scale[i] * scale[j]);
    scaled.symmetric_eigenvalues().max()
}

/// Largest bending stiffness over mass at the vertices of each hinge [1/s²]; a hinge adds at most w|c|².
pub(super) fn hinge_limits(sheet: &Sheet) -> Vec<f64> {
    let mut at_vertex = vec![0.0; sheet.mass.len()];
    for h in &sheet.hinges {
        let size = h.w * h.c.iter().map(|c| c * c).sum::<f64>();
        h.v.iter()
            .for_each(|v| at_vertex[*v as usize] += size / sheet.mass[*v as usize]);
    }
    let worst = |h: &Hinge| {
        let all = h.v.iter().map(|v| at_vertex[*v as usize]);
        all.fold(f64::MIN_POSITIVE, f64::max)
    };
    sheet.hinges.iter().map(worst).collect()
}

/// Shares of stiffness that bring the outliers among `limits`, a share of them, down to all others.
pub(super) fn without_outliers(limits: &[f64], outliers: f64) -> Vec<f64> {
    let mut all = limits.to_vec();
    all.sort_unstable_by(f64::total_cmp);
    let n = all.len().max(1);
    let rank = ((n as f64 * (1.0 - outliers)) as usize).min(n - 1);
    let usual = all.get(rank).copied().unwrap_or(1.0);
    limits
        .iter()
        .map(|l| (usual / l.max(f64::MIN_POSITIVE)).min(1.0))
        .collect()
}

/// Shares of the elements' stiffness at which no mode is faster than `limit` [1/s²]. `limits` bounds each element by
/// itself, `largest` returns the eigenvalue of the whole. Only elements that are too stiff are softened.
pub(super) fn soften(
    limit: f64,
    limits: &[f64],
    settings: &SolverSettings,
    largest: impl Fn(&[f64]) -> f64,
) -> Vec<f64> {
    let mut keep = vec![1.0; limits.len()];
    let whole = largest(&keep);
    if whole <= limit {
        return keep;
    }
    // An element's own limit is conservative, by a fifth without a filter and by far more with one.
    let most = limits.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let mut bound = most * (limit / whole).min(1.0);
    let mut stable = None;
    for _ in 0..SOFTEN_ITERATIONS {
        for (k, l) in keep.iter_mut().zip(limits) {
            *k = (bound / l.max(f64::MIN_POSITIVE)).min(1.0);
        }
        let now = largest(&keep);
        if now <= limit {
            stable = Some(keep.clone());
            if now > settings.near_limit * limit {
                break;
            }
        }
        let correction = limit / now.max(f64::MIN_POSITIVE) * settings.relaxation;
        bound *= correction.clamp(settings.correction[0], settings.correction[1]);
    }
    stable.unwrap_or_else(|| {
        let now = largest(&keep);
        let scale = (limit / now.max(f64::MIN_POSITIVE)).min(1.0);
        keep.iter().map(|k| k * scale).collect()
    })
}

/// Largest eigenvalue of W M⁻¹K by power iteration [1/s²], where `product` adds K x to its second argument. A lower
/// bound, by a few percent at most.
fn largest_eigenvalue(
    filter: &MassFilter,
    product: impl Fn(&[Vector2<f64>], &mut [Vector2<f64>]),
) -> f64 {
    let n = filter.inverse_mass.len();
    let mut x = noise(n);
    filter.apply(&mut x);
    let mut force = vec![Vector2::zeros(); n];
    let mut y = force.clone();
    let mut value: f64 = 0.0;
    for _ in 0..POWER_ITERATIONS {
        force.fill(Vector2::zeros());
        product(&x, &mut force);
        for i in 0..n {
            y[i] = force[i] * filter.inverse_mass[i];
        }
        filter.apply(&mut y);
        let (mut work, mut energy, mut norm) = (0.0, 0.0, 0.0);
        for i in 0..n {
            work += force[i].dot(&y[i]);
            energy += force[i].dot(&x[i]);
            norm += y[i].norm_squared() / filter.inverse_mass[i];
        }
        if !(energy > 0.0 && norm > 0.0) {
            return value;
        }
        value = value.max(work / energy);
        let scale = 1.0 / norm.sqrt();
        x.iter_mut().zip(&y).for_each(|(x, y)| *x = y * scale);
    }
    value
}

/// Springs of a sheet that is laid flat, `None` for elements without area.
pub(super) struct FlatSheet(Vec<Option<TriangleSprings>>);

impl FlatSheet {
    pub(super) fn new(sheet: &Sheet) -> Self {
        let of = |e| TriangleSprings::new(sheet, e);
        let mut all: Vec<Option<TriangleSprings>> = sheet.elements.iter().map(of).collect();
        let turns = unfold(sheet, &all);
        for (springs, turn) in all.iter_mut().zip(turns) {
            if let Some(s) = springs {
                s.directions = s.directions.map(|d| turn * d);
            }
        }
        Self(all)
    }
    /// Largest eigenvalue of the filtered membrane [1/s²], where each element has a share `keep` of its stiffness.
    pub(super) fn eigenvalue(&self, keep: &[f64], filter: &MassFilter) -> f64 {
        largest_eigenvalue(filter, |x, y| {
            for (springs, keep) in self.0.iter().zip(keep) {
                let Some(s) = springs else { continue };
                let p = s.v.map(|v| x[v as usize]);
                let d = Vector3::from_fn(|i, _| {
                    s.directions[i].dot(&(p[(i + 2) % 3] - p[(i + 1) % 3]))
                });
                let t = s.stiffness * d * *keep;
                let pull: [Vector2<f64>; 3] = std::array::from_fn(|i| s.directions[i] * t[i]);
                // Edge i runs from corner i + 1 to corner i + 2.
                for i in 0..3 {
                    y[s.v[i] as usize] += pull[(i + 1) % 3] - pull[(i + 2) % 3];
                }
            }
        })
    }
}

/// Largest eigenvalue of bending across the flat sheet [1/s²]. Unfiltered: held vertices undo the gain of a filter.
pub(super) fn bending_eigenvalue(sheet: &Sheet, keep: &[f64], unfiltered: &MassFilter) -> f64 {
    largest_eigenvalue(unfiltered, |x, y| {
        for (h, keep) in sheet.hinges.iter().zip(keep) {
            let q = (0..4).fold(Vector2::zeros(), |q, k| q + x[h.v[k] as usize] * h.c[k])
                * (h.w * keep);
            for k in 0..4 {
                y[h.v[k] as usize] += q * h.c[k];
            }
        }
    })
}

/// Rotations that lay all elements into one plane, neighbour by neighbour: each has its rest shape in its own frame.
/// Some neighbours of a closed sheet, or of a seam whose sides do not fit, stay rotated against each other.
fn unfold(sheet: &Sheet, own: &[Option<TriangleSprings>]) -> Vec<Rotation2<f64>> {
    let all = &sheet.elements;
    let ends = |e: usize, i: usize| {
        let [a, b] = [all[e].v[(i + 1) % 3], all[e].v[(i + 2) % 3]];
        [a.min(b), a.max(b)]
    };
    let mut edges: Vec<([u32; 2], usize, usize)> = (0..all.len())
        .flat_map(|e| (0..3).map(move |i| (e, i)))
        .map(|(e, i)| (ends(e, i), e, i))
        .collect();
    edges.sort_unstable();
    // Direction of edge `i` of an element from its lower to its higher vertex.
    let direction = |e: usize, i: usize| {
        let d = own[e].as_ref()?.directions[i];
        let rising = all[e].v[(i + 1) % 3] < all[e].v[(i + 2) % 3];
        Some(if rising { d } else { -d })
    };
    let mut turn: Vec<Option<Rotation2<f64>>> = vec![None; all.len()];
    for start in 0..all.len() {
        if turn[start].is_some() {
            continue;
        }
        turn[start] = Some(Rotation2::identity());
        let mut queue = std::collections::VecDeque::from([start]);
        while let Some(e) = queue.pop_front() {
            let here = turn[e].unwrap_or_else(Rotation2::identity);
            for i in 0..3 {
                let key = ends(e, i);
                let from = edges.partition_point(|x| x.0 < key);
                for &(_, f, j) in edges[from..].iter().take_while(|x| x.0 == key) {
                    let (None, Some(a), Some(b)) = (turn[f], direction(e, i), direction(f, j))
                    else {
                        continue;
                    };
                    turn[f] = Some(Rotation2::rotation_between(&b, &(here * a)));
                    queue.push_back(f);
                }
            }
        }
    }
    turn.into_iter()
        .map(|t| t.unwrap_or_else(Rotation2::identity))
        .collect()
}
