//! Preconditioned conjugate gradients on three-vectors: matrix-free.

use super::Preconditioner;
use crate::par::{Par, for_chunks, map_into};
use nalgebra::Vector3;

/// Report of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CgReport {
    /// Products with the matrix.
    pub iterations: usize,
    /// Final ‖b − A x‖ / ‖b‖.
    pub relative_residual: f64,
}

/// End of an iteration, by what comes first, and its threads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgSettings {
    /// Measure and its largest value.
    pub accuracy: CgAccuracy,
    /// Most products with the matrix.
    pub iterations: usize,
    /// Threads; the bits do not depend on them.
    pub par: Par,
}

/// Measure of a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CgAccuracy {
    /// Relative residual ‖b − A x‖ / ‖b‖.
    Residual(f64),
    /// Share of the decrease of ½ xᵀA x − bᵀx so far that as many products at the pace of the last one would add (Nash and
    /// Sofer 1990, truncated Newton methods). Soft modes, whose residual is small, count by what they move.
    Decrease(f64),
}

/// Progress of an iteration.
#[derive(Clone, Copy, Debug)]
struct CgProgress {
    products: usize,
    relative_residual: f64,
    /// Decrease of ½ xᵀA x − bᵀx so far, and by the last product.
    decrease: f64,
    last: f64,
}

impl CgAccuracy {
    fn is_reached(self, at: &CgProgress) -> bool {
        match self {
            Self::Residual(least) => at.relative_residual <= least,
            Self::Decrease(share) => {
                at.relative_residual == 0.0
                    || at.products > 0 && at.products as f64 * at.last <= share * at.decrease
            }
        }
    }
}

/// Solves `A x = b` from the initial `x` with a preconditioner.
/// A search direction without positive curvature ends the iteration at the current `x`.
pub fn conjugate_gradient(
    mut apply: impl FnMut(&[Vector3<f64>], &mut [Vector3<f64>]),
    preconditioner: &mut impl Preconditioner,
    b: &[Vector3<f64>],
    x: &mut [Vector3<f64>],
    settings: CgSettings,
) -> CgReport {
    let par = settings.par;
    let n = b.len();
    let mut ap = vec![Vector3::zeros(); n];
    apply(x, &mut ap);
    let mut r: Vec<_> = b.iter().zip(&ap).map(|(b, a)| b - a).collect();
    let mut z = vec![Vector3::zeros(); n];
    preconditioner.apply(par, &r, &mut z);
    let mut p = z.clone();
    let norm_b = dot(par, b, b).sqrt().max(f64::MIN_POSITIVE);
    let mut rz = dot(par, &r, &z);
    let mut at = CgProgress {
        products: 0,
        relative_residual: dot(par, &r, &r).sqrt() / norm_b,
        decrease: 0.0,
        last: 0.0,
    };
    while at.products < settings.iterations && !settings.accuracy.is_reached(&at) {
        apply(&p, &mut ap);
        at.products += 1;
        let curvature = dot(par, &p, &ap);
        if !(curvature > 0.0) {
            break;
        }
        let alpha = rz / curvature;
        at.last = 0.5 * alpha * rz;
        at.decrease += at.last;
        combine(par, x, &p, |x, p| x + p * alpha);
        combine(par, &mut r, &ap, |r, ap| r - ap * alpha);
        preconditioner.apply(par, &r, &mut z);
        let next = dot(par, &r, &z);
        let beta = next / rz;
        rz = next;
        combine(par, &mut p, &z, |p, z| z + p * beta);
        at.relative_residual = dot(par, &r, &r).sqrt() / norm_b;
    }
    CgReport {
        iterations: at.products,
        relative_residual: at.relative_residual,
    }
}

/// Vectors that one thread takes at a time.
const CHUNK: usize = 4096;

/// Scalar product, summed chunk by chunk in a fixed order.
fn dot(par: Par, a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let mut sums = Vec::new();
    map_into(par, a.len().div_ceil(CHUNK), 1, &mut sums, |k| {
        let range = k * CHUNK..((k + 1) * CHUNK).min(a.len());
        let pairs = a[range.clone()].iter().zip(&b[range]);
        pairs.map(|(a, b)| a.dot(b)).sum::<f64>()
    });
    sums.iter().sum()
}

/// Replaces each `a` with `f(a, b)`.
fn combine(
    par: Par,
    a: &mut [Vector3<f64>],
    b: &[Vector3<f64>],
    f: impl Fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64> + Sync,
) {
    for_chunks(par, a, CHUNK, |start, chunk| {
        for (a, b) in chunk.iter_mut().zip(&b[start..]) {
            *a = f(a, b);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::BlockJacobi;
    use nalgebra::Matrix3;

    /// A chain that hangs by one end, its links pulled to and fro ten times as hard as down: the load's residual is gone
    /// after one product, its energy is in the sag.
    #[test]
    fn an_accurate_decrease_has_the_soft_modes() {
        let n = 60;
        let apply = |x: &[Vector3<f64>], y: &mut [Vector3<f64>]| {
            for i in 0..n {
                let above = if i > 0 { x[i - 1] } else { Vector3::zeros() };
                let below = if i + 1 < n { x[i + 1] } else { x[i] };
                y[i] = x[i] * 2.0 - above - below;
            }
        };
        let load = |i: usize| if i.is_multiple_of(2) { 1.1 } else { -0.9 };
        let b: Vec<_> = (0..n).map(|i| Vector3::x() * load(i)).collect();
        let decrease = |accuracy| {
            let mut x = vec![Vector3::zeros(); n];
            let settings = CgSettings {
                accuracy,
                iterations: 10 * n,
                par: Par::Seq,
            };
            let mut halves = BlockJacobi::from_inverse(vec![Matrix3::identity() / 2.0; n]);
            conjugate_gradient(apply, &mut halves, &b, &mut x, settings);
            let mut forces = vec![Vector3::zeros(); n];
            apply(&x, &mut forces);
            let at = |k: usize| (b[k] - forces[k] * 0.5).dot(&x[k]);
            (0..n).map(at).sum::<f64>()
        };
        let whole = decrease(CgAccuracy::Residual(1e-10));
        let by_residual = decrease(CgAccuracy::Residual(0.2)) / whole;
        let by_decrease = decrease(CgAccuracy::Decrease(0.2)) / whole;
        assert!(by_residual < 0.1, "{by_residual}");
        assert!(by_decrease > 0.95, "{by_decrease}");
    }

    #[test]
    fn finite_termination_on_a_path() {
        let n = 30;
        let apply = |x: &[Vector3<f64>], y: &mut [Vector3<f64>]| {
            for i in 0..n {
                y[i] = x[i] * 2.5;
                if i > 0 {
                    y[i] -= x[i - 1];
                }
                if i + 1 < n {
                    y[i] -= x[i + 1];
                }
            }
        };
        let b: Vec<_> = (0..n).map(|i| Vector3::new(1.0, i as f64, -0.5)).collect();
        let mut x = vec![Vector3::zeros(); n];
        let settings = CgSettings {
            accuracy: CgAccuracy::Residual(1e-12),
            iterations: 3 * n,
            par: Par::Seq,
        };
        let mut inverse = BlockJacobi::from_inverse(vec![Matrix3::identity() / 2.5; n]);
        let report = conjugate_gradient(apply, &mut inverse, &b, &mut x, settings);
        assert!(
            report.relative_residual < 1e-11 && report.iterations <= 3 * n,
            "{report:?}"
        );
        let mut back = vec![Vector3::zeros(); n];
        apply(&x, &mut back);
        assert!(b.iter().zip(&back).all(|(p, q)| (p - q).norm() < 1e-9));
    }
}
