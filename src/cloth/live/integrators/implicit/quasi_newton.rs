//! Implicit Euler by a prefactorised quasi-Newton iteration (Liu et al. 2017).
//!
//! One step minimises ½‖x − y‖²_M/h² + W(x) + holds. The constant matrix M/h² + K, with the holds' stiffness on its diagonal,
//! replaces the curvature and is factored once. An iteration costs one pass over triangles and one back-substitution.

use crate::live::{ClothError, Sheet};
use tryon_geometry::linear::{Factor, SymbolicFactor};
use tryon_geometry::math::V3d;

/// Spring from a vertex to a target (pins, contacts).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Hold {
    /// Target (m).
    pub(super) target: V3d,
    /// Stiffness (N/m); zero means no hold.
    pub(super) stiffness: f64,
}

/// Factor of one sheet for a step size and holds. Scratch.
#[derive(Debug)]
pub(super) struct QuasiNewton {
    factor: Factor,
    values: Vec<f64>,
    /// Step size (s) and hold stiffness (N/m) of the current factor; empty when there is none.
    made_for: (f64, Vec<f64>),
    gradient: Vec<V3d>,
    rhs: Vec<[f64; 3]>,
    /// Number of numeric factorisations so far.
    pub(super) factorisations: u64,
}

impl QuasiNewton {
    /// Iteration with the analysed matrix of a sheet.
    pub(super) fn new(symbolic: SymbolicFactor) -> Self {
        Self {
            factor: Factor::new(symbolic),
            values: Vec::new(),
            made_for: (0.0, Vec::new()),
            gradient: Vec::new(),
            rhs: Vec::new(),
            factorisations: 0,
        }
    }
    /// Factors the matrix for a step size (s) and hold stiffness (N/m), shape `[vertices]`, unless it is current.
    ///
    /// # Errors
    /// A matrix that is not positive definite, which only non-finite input can cause.
    pub(super) fn prepare(
        &mut self,
        sheet: &Sheet,
        h: f64,
        stiffness: &[f64],
    ) -> Result<(), ClothError> {
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
    pub(super) fn iterate(&mut self, sheet: &Sheet, y: &[V3d], holds: &[Hold], x: &mut [V3d]) {
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
        for (x, d) in x.iter_mut().zip(&self.rhs) {
            *x -= V3d::from(*d);
        }
    }
}

/// Diagonal of the sheet's matrix at each vertex (N/m): the natural unit of a hold's stiffness.
pub(super) fn hold_unit(sheet: &Sheet, h: f64) -> Vec<f64> {
    (0..sheet.mass.len())
        .map(|i| sheet.mass[i] / (h * h) + sheet.stiffness[sheet.pattern.diagonal_slot(i)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::Material;

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
    fn every_iteration_lowers_the_objective() {
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
}
