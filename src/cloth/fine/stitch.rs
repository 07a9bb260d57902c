//! Stitches: springs of no length between a vertex and a point of an edge.

use super::energy_term::EnergyElements;
use crate::elastic::SheetMotion;
use nalgebra::Matrix3;
use tryon_formats::sewn_obj::Stitch;
use tryon_geometry::math::{ElementEnergy, V3d};

/// Pairs of vertices that lie on one another, whose elements therefore never count as contact.
pub fn sewn_pairs(stitches: &[Stitch]) -> Vec<[u32; 2]> {
    let pairs = |s: &Stitch| s.edge.map(|v| [s.vertex, v]);
    stitches.iter().flat_map(pairs).collect()
}

fn weights(stitch: &Stitch) -> [f64; 3] {
    let share = f64::from(stitch.at);
    [1.0, share - 1.0, -share]
}

fn vertices(stitch: &Stitch) -> [u32; 3] {
    [stitch.vertex, stitch.edge[0], stitch.edge[1]]
}

fn gap(stitch: &Stitch, x: &[V3d]) -> V3d {
    let pairs = vertices(stitch).into_iter().zip(weights(stitch));
    pairs.map(|(v, w)| x[v as usize] * w).sum()
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
        vertices(&self.stitches[element])
    }

    fn value(&self, element: usize, at: &SheetMotion<'_>) -> f64 {
        0.5 * self.stiffness * gap(&self.stitches[element], at.now).norm_squared()
    }

    fn expand(&self, element: usize, at: &SheetMotion<'_>) -> ElementEnergy<9> {
        let stitch = &self.stitches[element];
        let (pull, w) = (gap(stitch, at.now) * self.stiffness, weights(stitch));
        ElementEnergy::of_corners(
            self.value(element, at),
            |i| pull * w[i],
            |i, j| Matrix3::from_diagonal_element(self.stiffness * w[i] * w[j]),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    #[test]
    fn derivatives_and_a_closed_gap() {
        let stitch = Stitch {
            vertex: 0,
            edge: [1, 2],
            at: 0.25,
        };
        let springs = StitchSprings {
            stitches: vec![stitch],
            stiffness: 40.0,
        };
        let evaluate = |x: &[f64], weight: f64| {
            let x: Vec<V3d> = x.chunks(3).map(V3d::from_column_slice).collect();
            let e = springs.expand(0, &SheetMotion::still(&x));
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
        assert_eq!(
            springs.value(0, &SheetMotion::still(&at(0.5))),
            0.5 * 40.0 * 0.25
        );
        assert_eq!(springs.value(0, &SheetMotion::still(&at(0.0))), 0.0);
    }
}
