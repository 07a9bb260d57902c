//! The model seen by the camera, as an image of point indices.

use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::OrganisedCloud;

/// Image of the frontmost model point of each cell.
#[derive(Clone, Debug, Default)]
pub struct IndexImage {
    /// Model point, row-major; [`IndexImage::NONE`] where the model is not.
    pub index: Vec<u32>,
    /// Its depth, metres; infinity where the model is not.
    pub depth: Vec<f32>,
}

/// A point is drawn as a disc of this many times half the spacing of the points, so that discs close the surface.
const DISC: f32 = 1.3;
/// Largest radius of a disc, cells.
const MAX_RADIUS: i32 = 4;

impl IndexImage {
    /// No model point in this cell.
    pub const NONE: u32 = u32::MAX;

    /// Draws all points that face the camera as small squares; `spacing` is the mean distance between points, metres.
    pub fn draw(&mut self, grid: &OrganisedCloud, positions: &[P3], normals: &[V3], spacing: f32) {
        let (columns, rows) = grid.size();
        self.index.clear();
        self.index.resize(columns * rows, Self::NONE);
        self.depth.clear();
        self.depth.resize(columns * rows, f32::INFINITY);
        let focal = grid.focal()[0].max(grid.focal()[1]);
        for (i, (p, n)) in positions.iter().zip(normals).enumerate() {
            if n.dot(&p.coords) >= 0.0 {
                continue;
            }
            let Some((u, v)) = grid.cell_of(p) else {
                continue;
            };
            if u < -MAX_RADIUS
                || v < -MAX_RADIUS
                || u > columns as i32 + MAX_RADIUS
                || v > rows as i32 + MAX_RADIUS
            {
                continue;
            }
            let radius = ((0.5 * DISC * spacing * focal / p.z).round() as i32).clamp(0, MAX_RADIUS);
            let (u0, u1) = ((u - radius).max(0), (u + radius).min(columns as i32 - 1));
            for y in (v - radius).max(0)..=(v + radius).min(rows as i32 - 1) {
                for x in u0..=u1 {
                    let k = y as usize * columns + x as usize;
                    // A little later off the disc's middle, so that each point keeps its own cell.
                    let off = ((x - u).abs() + (y - v).abs()) as f32;
                    let z = p.z + off * 0.5 * p.z / focal;
                    if z < self.depth[k] {
                        self.depth[k] = z;
                        self.index[k] = i as u32;
                    }
                }
            }
        }
    }
}
