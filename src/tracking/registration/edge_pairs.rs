//! Edge-to-edge correspondences (paper, section 3.2) between the outlines of model and subject.

use super::{IndexImage, ModelPoints, Observation};
use tryon_geometry::math::P3;
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Pairs of outline points, and scratch.
#[derive(Clone, Debug, Default)]
pub struct EdgePairs {
    /// Model point and cell of the subject's outline.
    pub pairs: Vec<(u32, u32)>,
    on_contour: Vec<bool>,
}

/// Candidates nearest in the image, of which the nearest in space wins (k_s of the paper).
const NEAREST_IN_IMAGE: usize = 5;
/// Search radius in the image, cells.
const REACH: i32 = 7;
/// Longest pair in space, metres (Table 1).
const LONGEST: f32 = 0.2;
/// Depth step of an outline, metres: beside it lies a surface at least this much farther away, or nothing.
const STEP: f32 = 0.06;

/// Selection of the model points that pair with the subject's outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeSide {
    /// The model's own outline and points outside the subject (the paper's edge-to-edge pairs).
    Outline,
    /// Only points outside the subject, in known free space (the free-space constraint).
    Outside,
}

/// Pairs the model's outline with the subject's. `image` is the model drawn into the grid; outline normals in the image
/// agree within 90°.
pub fn pair_edges(
    model: &ModelPoints<'_>,
    observation: &Observation<'_>,
    image: &IndexImage,
    side: EdgeSide,
    out: &mut EdgePairs,
) {
    let grid = observation.grid;
    out.pairs.clear();
    out.on_contour.clear();
    out.on_contour.resize(grid.depth.len(), false);
    for &c in observation.true_edges {
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
        if let Some(cell) = nearest_edge(grid, &out.on_contour, p, (u, v), [n.x, n.y]) {
            out.pairs.push((i as u32, cell as u32));
        }
    }
}

/// Two-stage search: rings outward until there are enough candidates, then the nearest of them in space.
fn nearest_edge(
    grid: &OrganisedCloud,
    on_contour: &[bool],
    p: &P3,
    (u, v): (i32, i32),
    normal: [f32; 2],
) -> Option<usize> {
    let mut best = None;
    let mut bound = LONGEST * LONGEST;
    let mut candidates = 0;
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
            candidates += visit(u, v);
        } else {
            for t in -r..r {
                candidates += visit(u + t, v - r)
                    + visit(u + r, v + t)
                    + visit(u - t, v + r)
                    + visit(u - r, v - t);
            }
        }
        if candidates >= NEAREST_IN_IMAGE {
            break;
        }
    }
    best
}

/// Outward direction in the image at a contour cell, not normalised.
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
