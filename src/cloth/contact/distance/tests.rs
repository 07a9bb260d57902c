//! Derivatives through the one checker, values against exact integers and brute force, degenerate and invariant inputs.

use super::*;
use nalgebra::DMatrix;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};
use tryon_geometry::math::{ElementEnergy, V3d};

type Corners = [V3d; 4];

fn corners(x: &[f64]) -> Corners {
    std::array::from_fn(|k| V3d::from_column_slice(&x[3 * k..3 * k + 3]))
}

fn unknowns(x: &Corners) -> Vec<f64> {
    x.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
}

fn triangle([p, a, b, c]: &Corners) -> Separation<4> {
    point_triangle(p, [a, b, c])
}

fn edges([a0, a1, b0, b1]: &Corners) -> Separation<4> {
    edge_edge([a0, a1], [b0, b1])
}

const STENCILS: [fn(&Corners) -> Separation<4>; 2] = [triangle, edges];

fn derivatives<const N: usize>(e: &ElementEnergy<N>, weight: f64) -> Derivatives {
    Derivatives::energy(weight * e.value, (e.gradient * weight).as_slice().to_vec())
        .with_hessian(DMatrix::from_column_slice(N, N, e.hessian.as_slice()) * weight)
}

fn random(rng: &mut Pcg64Mcg) -> Corners {
    std::array::from_fn(|_| V3d::from_fn(|_, _| rng.random_range(-1.0..1.0)))
}

/// Random stencils whose features stay the same over the steps of a central difference.
fn smooth_points(of: fn(&Corners) -> Separation<4>) -> Vec<Vec<f64>> {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let candidates = std::iter::repeat_with(|| random(&mut rng)).take(120);
    let steady = |x: &Corners| {
        let features = of(x).features;
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        (0..20).all(|_| {
            let moved = random(&mut rng);
            let near: Corners = std::array::from_fn(|k| x[k] + moved[k] * 1e-3);
            of(&near).features == features
        })
    };
    candidates.filter(steady).map(|x| unknowns(&x)).collect()
}

#[test]
fn derivatives_in_every_region() {
    for of in STENCILS {
        let points = smooth_points(of);
        let kinds = |n| {
            points
                .iter()
                .filter(|x| of(&corners(x)).slides().len() == n)
                .count()
        };
        assert!((0..3).all(|n| kinds(n) > 5), "{:?}", [0, 1, 2].map(kinds));
        let check = DerivativeCheck {
            step: 1e-6,
            tolerance: 3e-6,
            floor: 1e-9,
        };
        check.run(&points, |x, w| {
            derivatives(&of(&corners(x)).expansion::<12>(), w)
        });
    }
}

#[test]
fn derivatives_of_the_small_stencils() {
    let check = DerivativeCheck::default();
    let two = |x: &[f64], w: f64| {
        let e = point_point(
            &V3d::from_column_slice(&x[..3]),
            &V3d::from_column_slice(&x[3..]),
        );
        derivatives(&e.expansion::<6>(), w)
    };
    check.run(&[vec![0.3, 0.1, -0.7, 0.2, 0.9, 0.4], vec![0.0; 6]], two);
    let three = |x: &[f64], w: f64| {
        let [p, a, b] = [0, 3, 6].map(|i| V3d::from_column_slice(&x[i..i + 3]));
        derivatives(&point_edge(&p, &a, &b).expansion::<9>(), w)
    };
    let inside = vec![0.4, 0.3, 0.1, 0.0, 0.1, 0.0, 1.0, -0.2, 0.3];
    let at_end = vec![1.4, 0.3, 0.1, 0.0, 0.1, 0.0, 1.0, -0.2, 0.3];
    let touching = vec![0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    check.run(&[inside, at_end, touching], three);
}

#[test]
fn derivatives_of_the_mollifier() {
    let mollified = |x: &[f64], w: f64| {
        let [a0, a1, b0, b1] = corners(x);
        let m = ParallelMollifier::new(a1 - a0, b1 - b0, 0.5).expect("below the threshold");
        derivatives(&m.expansion(), w)
    };
    let skew = [
        [0.0, 0.0, 0.0],
        [1.0, 0.1, 0.0],
        [0.1, 0.4, 0.2],
        [1.2, 0.8, 0.4],
    ];
    let parallel = [
        [0.0, 0.0, 0.0],
        [1.0, 0.1, 0.0],
        [0.1, 0.4, 0.2],
        [1.1, 0.5, 0.2],
    ];
    DerivativeCheck::default().run(&[skew.concat(), parallel.concat()], mollified);
    // Continuous with its first derivative at the threshold.
    let [u, v] = [V3d::x(), V3d::y()];
    let m = ParallelMollifier::new(u, v, 1.0 + 1e-9)
        .expect("just below")
        .expansion();
    assert!((m.value - 1.0).abs() < 1e-12 && m.gradient.norm() < 1e-7);
    assert!(ParallelMollifier::new(u, v, 1.0).is_none());
    assert!((mollifier_threshold(&(u * 2.0), &v) - 4e-3).abs() < 1e-15);
}

/// Smallest squared distance over a grid of barycentric coordinates.
fn brute(x: &Corners, of_edges: bool) -> f64 {
    const N: usize = 200;
    let mut least = f64::INFINITY;
    for (i, j) in (0..=N).flat_map(|i| (0..=N).map(move |j| (i, j))) {
        let [s, t] = [i, j].map(|k| k as f64 / N as f64);
        let w = if of_edges {
            x[0].lerp(&x[1], s) - x[2].lerp(&x[3], t)
        } else if i + j <= N {
            x[0] - (x[1] + (x[2] - x[1]) * s + (x[3] - x[1]) * t)
        } else {
            continue;
        };
        least = least.min(w.norm_squared());
    }
    least
}

#[test]
fn distances_are_the_least_over_all_points() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    for _ in 0..200 {
        let x = random(&mut rng);
        for (of, of_edges) in [(STENCILS[0], false), (STENCILS[1], true)] {
            let (ours, sampled) = (of(&x).squared.sqrt(), brute(&x, of_edges).sqrt());
            assert!(
                ours <= sampled + 1e-12 && sampled < ours + 0.02,
                "{ours} {sampled} {x:?}"
            );
        }
    }
}

/// (n · r)² / |n|² of integer coordinates, rounded once.
fn exact_plane_distance(u: [i128; 3], v: [i128; 3], r: [i128; 3]) -> f64 {
    let n = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    let dot = |a: [i128; 3], b: [i128; 3]| (0..3).map(|k| a[k] * b[k]).sum::<i128>();
    let height = dot(n, r);
    (height * height) as f64 / dot(n, n) as f64
}

/// Stencils of edges of 10 mm at a distance of micrometres, on a grid of 10 nm: slivers and nearly parallel edges.
#[test]
fn thin_stencils_have_exact_distances() {
    const UNIT: f64 = 1.0 / (1u64 << 27) as f64;
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let (mut worst, mut inside) = (0.0f64, 0);
    for round in 0..40_000 {
        let thin = 1 << (2 + round % 19);
        let mut around = |size: i128| rng.random_range(-size..=size);
        let length = 1 << 20;
        let u = [length + around(1000), around(1000), around(20)];
        let v = [
            length / 2 + around(length / 4),
            thin + around(thin / 2),
            around(20),
        ];
        let gap = 20 + around(200).abs();
        let points: [[i128; 3]; 2] = [
            [length / 2 + around(1000), thin / 4, gap],
            [length / 3 + around(1000), -thin / 4, gap],
        ];
        let metres = |p: [i128; 3]| V3d::from_fn(|k, _| p[k] as f64 * UNIT);
        let far = |p: [i128; 3], q: [i128; 3]| std::array::from_fn(|k| p[k] + q[k]);
        let z = V3d::zeros();
        let face = point_triangle(&metres(points[0]), [&z, &metres(u), &metres(v)]);
        let pair = edge_edge(
            [&z, &metres(u)],
            [&metres(points[1]), &metres(far(points[1], v))],
        );
        let cases = [
            (face, ClosestFeatures::VertexFace, points[0]),
            (pair, ClosestFeatures::EdgeEdge, points[1].map(|c| -c)),
        ];
        for (separation, features, r) in cases {
            if separation.features == features {
                inside += 1;
                let exact = exact_plane_distance(u, v, r) * UNIT * UNIT;
                worst = worst.max((separation.squared - exact).abs() / exact);
            }
        }
    }
    assert!(inside > 5_000, "{inside}");
    assert!(worst < 1e-9, "relative error {worst:.1e} over {inside}");
}

#[test]
fn degenerate_stencils_stay_finite() {
    let [o, x, y, z] = [V3d::zeros(), V3d::x(), V3d::y(), V3d::z()];
    let cases: Vec<Corners> = vec![
        [o; 4],
        [z, o, o, o],
        [z, o, x, x],
        [x * 0.5, o, x, x * 2.0],
        [x * 0.5 + y, o, x * 2.0, x],
        [o, o, x, y],
        [o, x, y, y + x],
        [o, x, o, x],
        [o, x, x * 0.5, x * 2.0],
        [o, x, x, x],
        [o, x, y - x * 0.1, y + x * (1.0 + 1e-9)],
        [o, x, y * 1e-6, x + y * 1e-6 + z * 1e-12],
        [o, x * 1e-200, y, y + x * 1e-200],
        [o, x * 1e100, y * 1e100, z],
    ];
    let points: Vec<Vec<f64>> = cases.iter().map(unknowns).collect();
    for of in STENCILS {
        let check = DerivativeCheck::default();
        check.run_degenerate(&points, |x, w| {
            derivatives(&of(&corners(x)).expansion::<12>(), w)
        });
    }
    let parallel = edge_edge([&o, &x], [&y, &(y + x)]);
    assert!((parallel.squared - 1.0).abs() < 1e-15);
}

#[test]
fn motions_of_the_whole_change_nothing() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let turn = nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.3);
    let shift = V3d::new(0.3, -0.2, 0.5);
    for _ in 0..200 {
        let x = random(&mut rng);
        for of in STENCILS {
            let (here, there) = (of(&x), of(&x.map(|p| turn * p + shift)));
            assert_eq!(here.features, there.features);
            assert!((here.squared - there.squared).abs() < 1e-12);
            assert!((turn * here.vector - there.vector).norm() < 1e-12);
            // No net force, no net torque.
            let g = here.gradient::<12>();
            let force = |k: usize| V3d::new(g[3 * k], g[3 * k + 1], g[3 * k + 2]);
            assert!((0..4).map(force).sum::<V3d>().norm() < 1e-13);
            assert!((0..4).map(|k| x[k].cross(&force(k))).sum::<V3d>().norm() < 1e-12);
        }
    }
}

#[test]
fn exchanging_the_edges_mirrors_the_separation() {
    let mut rng = Pcg64Mcg::seed_from_u64(9);
    for _ in 0..200 {
        let [a, b, c, d] = random(&mut rng);
        let (one, two) = (edge_edge([&a, &b], [&c, &d]), edge_edge([&d, &c], [&b, &a]));
        assert!((one.squared - two.squared).abs() < 1e-13);
        assert!((one.vector + two.vector).norm() < 1e-12);
        for k in 0..4 {
            assert!((one.weights[k] + two.weights[3 - k]).abs() < 1e-10);
        }
    }
}
