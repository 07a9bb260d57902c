//! Barrier through the one derivative checker: every region, mollified, with thickness; projection against eigenvalues.

use super::*;
use crate::contact::pair::{ActivePair, ContactPair};
use nalgebra::DMatrix;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};
use tryon_geometry::math::{ElementEnergy, V3d, project_psd};

const BARRIER: Barrier = Barrier {
    stiffness: 3.0,
    activation: 0.5,
    thickness: 0.1,
};

const PAIRS: [ContactPair; 2] = [
    ContactPair::VertexFace { v: 0, f: [1, 2, 3] },
    ContactPair::EdgeEdge {
        a: [0, 1],
        b: [2, 3],
    },
];

fn corners(x: &[f64]) -> [V3d; 4] {
    std::array::from_fn(|k| V3d::from_column_slice(&x[3 * k..3 * k + 3]))
}

fn active(pair: ContactPair, weight: f64) -> ActivePair {
    // A threshold at which about half of the random edge pairs are mollified.
    let parallel_threshold = 0.3;
    ActivePair {
        pair,
        weight,
        parallel_threshold,
    }
}

fn derivatives(e: &ElementEnergy<12>) -> Derivatives {
    Derivatives::energy(e.value, e.gradient.as_slice().to_vec())
        .with_hessian(DMatrix::from_column_slice(12, 12, e.hessian.as_slice()))
}

/// Random stencils within reach whose features stay the same over the steps of a central difference.
fn points(pair: ContactPair) -> Vec<Vec<f64>> {
    let mut rng = Pcg64Mcg::seed_from_u64(21);
    let mut random = move || -> Vec<f64> { (0..12).map(|_| rng.random_range(-0.6..0.6)).collect() };
    let shifts: Vec<Vec<f64>> = (0..12).map(|_| random()).collect();
    let steady = |x: &Vec<f64>| {
        let here = pair.separation(&corners(x));
        (0.0144..0.3).contains(&here.squared)
            && shifts.iter().all(|shift| {
                let near: Vec<f64> = x.iter().zip(shift).map(|(x, s)| x + 1e-3 * s).collect();
                pair.separation(&corners(&near)).features == here.features
            })
    };
    std::iter::repeat_with(random)
        .filter(steady)
        .take(60)
        .collect()
}

fn energy(pair: ContactPair, x: &[f64], weight: f64, curvature: Curvature) -> ElementEnergy<12> {
    let found = BARRIER.energy(&active(pair, weight), &corners(x), curvature);
    found.expect("within reach")
}

#[test]
fn barrier_derivatives_in_every_region() {
    let check = DerivativeCheck {
        step: 1e-6,
        tolerance: 1e-5,
        floor: 1e-6,
    };
    for pair in PAIRS {
        check.run(&points(pair), |x, w| {
            let e = energy(pair, x, w, Curvature::Exact);
            let value = BARRIER.value(&active(pair, w), &corners(x));
            assert!((value - e.value).abs() <= 1e-14 * value);
            derivatives(&e)
        });
    }
}

#[test]
fn projected_hessians_are_semi_definite_and_not_below_the_exact() {
    for pair in PAIRS {
        for x in points(pair) {
            let exact = energy(pair, &x, 1.0, Curvature::Exact);
            let size = exact.hessian.norm();
            let e = energy(pair, &x, 1.0, Curvature::Projected);
            assert!((e.value - exact.value).abs() < 1e-12 * exact.value);
            let error = (e.gradient - exact.gradient).norm();
            assert!(error < 1e-10 * exact.gradient.norm(), "{error:e}");
            assert!(e.hessian.symmetric_eigenvalues().min() > -1e-10 * size);
            let projected = e.hessian;
            let lowest = (projected - exact.hessian).symmetric_eigenvalues().min();
            assert!(lowest > -1e-9 * size, "{pair:?} {lowest:e} of {size:e}");
            // The nearest semi-definite matrix, for the size of the excess.
            let nearest = project_psd(&exact.hessian);
            let excess = (projected - nearest).norm() / nearest.norm();
            assert!(excess < 1.0, "{pair:?} {excess}");
        }
    }
}

#[test]
fn barrier_ends_at_its_reach_and_grows_without_bound() {
    let at = |d: f64| BARRIER.sample(d * d);
    assert_eq!(at(0.6), BarrierSample::default());
    let near_end = at(0.6 - 1e-5);
    assert!(near_end.value < 1e-9 && near_end.first.abs() < 1e-6 && near_end.second < 1e-1);
    assert!(at(0.1 + 1e-12).value > 20.0 * BARRIER.stiffness);
    assert_eq!(at(0.1).value, f64::INFINITY);
    assert_eq!(at(0.0).first, 0.0);
    // Convex and falling over its whole range.
    for k in 1..1000 {
        let s = at(0.1 + 0.5 * k as f64 / 1000.0);
        assert!(s.first < 0.0 && s.second > 0.0, "{k}");
    }
}

#[test]
fn stencils_outside_of_the_domain_stay_finite_or_say_infinity() {
    let touching = corners(&[0.0; 12]);
    for pair in PAIRS {
        let e = BARRIER.energy(&active(pair, 1.0), &touching, Curvature::Projected);
        let e = e.expect("within reach");
        assert!(e.value.is_infinite() && e.gradient.norm() == 0.0);
        let far = touching.map(|p| p).map(|p| p + V3d::x());
        let far = [far[0] * 3.0, far[1], far[2], far[3]];
        if !matches!(pair, ContactPair::EdgeEdge { .. }) {
            assert!(
                BARRIER
                    .energy(&active(pair, 1.0), &far, Curvature::Projected)
                    .is_none()
            );
        }
    }
    // Parallel edges, one over the other.
    let above = corners(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.2, 0.3, 0.0, 1.2, 0.3, 0.0]);
    let e = BARRIER.energy(&active(PAIRS[1], 1.0), &above, Curvature::Projected);
    let e = e.expect("within reach");
    assert!(e.value == 0.0 && e.gradient.norm() < 1e-12 && e.hessian.iter().all(|h| h.is_finite()));
}
