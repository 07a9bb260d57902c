//! Normal equations of an articulated body, summed per bone: their cost grows with points plus joints, not with
//! points times joints.
//!
//! A point p on bone b moves by S·ξ for the bone's twist ξ = (v, ω), S = `[I | −[p]ₓ]`. The bone's twist is the sum of
//! those of its ancestor joints (eq. 3 and 5 with the dominant bone). So Σ Sᵀ M S and Σ Sᵀ M r over each bone suffice.

use super::Metric;
use super::residual::{PointTerm, RowTerm};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3, Vector6};
use tryon_geometry::math::Twist;

/// One degree of freedom: a unit twist that moves a bone and all bones below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dof {
    /// First bone that moves.
    pub bone: usize,
    /// Motion per unit, in the frame of the points.
    pub twist: Twist,
}

impl Dof {
    fn vector(&self) -> Vector6<f64> {
        let (v, w) = (self.twist.linear, self.twist.angular);
        Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
    }
}

/// Sums over the points of one bone (after assembly: and of all bones below).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoneSums {
    /// Σ w Sᵀ M S.
    pub hessian: Matrix6<f64>,
    /// Σ w Sᵀ M r.
    pub gradient: Vector6<f64>,
    // Isotropic parts, expanded by `finish`: Σw, Σw p, Σw p pᵀ (xx xy xz yy yz zz).
    mass: f64,
    first: Vector3<f64>,
    second: [f64; 6],
}

impl BoneSums {
    /// Adds the residual `r` (target minus position, metres) of a point at `p`.
    pub fn add(&mut self, p: &Vector3<f64>, r: &Vector3<f64>, metric: &Metric, weight: f64) {
        let d = metric.direction;
        let m = p.cross(&d);
        let s = Vector6::new(d.x, d.y, d.z, m.x, m.y, m.z);
        self.hessian.ger(metric.directional * weight, &s, &s, 1.0);
        let g = metric.apply(r) * weight;
        let t = p.cross(&g);
        self.gradient += Vector6::new(g.x, g.y, g.z, t.x, t.y, t.z);
        let w = metric.isotropic * weight;
        self.mass += w;
        self.first += p * w;
        for (slot, v) in self.second.iter_mut().zip([
            p.x * p.x,
            p.x * p.y,
            p.x * p.z,
            p.y * p.y,
            p.y * p.z,
            p.z * p.z,
        ]) {
            *slot += v * w;
        }
    }

    /// Moves the isotropic parts into the Hessian: `Sᵀ S = [[I, −[p]], [[p], −[p][p]]]`.
    fn finish(&mut self) {
        let f = self.first;
        let k = Matrix3::new(0.0, -f.z, f.y, f.z, 0.0, -f.x, -f.y, f.x, 0.0);
        let [xx, xy, xz, yy, yz, zz] = self.second;
        let inertia = Matrix3::new(yy + zz, -xy, -xz, -xy, xx + zz, -yz, -xz, -yz, xx + yy);
        for i in 0..3 {
            self.hessian[(i, i)] += self.mass;
            for j in 0..3 {
                self.hessian[(i, j + 3)] -= k[(i, j)];
                self.hessian[(i + 3, j)] += k[(i, j)];
                self.hessian[(i + 3, j + 3)] += inertia[(i, j)];
            }
        }
        (self.mass, self.first, self.second) = (0.0, Vector3::zeros(), [0.0; 6]);
    }
}

/// Normal equations H x = g: point terms in per-bone sums until [`NormalEquations::assemble`], rows after it.
///
/// Unknowns: the root's twist (6), then the joint angles.
#[derive(Clone, Debug, Default)]
pub struct NormalEquations {
    /// Jᵀ W J, shape `[unknowns × unknowns]`.
    pub hessian: DMatrix<f64>,
    /// Jᵀ W r, shape `[unknowns]`.
    pub gradient: DVector<f64>,
    /// One entry a bone; after [`NormalEquations::assemble`] each holds itself and all bones below.
    pub bones: Vec<BoneSums>,
}

/// Unknowns of the root before the first joint angle.
pub const ROOT_UNKNOWNS: usize = 6;

impl NormalEquations {
    /// Empties the sums for `bones` bones.
    pub fn reset(&mut self, bones: usize) {
        self.bones.clear();
        self.bones.resize(bones, BoneSums::default());
    }

    /// Adds a point term about `centre`, which is the origin of the twists.
    #[inline]
    pub fn add_point(&mut self, term: &PointTerm, centre: &Vector3<f64>) {
        let p = term.point - centre;
        self.bones[term.bone].add(&p, &term.residual, &term.metric, term.weight);
    }

    /// Adds `weight · (slopes · x − residual)²` over the row's angles.
    pub fn add_row(&mut self, row: &RowTerm<'_>) {
        for (&a, &sa) in row.angles.iter().zip(row.slopes) {
            self.gradient[ROOT_UNKNOWNS + a] += row.weight * sa * row.residual;
            for (&b, &sb) in row.angles.iter().zip(row.slopes) {
                self.hessian[(ROOT_UNKNOWNS + a, ROOT_UNKNOWNS + b)] += row.weight * sa * sb;
            }
        }
    }

    /// Turns the sums into `hessian` and `gradient`. `parents` come before children; bone 0 is the root. Each degree of
    /// freedom moves its bone and everything below; entries of unrelated ones are zero.
    pub fn assemble(&mut self, parents: &[Option<usize>], dofs: &[Dof]) {
        let (hessian, gradient) = (&mut self.hessian, &mut self.gradient);
        self.bones.iter_mut().for_each(BoneSums::finish);
        for b in (1..self.bones.len()).rev() {
            if let Some(p) = parents[b] {
                let (h, g) = (self.bones[b].hessian, self.bones[b].gradient);
                self.bones[p].hessian += h;
                self.bones[p].gradient += g;
            }
        }
        let n = dofs.len();
        if hessian.shape() != (n, n) {
            *hessian = DMatrix::zeros(n, n);
            *gradient = DVector::zeros(n);
        }
        hessian.fill(0.0);
        for (k, dof) in dofs.iter().enumerate() {
            let xi = dof.vector();
            let below = &self.bones[dof.bone];
            gradient[k] = xi.dot(&below.gradient);
            let moved = below.hessian * xi;
            // Degrees of freedom come in the order of bones, so ancestors have smaller numbers.
            for (l, other) in dofs[..=k].iter().enumerate() {
                if is_ancestor(parents, other.bone, dof.bone) {
                    let h = other.vector().dot(&moved);
                    hessian[(k, l)] = h;
                    hessian[(l, k)] = h;
                }
            }
        }
    }

    /// Solves (H + diag(damping)) x = g; `None` when the matrix is not positive definite or not finite.
    pub fn solve_damped(&self, damping: &[f64]) -> Option<DVector<f64>> {
        let mut a = self.hessian.clone();
        for (i, d) in damping.iter().enumerate() {
            a[(i, i)] += d;
        }
        let x = a.cholesky()?.solve(&self.gradient);
        x.iter().all(|v| v.is_finite()).then_some(x)
    }
}

/// True when bone `a` is `b` or an ancestor of it.
pub fn is_ancestor(parents: &[Option<usize>], a: usize, mut b: usize) -> bool {
    while b > a {
        match parents[b] {
            Some(p) => b = p,
            None => return false,
        }
    }
    a == b
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn aggregated_equals_dense() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(11);
        let mut v3 = || {
            Vector3::new(
                rng.random::<f64>() - 0.5,
                rng.random::<f64>() - 0.5,
                rng.random::<f64>() - 0.5,
            )
        };
        let parents = [None, Some(0), Some(1), Some(0), Some(3), Some(3)];
        let mut dofs: Vec<Dof> = (0..6)
            .map(|i| {
                let e = |k: usize| Vector3::from_fn(|r, _| f64::from(u8::from(r == k)));
                let (linear, angular) = if i < 3 {
                    (e(i), Vector3::zeros())
                } else {
                    (Vector3::zeros(), e(i - 3))
                };
                Dof {
                    bone: 0,
                    twist: Twist { linear, angular },
                }
            })
            .collect();
        for bone in [1, 1, 2, 3, 4, 5, 5] {
            dofs.push(Dof {
                bone,
                twist: Twist::revolute(v3().normalize(), v3()),
            });
        }
        let mut sums = NormalEquations::default();
        sums.reset(6);
        let (mut dense_h, mut dense_g) = (DMatrix::zeros(13, 13), DVector::zeros(13));
        for i in 0..200 {
            let (bone, p, r) = (i % 6, v3() * 2.0, v3() * 0.1);
            let isotropic = 0.1 + 0.01 * (i % 5) as f64;
            let metric = Metric {
                isotropic,
                directional: if i % 7 == 0 { -isotropic } else { 1.0 },
                direction: v3().normalize(),
            };
            let w = 0.5 + 0.1 * (i % 4) as f64;
            sums.bones[bone].add(&p, &r, &metric, w);
            let mut j = DMatrix::zeros(3, 13);
            for (k, d) in dofs.iter().enumerate() {
                if is_ancestor(&parents, d.bone, bone) {
                    j.column_mut(k).copy_from(&d.twist.velocity_at(&p));
                }
            }
            dense_h += j.transpose() * metric.matrix() * &j * w;
            dense_g += j.transpose() * (metric.matrix() * r * w);
        }
        sums.assemble(&parents, &dofs);
        assert!((&sums.hessian - &dense_h).norm() < 1e-10 * dense_h.norm());
        assert!((&sums.gradient - &dense_g).norm() < 1e-10 * dense_g.norm());
    }

    #[test]
    fn rank_deficient_systems_solve_only_with_damping() {
        let of = |hessian| NormalEquations {
            hessian,
            gradient: DVector::from_element(3, 1.0),
            ..NormalEquations::default()
        };
        let ones = of(DMatrix::from_element(3, 3, 1.0));
        assert!(ones.solve_damped(&[1e-4; 3]).is_some());
        assert!(of(DMatrix::zeros(3, 3)).solve_damped(&[0.0; 3]).is_none());
        let broken = of(DMatrix::from_element(3, 3, f64::NAN));
        assert!(broken.solve_damped(&[1.0; 3]).is_none());
    }
}
