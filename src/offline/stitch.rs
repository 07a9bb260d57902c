//! Stitches: springs of no length between a vertex and a point of an edge.

use super::energy_term::EnergyElements;
use crate::math::{ElementEnergy, V3d};
use nalgebra::{Matrix3, SMatrix, SVector};

/// A vertex sewn to the point `(1 − t) a + t b` of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stitch {
    /// Sewn vertex.
    pub vertex: u32,
    /// Edge `[a, b]`.
    pub edge: [u32; 2],
    /// t, 0 to 1.
    pub share: f64,
}

impl Stitch {
    /// Pairs of vertices that lie on one another, whose elements therefore never count as contact.
    pub fn sewn_pairs(&self) -> [[u32; 2]; 2] {
        self.edge.map(|v| [self.vertex, v])
    }

    fn weights(&self) -> [f64; 3] {
        [1.0, self.share - 1.0, -self.share]
    }

    fn vertices(&self) -> [u32; 3] {
        [self.vertex, self.edge[0], self.edge[1]]
    }

    fn gap(&self, x: &[V3d]) -> V3d {
        let pairs = self.vertices().into_iter().zip(self.weights());
        pairs.map(|(v, w)| x[v as usize] * w).sum()
    }
}

/// Stitches of one thread: E = ½ k |gap|².
#[derive(Clone, Debug, PartialEq)]
pub struct StitchSprings {
    /// The stitches.
    pub stitches: Vec<Stitch>,
    /// k (N/m).
    pub stiffness: f64,
}

impl EnergyElements<3, 9> for StitchSprings {
    fn count(&self) -> usize {
        self.stitches.len()
    }

    fn vertices(&self, element: usize) -> [u32; 3] {
        self.stitches[element].vertices()
    }

    fn value(&self, element: usize, x: &[V3d]) -> f64 {
        0.5 * self.stiffness * self.stitches[element].gap(x).norm_squared()
    }

    fn expand(&self, element: usize, x: &[V3d]) -> ElementEnergy<9> {
        let stitch = &self.stitches[element];
        let (pull, w) = (stitch.gap(x) * self.stiffness, stitch.weights());
        let mut gradient = SVector::<f64, 9>::zeros();
        let mut hessian = SMatrix::<f64, 9, 9>::zeros();
        for i in 0..3 {
            gradient
                .fixed_rows_mut::<3>(3 * i)
                .copy_from(&(pull * w[i]));
            for j in 0..3 {
                let block = Matrix3::from_diagonal_element(self.stiffness * w[i] * w[j]);
                hessian
                    .fixed_view_mut::<3, 3>(3 * i, 3 * j)
                    .copy_from(&block);
            }
        }
        ElementEnergy {
            value: self.value(element, x),
            gradient,
            hessian,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::derivative_check::{DerivativeCheck, Derivatives};
    use nalgebra::DMatrix;

    #[test]
    fn derivatives_and_a_closed_gap() {
        let stitch = Stitch {
            vertex: 0,
            edge: [1, 2],
            share: 0.25,
        };
        let springs = StitchSprings {
            stitches: vec![stitch],
            stiffness: 40.0,
        };
        let evaluate = |x: &[f64], weight: f64| {
            let x: Vec<V3d> = x.chunks(3).map(V3d::from_column_slice).collect();
            let e = springs.expand(0, &x);
            let gradient = e.gradient * weight;
            Derivatives::energy(e.value * weight, gradient.as_slice().to_vec()).with_hessian(
                DMatrix::from_column_slice(9, 9, (e.hessian * weight).as_slice()),
            )
        };
        DerivativeCheck::default().run(
            &[vec![1.0, 0.5, 0.7, 0.0, 0.1, 0.2, 4.0, 0.3, 0.1]],
            evaluate,
        );
        let at = |y| [V3d::new(1.0, y, 0.0), V3d::zeros(), V3d::new(4.0, 0.0, 0.0)];
        assert_eq!(springs.value(0, &at(0.5)), 0.5 * 40.0 * 0.25);
        assert_eq!(springs.value(0, &at(0.0)), 0.0);
    }
}
