//! Smoothed Coulomb friction with lagged load, normal and closest points (Li et al. 2020, IPC, eqs. 13 to 15).
//!
//! E = μ λ f₀(|u|), u = (I − n nᵀ) Σ cₖ (xₖ − xₖ⁰): relative tangential displacement since the start of the step. Its
//! Hessian is positive semi-definite: it is f₁/|u| across u, and f₁′ ≥ 0 along it.

use super::barrier::Barrier;
use crate::contact::distance::Separation;
use crate::contact::pair::ActivePair;
use nalgebra::{Matrix3, Vector4};
use tryon_geometry::math::{ElementEnergy, V3d};

/// Coulomb's law, smoothed near zero velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// μ.
    pub coefficient: f64,
    /// ε_v h (m): tangential displacement in a step from which friction is full. What sticks creeps by less than that.
    pub slip: f64,
}

/// Contact whose load, normal and closest points are held while positions are solved for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionPair {
    /// Vertices of the stencil.
    pub vertices: [u32; 4],
    /// λ (N): normal load.
    pub load: f64,
    weights: Vector4<f64>,
    normal: V3d,
    /// x⁰ (m).
    start: [V3d; 4],
}

impl FrictionPair {
    /// Contact of `active` as the barrier loads it at `corners` (m), in a step that began at `start`; `None` without load.
    pub fn lagged(
        active: &ActivePair,
        barrier: &Barrier,
        corners: &[V3d; 4],
        start: &[V3d; 4],
    ) -> Option<Self> {
        let separation = active.pair.separation(corners);
        let load = barrier.load(active, corners);
        let normal = separation.vector.try_normalize(0.0)?;
        let weights = separation.weights;
        (load > 0.0).then(|| Self {
            vertices: active.pair.stencil(),
            load,
            weights,
            normal,
            start: *start,
        })
    }
    /// Relative tangential displacement since the start of the step (m).
    pub fn displacement(&self, corners: &[V3d; 4]) -> V3d {
        let moved = |k: usize| (corners[k] - self.start[k]) * self.weights[k];
        let u: V3d = (0..4).map(moved).sum();
        u - self.normal * self.normal.dot(&u)
    }
    /// Positions of the stencil (m) out of those of all vertices.
    pub(super) fn corners(&self, positions: &[V3d]) -> [V3d; 4] {
        self.vertices.map(|v| positions[v as usize])
    }
}

impl Friction {
    /// f₀ (m), f₁ / y (1/m) and f₁′ (1/m) of a displacement y (m).
    fn smoothed(&self, y: f64) -> [f64; 3] {
        let s = self.slip;
        if y >= s {
            return [y, 1.0 / y, 0.0];
        }
        let ratio = y / s;
        [
            s / 3.0 + y * ratio * (1.0 - ratio / 3.0),
            (2.0 - ratio) / s,
            2.0 * (1.0 - ratio) / s,
        ]
    }
    /// Energy of a pair at these positions of its stencil (J).
    pub fn value(&self, pair: &FrictionPair, corners: &[V3d; 4]) -> f64 {
        let [f0, ..] = self.smoothed(pair.displacement(corners).norm());
        self.coefficient * pair.load * f0
    }
    /// Energy of a pair with its derivatives; the Hessian is exact and positive semi-definite.
    pub fn energy(&self, pair: &FrictionPair, corners: &[V3d; 4]) -> ElementEnergy<12> {
        let u = pair.displacement(corners);
        let y = u.norm();
        let [f0, across, along] = self.smoothed(y).map(|f| self.coefficient * pair.load * f);

        let tangential = Matrix3::identity() - pair.normal * pair.normal.transpose();
        let mut curvature = tangential * across;
        if let Some(direction) = u.try_normalize(0.0) {
            curvature += direction * direction.transpose() * (along - across);
        }

        let c = &pair.weights;
        let mut energy = ElementEnergy::<12> {
            value: f0,
            gradient: Separation::stack(c, &(u * across)),
            ..ElementEnergy::default()
        };
        for k in 0..4 {
            for l in 0..4 {
                let mut block = energy.hessian.fixed_view_mut::<3, 3>(3 * k, 3 * l);
                block.copy_from(&(curvature * (c[k] * c[l])));
            }
        }
        energy
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::pair::ContactPair;
    use crate::contact::potential::Curvature;
    use nalgebra::DMatrix;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    const FRICTION: Friction = Friction {
        coefficient: 0.4,
        slip: 0.2,
    };
    const BARRIER: Barrier = Barrier {
        stiffness: 2.0,
        activation: 0.5,
        thickness: 0.1,
    };
    const START: [[f64; 3]; 4] = [
        [0.2, 0.3, 0.25],
        [-1.0, 0.0, 0.1],
        [1.0, -0.8, 0.0],
        [0.5, 1.0, -0.1],
    ];

    fn corners(x: &[f64]) -> [V3d; 4] {
        std::array::from_fn(|k| V3d::from_column_slice(&x[3 * k..3 * k + 3]))
    }

    fn pair(weight: f64) -> FrictionPair {
        let start = START.map(V3d::from);
        let face = ContactPair::VertexFace { v: 0, f: [1, 2, 3] };
        let mut active = ActivePair::new(face, &start);
        active.weight = weight;
        FrictionPair::lagged(&active, &BARRIER, &start, &start).expect("in contact")
    }

    fn derivatives(x: &[f64], weight: f64) -> Derivatives {
        let e = FRICTION.energy(&pair(weight), &corners(x));
        assert!((e.value - FRICTION.value(&pair(weight), &corners(x))).abs() < 1e-15);
        Derivatives::energy(e.value, e.gradient.as_slice().to_vec())
            .with_hessian(DMatrix::from_column_slice(12, 12, e.hessian.as_slice()))
    }

    fn moved(by: [f64; 3]) -> Vec<f64> {
        let mut x = START.concat();
        for k in 0..3 {
            x[k] += by[k];
            x[9 + k] -= 0.3 * by[k];
        }
        x
    }

    #[test]
    fn friction_derivatives_when_sticking_and_slipping() {
        let points = [
            [0.05, 0.02, 0.0],
            [0.1, -0.1, 0.3],
            [0.4, 0.1, -0.2],
            [-2.0, 1.0, 0.5],
        ];
        let check = DerivativeCheck::default();
        check.run(&points.map(moved), derivatives);
        check.run_degenerate(&[START.concat(), moved([0.2, 0.0, 0.0])], derivatives);
    }

    #[test]
    fn force_is_tangential_bounded_by_the_cone_and_sums_to_zero() {
        let p = pair(1.0);
        for by in [[0.01, 0.0, 0.0], [0.1, 0.2, 0.3], [3.0, -2.0, 1.0]] {
            let e = FRICTION.energy(&p, &corners(&moved(by)));
            let force = V3d::new(e.gradient[0], e.gradient[1], e.gradient[2]);
            assert!(force.dot(&p.normal).abs() < 1e-14 * force.norm());
            assert!(force.norm() <= 0.4 * p.load * (1.0 + 1e-12));
            let sum: V3d = (0..4)
                .map(|k| V3d::from(e.gradient.fixed_rows::<3>(3 * k)))
                .sum();
            assert!(sum.norm() < 1e-13 * force.norm());
            assert!(e.hessian.symmetric_eigenvalues().min() > -1e-12 * e.hessian.norm());
        }
        // The load is the barrier's force on the vertex.
        let start = START.map(V3d::from);
        let face = ContactPair::VertexFace { v: 0, f: [1, 2, 3] };
        let active = ActivePair::new(face, &start);
        let push = BARRIER
            .energy(&active, &start, Curvature::Projected)
            .expect("contact");
        assert!((push.gradient.fixed_rows::<3>(0).norm() - p.load).abs() < 1e-12 * p.load);
    }

    #[test]
    fn common_motion_has_no_friction() {
        let p = pair(1.0);
        let shifted = START.map(|s| V3d::from(s) + V3d::new(3.0, -1.0, 2.0));
        assert!(p.displacement(&shifted).norm() < 1e-14);
        assert!(FRICTION.energy(&p, &shifted).gradient.norm() < 1e-13);
    }

    /// At rest on an incline of tan θ, a point creeps by y = s (1 − √(1 − tan θ / μ)): the force there is λ tan θ.
    #[test]
    fn creep_of_a_point_that_sticks_has_its_closed_form() {
        let (p, slope) = (pair(1.0), 0.3);
        let creep = FRICTION.slip * (1.0 - f64::sqrt(1.0 - slope / FRICTION.coefficient));
        let across = p.normal.cross(&V3d::x()).normalize();
        let mut x = START.map(V3d::from);
        x[0] += across * creep;
        let force = FRICTION.energy(&p, &x).gradient.fixed_rows::<3>(0).norm();
        assert!((force / (p.load * slope) - 1.0).abs() < 1e-12, "{force}");
    }
}
