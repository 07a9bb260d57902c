//! Implicit Euler by a prefactorised quasi-Newton iteration (Liu et al. 2017; projective dynamics is its first case).
//!
//! One step minimises ½‖x − y‖²_M/h² + W(x) + holds. The curvature is replaced by the constant matrix M/h² + K of the
//! sheet plus what holds add to the diagonal, factored once for many iterations: an iteration costs one pass over
//! triangles and one back-substitution.

use super::{ClothError, Sheet};
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
        self.rhs.extend(self.gradient.iter().map(|g| [g.x, g.y, g.z]));
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
