//! Edge-to-edge correspondences (paper, section 3.2) between the outlines of model and subject.

use super::{IndexImage, ModelPoints, Observation};
use crate::settings::RegistrationSettings;
use tryon_geometry::math::P3;
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Pairs of outline points, and scratch.
#[derive(Clone, Debug, Default)]
pub struct EdgePairs {
    /// Model point and cell of the subject's outline.
    pub pairs: Vec<(u32, u32)>,
    on_contour: Vec<bool>,
}

/// Pairs the model's outline with the subject's. `image` is the model drawn into the grid; outline normals in the image
/// agree within 90°.
pub fn pair_edges(
    model: &ModelPoints<'_>,
    observation: &Observation<'_>,
    image: &IndexImage,
    settings: &RegistrationSettings,
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
        if p.z > image.depth[home] + settings.outline_step {
            continue;
        }
        let outside = match grid.labels[home] {
            Label::Background => true,
            Label::Floor | Label::Other => grid.depth[home] > p.z + settings.outline_step,
            Label::Person | Label::Unknown => false,
        };
        let open = |du: i32, dv: i32| {
            grid.cell(u + du, v + dv)
                .is_some_and(|k| image.depth[k] > p.z + settings.outline_step)
        };
        if !(outside || open(2, 0) || open(-2, 0) || open(0, 2) || open(0, -2)) {
            continue;
        }
        let search = EdgeSearch {
            grid,
            on_contour: &out.on_contour,
            settings,
        };
        if let Some(cell) = search.nearest(p, u, v, [n.x, n.y]) {
            out.pairs.push((i as u32, cell as u32));
        }
    }
}

/// Search for cells of the subject's outline.
struct EdgeSearch<'a> {
    grid: &'a OrganisedCloud,
    /// Cells of the outline, shape `[cells]`.
    on_contour: &'a [bool],
    settings: &'a RegistrationSettings,
}

impl EdgeSearch<'_> {
    /// Two-stage search: rings outward until there are enough candidates, then the nearest of them in space.
    fn nearest(&self, p: &P3, u: i32, v: i32, normal: [f32; 2]) -> Option<usize> {
        let (grid, settings) = (self.grid, self.settings);
        let mut best = None;
        let mut bound = settings.longest_edge * settings.longest_edge;
        let mut candidates = 0;
        let mut visit = |x: i32, y: i32| {
            let Some(k) = grid.cell(x, y).filter(|&k| self.on_contour[k]) else {
                return 0;
            };
            let outward = self.outward(x, y);
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
        for r in 0..=settings.edge_reach {
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
            if candidates >= settings.edge_candidates {
                break;
            }
        }
        best
    }

    /// Outward direction in the image at a contour cell, not normalised.
    fn outward(&self, x: i32, y: i32) -> [f32; 2] {
        let grid = self.grid;
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
            let open = grid.cell(x + du, y + dv).is_none_or(|k| {
                grid.labels[k] != Label::Person || grid.depth[k] > z + self.settings.outline_step
            });
            if open {
                sum[0] += du as f32;
                sum[1] += dv as f32;
            }
        }
        sum
    }
}
