//! Implicit Euler by a prefactorised quasi-Newton iteration (Liu et al. 2017; projective dynamics is its first case).
//!
//! One step minimises ½‖x − y‖²_M/h² + W(x) + holds. The curvature is replaced by the constant matrix M/h² + K of the
//! sheet plus what holds add to the diagonal, factored once for many iterations: an iteration costs one pass over
//! triangles and one back-substitution.

use crate::cloth::{ClothError, Sheet};
use crate::linear::{Factor, SymbolicFactor};
use crate::math::V3d;

/// A vertex pulled to a place with a stiffness (anchors, contacts), N/m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hold {
    /// Where to.
    pub target: V3d,
    /// Stiffness, N/m; zero means no hold.
    pub stiffness: f64,
}

/// The factor of one sheet with the holds it was made for. Scratch.
#[derive(Debug)]
pub struct QuasiNewton {
    factor: Factor,
    values: Vec<f64>,
    /// What the current factor was made with: step and hold stiffness; empty when there is none.
    made_for: (f64, Vec<f64>),
    gradient: Vec<V3d>,
    rhs: Vec<[f64; 3]>,
    /// Number of numeric factorisations so far.
    pub factorisations: u64,
}

impl QuasiNewton {
    /// Orders and analyses the sheet's matrix.
    ///
    /// # Errors
    /// When it is too large.
    pub fn new(symbolic: SymbolicFactor) -> Self {
        Self {
            factor: Factor::new(symbolic),
            values: Vec::new(),
            made_for: (0.0, Vec::new()),
            gradient: Vec::new(),
            rhs: Vec::new(),
            factorisations: 0,
        }
    }
    /// Makes the factor for this step size and these hold stiffnesses (N/m, shape `[vertices]`), unless it is there.
    ///
    /// # Errors
    /// When the matrix is not positive definite, which only non-finite input can cause.
    pub fn prepare(&mut self, sheet: &Sheet, h: f64, stiffness: &[f64]) -> Result<(), ClothError> {
        if self.made_for.0 == h && self.made_for.1 == stiffness {
            return Ok(());
        }
        self.values.clear();
        self.values.extend_from_slice(&sheet.stiffness);
        for (i, (m, k)) in sheet.mass.iter().zip(stiffness).enumerate() {
            self.values[sheet.pattern.diagonal_slot(i)] += m / (h * h) + k;
        }
        self.made_for.0 = 0.0;
        self.factor.refactor(&self.values)?;
        self.factorisations += 1;
        self.made_for = (h, stiffness.to_vec());
        Ok(())
    }
    /// One iteration from `x` towards the minimum with inertial target `y`; holds must have the prepared stiffness.
    /// Returns the length of the step, metres (root mean square over vertices).
    pub fn iterate(&mut self, sheet: &Sheet, y: &[V3d], holds: &[Hold], x: &mut [V3d]) -> f64 {
        let h = self.made_for.0;
        let n = x.len();
        self.gradient.clear();
        self.gradient.extend((0..n).map(|i| {
            let hold = &holds[i];
            (x[i] - y[i]) * (sheet.mass[i] / (h * h)) + (x[i] - hold.target) * hold.stiffness
        }));
        sheet.add_gradient(x, &mut self.gradient);
        self.rhs.clear();
        self.rhs
            .extend(self.gradient.iter().map(|g| [g.x, g.y, g.z]));
        self.factor.solve(&mut self.rhs);
        let mut sum = 0.0;
        for (x, d) in x.iter_mut().zip(&self.rhs) {
            let d = V3d::new(d[0], d[1], d[2]);
            sum += d.norm_squared();
            *x -= d;
        }
        (sum / n.max(1) as f64).sqrt()
    }
}

/// Typical diagonal of the sheet's matrix at each vertex, N/m: the natural unit of a hold's stiffness.
pub fn hold_unit(sheet: &Sheet, h: f64) -> Vec<f64> {
    (0..sheet.mass.len())
        .map(|i| sheet.mass[i] / (h * h) + sheet.stiffness[sheet.pattern.diagonal_slot(i)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::garment::Material;

    /// A flat square of `n` × `n` cells of `size` metres in the xz plane.
    fn square(n: usize, size: f64) -> (Sheet, Vec<V3d>) {
        let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
        let flat = |v: u32| {
            let (i, j) = (v as usize % (n + 1), v as usize / (n + 1));
            [i as f64 * size, j as f64 * size]
        };
        let mut faces = Vec::new();
        for j in 0..n {
            for i in 0..n {
                faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        let rest: Vec<[[f64; 2]; 3]> = faces.iter().map(|f| f.map(flat)).collect();
        let sheet = Sheet::new(
            (n + 1) * (n + 1),
            &faces,
            &rest,
            &Material {
                damping: 0.0,
                ..Material::preset("cotton").expect("preset")
            },
            None,
        )
        .expect("sheet");
        let x = (0..(n + 1) * (n + 1))
            .map(|v| flat(v as u32))
            .map(|p| V3d::new(p[0], 0.0, p[1]))
            .collect();
        (sheet, x)
    }

    fn wavy(x: &[V3d], a: f64) -> Vec<V3d> {
        x.iter()
            .map(|p| {
                p + V3d::new(
                    (p.z * 31.0).sin(),
                    (p.x * 17.0).cos(),
                    (p.x * 23.0 + p.z * 9.0).sin(),
                ) * a
            })
            .collect()
    }

    #[test]
    fn the_gradient_is_the_derivative_of_the_energy_and_the_hessian_of_the_gradient() {
        let (sheet, x) = square(4, 0.02);
        let x = wavy(&x, 0.003);
        let d = wavy(&vec![V3d::zeros(); x.len()], 1.0)
            .iter()
            .zip(&x)
            .map(|(a, p)| a + V3d::new(p.z * 50.0, p.x * 40.0, 0.2))
            .collect::<Vec<_>>();
        let h = 1e-7;
        let moved = |s: f64| {
            x.iter()
                .zip(&d)
                .map(|(p, d)| p + d * (s * h))
                .collect::<Vec<_>>()
        };
        let mut g = vec![V3d::zeros(); x.len()];
        sheet.add_gradient(&x, &mut g);
        let slope = (sheet.energy(&moved(1.0)) - sheet.energy(&moved(-1.0))) / (2.0 * h);
        let exact: f64 = g.iter().zip(&d).map(|(g, d)| g.dot(d)).sum();
        assert!(
            (slope - exact).abs() < 1e-5 * exact.abs(),
            "{slope} {exact}"
        );
        // Internal forces move no centre of mass and turn nothing.
        assert!(g.iter().sum::<V3d>().norm() < 1e-9);
        assert!(
            x.iter()
                .zip(&g)
                .map(|(p, g)| p.cross(g))
                .sum::<V3d>()
                .norm()
                < 1e-9
        );
    }

    #[test]
    fn each_iteration_lowers_the_objective_of_a_large_crumpled_square() {
        let (sheet, x0) = square(40, 0.02);
        let h = 1.0 / 60.0;
        let y = wavy(&x0, 0.02);
        let mut x = wavy(&x0, 0.05);
        let mut q = QuasiNewton::new(SymbolicFactor::new(sheet.pattern.clone()).expect("symbolic"));
        let none = vec![0.0; x.len()];
        q.prepare(&sheet, h, &none).expect("factor");
        let holds = vec![Hold::default(); x.len()];
        let objective = |x: &[V3d]| {
            sheet.energy(x)
                + (0..x.len())
                    .map(|i| 0.5 * sheet.mass[i] / (h * h) * (x[i] - y[i]).norm_squared())
                    .sum::<f64>()
        };
        let mut last = objective(&x);
        for i in 0..20 {
            q.iterate(&sheet, &y, &holds, &mut x);
            let now = objective(&x);
            assert!(now < last * (1.0 + 1e-12), "iteration {i}: {last} to {now}");
            last = now;
        }
    }

    #[test]
    fn free_fall_is_exact_to_rounding() {
        let (sheet, x0) = square(6, 0.02);
        let h = 1.0 / 60.0;
        let mut q = QuasiNewton::new(SymbolicFactor::new(sheet.pattern.clone()).expect("symbolic"));
        q.prepare(&sheet, h, &vec![0.0; x0.len()]).expect("factor");
        let holds = vec![Hold::default(); x0.len()];
        let g = V3d::new(0.0, -9.81, 0.0);
        let (mut x, mut v) = (x0.clone(), vec![V3d::zeros(); x0.len()]);
        for _ in 0..60 {
            let y: Vec<V3d> = x
                .iter()
                .zip(&v)
                .map(|(p, v)| p + v * h + g * (h * h))
                .collect();
            let before = x.clone();
            for _ in 0..3 {
                q.iterate(&sheet, &y, &holds, &mut x);
            }
            v = x.iter().zip(&before).map(|(a, b)| (a - b) / h).collect();
        }
        // Implicit Euler falls g h² n(n+1)/2.
        let fall = 9.81 * h * h * 60.0 * 61.0 / 2.0;
        assert!(
            x.iter()
                .zip(&x0)
                .all(|(a, b)| (a - b + V3d::new(0.0, fall, 0.0)).norm() < 1e-9)
        );
    }

    #[test]
    fn a_triangle_without_area_is_refused_by_number() {
        let faces = [[0, 1, 2], [0, 2, 3]];
        let rest = [
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]],
            [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]],
        ];
        let e = Sheet::new(
            4,
            &faces,
            &rest,
            &Material::preset("silk").expect("preset"),
            None,
        )
        .expect_err("flat");
        assert!(matches!(e, ClothError::ZeroArea { face: 1, .. }));
    }
}
