//! Which step is stable: a bound from every element, and the largest eigenvalue of what accelerates the flat sheet.

use super::mass_filter::{Filter, noise};
use super::stable_sheet::edge_stiffness;
use crate::cloth::Sheet;
use nalgebra::{Matrix3, Matrix6, Rotation2, Vector2, Vector3, Vector6};

/// Largest eigenvalue of each element over the inertia it has at its lightest corner's share, 1/s². No eigenvalue of
/// the whole is above the largest of these (Irons and Treharne 1971).
pub(super) fn element_limits(sheet: &Sheet, springs_only: bool) -> Vec<f64> {
    let mut around = vec![0.0; sheet.mass.len()];
    for e in &sheet.elements {
        for v in e.v {
            around[v as usize] += e.area;
        }
    }
    sheet
        .elements
        .iter()
        .map(|e| {
            let Some((k, along)) = edge_stiffness(sheet, e) else {
                return 0.0;
            };
            let u: [Vector6<f64>; 3] = std::array::from_fn(|i| {
                let (a, b) = ((i + 1) % 3, (i + 2) % 3);
                let mut u = Vector6::zeros();
                for d in 0..2 {
                    u[2 * a + d] -= along[i][d];
                    u[2 * b + d] += along[i][d];
                }
                u
            });
            let mut m = Matrix6::zeros();
            for i in 0..3 {
                for j in 0..3 {
                    if i == j || !springs_only {
                        m += u[i] * u[j].transpose() * k[(i, j)];
                    }
                }
            }
            // Each corner lends the element the share of its mass that the element's area has around it.
            let share =
                e.v.map(|v| sheet.mass[v as usize] * e.area / around[v as usize]);
            let scale = Vector6::from_fn(|i, _| 1.0 / share[i / 2].sqrt());
            let scaled = Matrix6::from_fn(|i, j| m[(i, j)] * scale[i] * scale[j]);
            scaled.symmetric_eigenvalues().max()
        })
        .collect()
}

/// Shares of the elements' stiffness at which no wave is faster than `limit` (1/s²): `limits` bounds each element by
/// itself, `largest` finds the whole's eigenvalue. Only what is too stiff is softened.
pub(super) fn soften(limit: f64, limits: &[f64], largest: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    /// How often the bound is moved: by then the whole lies within a few percent of the limit.
    const ROUNDS: usize = 8;
    let mut keep = vec![1.0; limits.len()];
    let whole = largest(&keep);
    if whole <= limit {
        return keep;
    }
    // An element's own limit is careful, by a fifth without a filter and by far more with one.
    let most = limits.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let mut bound = most * (limit / whole).min(1.0);
    let mut stable = None;
    for _ in 0..ROUNDS {
        for (k, l) in keep.iter_mut().zip(limits) {
            *k = (bound / l.max(f64::MIN_POSITIVE)).min(1.0);
        }
        let now = largest(&keep);
        if now <= limit {
            stable = Some(keep.clone());
            if now > 0.96 * limit {
                break;
            }
        }
        bound *= (limit / now.max(f64::MIN_POSITIVE) * 0.985).clamp(0.3, 1.5);
    }
    stable.unwrap_or_else(|| {
        let now = largest(&keep);
        let scale = (limit / now.max(f64::MIN_POSITIVE)).min(1.0);
        keep.iter().map(|k| k * scale).collect()
    })
}

/// Largest eigenvalue of W M⁻¹K by power iteration, 1/s², where `product` adds K x to its second argument. An estimate
/// from below, by a few percent at most, which the margin covers.
pub(super) fn largest_eigenvalue(
    filter: &Filter,
    product: impl Fn(&[Vector2<f64>], &mut [Vector2<f64>]),
) -> f64 {
    /// Products; the estimate is a quotient of quadratic forms and so converges twice as fast as the vector.
    const PRODUCTS: usize = 40;
    let n = filter.inverse_mass.len();
    let mut x = noise(n);
    filter.apply(&mut x);
    let mut force = vec![Vector2::zeros(); n];
    let mut y = force.clone();
    let mut value: f64 = 0.0;
    for _ in 0..PRODUCTS {
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

/// An element's corners, stiffness between its edges, and their directions.
type Term = ([u32; 3], Matrix3<f64>, [Vector2<f64>; 3]);

/// Stiffness between an element's edges and their directions.
type Edges = (Matrix3<f64>, [Vector2<f64>; 3]);

/// The elements of a sheet laid flat.
pub(super) fn laid_flat(sheet: &Sheet) -> Vec<Term> {
    let own: Vec<Option<Edges>> = sheet
        .elements
        .iter()
        .map(|e| edge_stiffness(sheet, e))
        .collect();
    let turned = sheet.elements.iter().zip(&own).zip(frames(sheet, &own));
    turned
        .map(|((e, own), turn)| match own {
            Some((k, along)) => (e.v, *k, along.map(|a| turn * a)),
            None => (e.v, Matrix3::zeros(), [Vector2::zeros(); 3]),
        })
        .collect()
}

/// The same for the membrane of the sheet laid flat; `keep` is the share of its stiffness that each element has.
pub(super) fn membrane_eigenvalue(
    flat: &[Term],
    keep: &[f64],
    springs_only: bool,
    filter: &Filter,
) -> f64 {
    largest_eigenvalue(filter, |x, y| {
        for ((v, k, along), keep) in flat.iter().zip(keep) {
            let p = v.map(|v| x[v as usize]);
            let d = Vector3::from_fn(|i, _| along[i].dot(&(p[(i + 2) % 3] - p[(i + 1) % 3])));
            let t = if springs_only {
                k.diagonal().component_mul(&d)
            } else {
                k * d
            } * *keep;
            let pull: [Vector2<f64>; 3] = std::array::from_fn(|i| along[i] * t[i]);
            // Edge i runs from corner i + 1 to corner i + 2.
            for i in 0..3 {
                y[v[i] as usize] += pull[(i + 1) % 3] - pull[(i + 2) % 3];
            }
        }
    })
}

/// Rotations that lay all elements into one plane, neighbour by neighbour: each has its rest shape in a frame of its
/// own. Where a sheet closes around a body or a seam joins what does not fit, some neighbours stay turned.
fn frames(sheet: &Sheet, own: &[Option<Edges>]) -> Vec<Rotation2<f64>> {
    let all = &sheet.elements;
    let corner = |e: usize, i: usize| all[e].v[(i + 1) % 3].min(all[e].v[(i + 2) % 3]);
    let other = |e: usize, i: usize| all[e].v[(i + 1) % 3].max(all[e].v[(i + 2) % 3]);
    let mut edges: Vec<([u32; 2], usize, usize)> = (0..all.len())
        .flat_map(|e| (0..3).map(move |i| (e, i)))
        .map(|(e, i)| ([corner(e, i), other(e, i)], e, i))
        .collect();
    edges.sort_unstable();
    // Direction of edge `i` of an element from its lower to its higher vertex.
    let toward = |e: usize, i: usize| {
        let (_, along) = own[e]?;
        Some(if all[e].v[(i + 1) % 3] < all[e].v[(i + 2) % 3] {
            along[i]
        } else {
            -along[i]
        })
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
                let key = [corner(e, i), other(e, i)];
                let from = edges.partition_point(|x| x.0 < key);
                for &(_, f, j) in edges[from..].iter().take_while(|x| x.0 == key) {
                    let (None, Some(a), Some(b)) = (turn[f], toward(e, i), toward(f, j)) else {
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

/// The same for bending, which acts across the sheet. Without a filter, as held vertices would undo what it gains.
pub(super) fn bending_eigenvalue(sheet: &Sheet, keep: &[f64], filter: &Filter) -> f64 {
    largest_eigenvalue(filter, |x, y| {
        for (h, keep) in sheet.hinges.iter().zip(keep) {
            let q = (0..4).fold(Vector2::zeros(), |q, k| q + x[h.v[k] as usize] * h.c[k])
                * (h.w * keep);
            for k in 0..4 {
                y[h.v[k] as usize] += q * h.c[k];
            }
        }
    })
}
