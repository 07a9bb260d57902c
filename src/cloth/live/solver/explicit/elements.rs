//! Elements of a sheet in single precision: triangles, curved hinges, and the diagonals across edges.

use crate::live::Sheet;
use std::collections::HashMap;

/// Coupled edge springs of a triangle. Edge k lies opposite corner k.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct EdgeTriangle {
    pub(super) v: [u32; 3],
    /// Lengths at rest (m).
    pub(super) rest: [f32; 3],
    /// Stiffness between lengthenings 00, 11, 22, 12, 20, 01 (N/m).
    pub(super) k: [f32; 6],
}

impl EdgeTriangle {
    /// Stiffness between edges `i` and `j` (N/m).
    pub(super) fn stiffness(&self, i: usize, j: usize) -> f32 {
        if i == j { self.k[i] } else { self.k[6 - i - j] }
    }
}

/// Hinge that is bent at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CurvedHinge {
    pub(super) v: [u32; 4],
    pub(super) c: [f32; 4],
    /// Stiffness (N/m).
    pub(super) w: f32,
    /// Length of Σ cₖ xₖ at rest (m).
    pub(super) rest: f32,
}

/// Two corners opposite each other across an edge, with their distance in the flat sheet (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Diagonal {
    pub(super) ends: [u32; 2],
    pub(super) flat: f32,
}

/// Corners across every hinge of a sheet, with their distance in the flat sheet (m).
pub(super) fn diagonals(sheet: &Sheet) -> impl Iterator<Item = ([u32; 2], f64)> {
    let edges: HashMap<[u32; 2], f64> = sheet
        .edges
        .iter()
        .map(|(v, l)| ([v[0].min(v[1]), v[0].max(v[1])], *l))
        .collect();
    sheet.hinges.iter().filter_map(move |h| {
        let [a, b, c, d] = h.v;
        let length = |v: u32, w: u32| edges.get(&[v.min(w), v.max(w)]).copied();
        let along = length(a, b).filter(|l| *l > 0.0)?;
        // Coordinates of a corner along the edge and away from it.
        let unfold = |corner: u32| {
            let (to_a, to_b) = (length(a, corner)?, length(b, corner)?);
            let x = (along * along + to_a * to_a - to_b * to_b) / (2.0 * along);
            Some((x, (to_a * to_a - x * x).max(0.0).sqrt()))
        };
        let (c_at, d_at) = (unfold(c)?, unfold(d)?);
        Some(([c, d], (c_at.0 - d_at.0).hypot(c_at.1 + d_at.1)))
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_sheets::{cotton, grid, sheet};
    use super::*;

    #[test]
    fn diagonals_have_the_length_of_the_flat_sheet() {
        let (x, faces, rest) = grid(5, 4, 0.02, 0.013);
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
        let all: Vec<_> = diagonals(&s).collect();
        assert_eq!(all.len(), s.hinges.len());
        for (ends, flat) in all {
            let is = (x[ends[0] as usize] - x[ends[1] as usize]).norm();
            assert!((flat - is).abs() < 1e-12, "{ends:?}: {flat} {is}");
        }
    }
}
