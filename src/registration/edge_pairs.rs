//! Edge-to-edge pairs (paper, section 3.2): the model's outline against the outline of the person.

use super::{IndexImage, ModelPoints};
use crate::math::P3;
use crate::spatial::{Label, OrganisedCloud};

/// Pairs of outline points, and scratch.
#[derive(Clone, Debug, Default)]
pub struct EdgePairs {
    /// Model point and cell of the person's outline; the residual is the distance from the cell's viewing ray.
    pub pairs: Vec<(u32, u32)>,
    on_contour: Vec<bool>,
}

/// Candidates nearest in the image, of which the nearest in space wins (k_s of the paper).
const NEAREST_IN_IMAGE: usize = 5;
/// Search radius in the image, cells.
const REACH: i32 = 7;
/// The outline of the model: next to a drawn surface at least this much farther away (metres), or to nothing.
const STEP: f32 = 0.06;

/// Which points of the model look for the person's outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeSide {
    /// The model's own outline, and what lies outside the person (the paper's edge-to-edge pairs).
    Outline,
    /// Only what lies outside the person, where the camera sees through to something farther away: no surface can be
    /// there (the free-space constraint).
    Outside,
}

/// Pairs the model's outline with `true_edges`. `image` is the model drawn into the grid, `distance` the longest pair
/// in space (Table 1: 0.2 m); outline normals in the image agree within 90°.
pub fn pair_edges(
    model: &ModelPoints<'_>,
    grid: &OrganisedCloud,
    true_edges: &[u32],
    image: &IndexImage,
    distance: f32,
    side: EdgeSide,
    out: &mut EdgePairs,
) {
    let (columns, _) = grid.size();
    out.pairs.clear();
    out.on_contour.clear();
    out.on_contour.resize(grid.depth.len(), false);
    for &c in true_edges {
        out.on_contour[c as usize] = true;
    }
    for (i, (p, n)) in model.positions.iter().zip(model.normals).enumerate() {
        if n.dot(&p.coords) >= 0.0 {
            continue;
        }
        let Some((u, v)) = grid.cell_of(p) else {
            continue;
        };
        let Some(home) = grid.cell(u, v) else {
            continue;
        };
        if p.z > image.depth[home] + STEP {
            continue;
        }
        // Outside the person, over known free space; or on the model's own outline.
        let outside = match grid.labels[home] {
            Label::Background => true,
            Label::Floor | Label::Other => grid.depth[home] > p.z + STEP,
            Label::Person | Label::Unknown => false,
        };
        let open = |du: i32, dv: i32| {
            grid.cell(u + du, v + dv)
                .is_some_and(|k| image.depth[k] > p.z + STEP)
        };
        let outline = side == EdgeSide::Outline;
        if !(outside || outline && (open(2, 0) || open(-2, 0) || open(0, 2) || open(0, -2))) {
            continue;
        }
        if let Some(cell) = nearest_edge(grid, &out.on_contour, p, (u, v), [n.x, n.y], distance) {
            debug_assert!(cell < grid.depth.len() && columns > 0);
            out.pairs.push((i as u32, cell as u32));
        }
    }
}

/// The two-stage search: rings outward until enough candidates, then the nearest of them in space.
fn nearest_edge(
    grid: &OrganisedCloud,
    on_contour: &[bool],
    p: &P3,
    (u, v): (i32, i32),
    normal: [f32; 2],
    distance: f32,
) -> Option<usize> {
    let mut best = None;
    let mut bound = distance * distance;
    let mut seen = 0;
    let mut visit = |x: i32, y: i32| {
        let Some(k) = grid.cell(x, y).filter(|&k| on_contour[k]) else {
            return 0;
        };
        let outward = outward(grid, x, y);
        if outward[0] * normal[0] + outward[1] * normal[1] < 0.0 {
            return 0;
        }
        let d = (grid.points[k] - p).norm_squared();
        if d < bound {
            bound = d;
            best = Some(k);
        }
        1
    };
    for r in 0..=REACH {
        if r == 0 {
            seen += visit(u, v);
        } else {
            for t in -r..r {
                seen += visit(u + t, v - r)
                    + visit(u + r, v + t)
                    + visit(u - t, v + r)
                    + visit(u - r, v - t);
            }
        }
        if seen >= NEAREST_IN_IMAGE {
            break;
        }
    }
    best
}

/// Direction in the image from the person to what is beside it at a contour cell.
fn outward(grid: &OrganisedCloud, x: i32, y: i32) -> [f32; 2] {
    let mut sum = [0.0f32; 2];
    let z = grid.cell(x, y).map_or(0.0, |k| grid.depth[k]);
    for (du, dv) in [
        (1, 0),
        (-1, 0),
        (0, 1),
        (0, -1),
        (1, 1),
        (-1, 1),
        (1, -1),
        (-1, -1),
    ] {
        let open = grid
            .cell(x + du, y + dv)
            .is_none_or(|k| grid.labels[k] != Label::Person || grid.depth[k] > z + STEP);
        if open {
            sum[0] += du as f32;
            sum[1] += dv as f32;
        }
    }
    sum
}
