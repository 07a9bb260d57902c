//! Hooke's law of a triangle as coupled springs along its edges (after Delingette 2008, in lengths).

use crate::live::{Element, Sheet};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// Springs of a triangle. Edge k lies opposite corner k.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleSprings {
    /// Corners.
    pub(super) v: [u32; 3],
    /// Stiffness between the lengthenings of the edges (N/m).
    pub(super) stiffness: Matrix3<f64>,
    /// Unit directions at rest, from corner k + 1 to corner k + 2.
    pub(super) directions: [Vector2<f64>; 3],
}

impl TriangleSprings {
    /// Springs of an element, `None` where it has no area.
    pub(super) fn new(sheet: &Sheet, e: &Element) -> Option<Self> {
        let d = Matrix2::new(e.b[1][0], e.b[1][1], e.b[2][0], e.b[2][1]);
        let r = d.try_inverse()?;
        let (p, q) = (r.column(0).into_owned(), r.column(1).into_owned());
        let edges = [q - p, -q, p];
        let rest = edges.map(|e| e.norm());
        // Lengthening of edge i from the strain (xx, yy, xy): rᵀEr / |r|.
        let g = Matrix3::from_fn(|i, j| {
            let [x, y] = [edges[i].x, edges[i].y];
            [x * x, y * y, 2.0 * x * y][j] / rest[i]
        });
        let inverse = g.try_inverse()?;
        let directions = std::array::from_fn(|i| edges[i] / rest[i]);
        Some(Self {
            v: e.v,
            stiffness: inverse.transpose() * sheet.membrane.hooke() * inverse * e.area,
            directions,
        })
    }
}
