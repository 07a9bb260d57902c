//! Chessboard distances over a grid: two passes of neighbours (Rosenfeld and Pfaltz 1966).

use super::OrganisedCloud;

/// Chessboard distance of every cell to the nearest cell of a set, cells, shape `[cells]`; saturates where there is none.
/// `beyond` is the distance of a cell beyond the rim in a given row.
pub fn chessboard_distances(
    grid: &OrganisedCloud,
    is_in: impl Fn(usize) -> bool,
    beyond: impl Fn(i32) -> u16,
    out: &mut Vec<u16>,
) {
    let (columns, rows) = grid.size();
    out.clear();
    out.extend((0..columns * rows).map(|k| if is_in(k) { 0 } else { u16::MAX }));
    let mut relax = |k: usize, neighbours: [(i32, i32); 4]| {
        let (u, v) = ((k % columns) as i32, (k / columns) as i32);
        for (du, dv) in neighbours {
            let near = match grid.cell(u + du, v + dv) {
                Some(n) => out[n],
                None => beyond(v + dv),
            };
            out[k] = out[k].min(near.saturating_add(1));
        }
    };
    for k in 0..columns * rows {
        relax(k, [(-1, 0), (0, -1), (-1, -1), (1, -1)]);
    }
    for k in (0..columns * rows).rev() {
        relax(k, [(1, 0), (0, 1), (1, 1), (-1, 1)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;

    #[test]
    fn distances_are_the_larger_of_columns_and_rows() {
        let grid = OrganisedCloud::new(&Intrinsics::KINECT_V1, None);
        let (columns, rows) = grid.size();
        let (u, v) = (columns / 3, rows / 4);
        let mut out = Vec::new();
        chessboard_distances(&grid, |k| k == v * columns + u, |_| u16::MAX, &mut out);
        for (k, d) in out.iter().enumerate() {
            let apart = (k % columns).abs_diff(u).max((k / columns).abs_diff(v));
            assert_eq!(usize::from(*d), apart, "cell {k}");
        }
        chessboard_distances(&grid, |_| false, |_| u16::MAX, &mut out);
        assert!(out.iter().all(|d| *d == u16::MAX));
        chessboard_distances(&grid, |_| false, |_| 0, &mut out);
        assert_eq!((out[0], out[columns + 1]), (1, 2));
    }
}
