//! Soft shadow of a body on the floor under a broad light: slices of its height, each shifted along the light and blurred
//! by the light's width, as penumbrae grow with the distance of what casts them.

use super::rest_pose::ramp;
use super::settings::LightSettings;
use tryon_geometry::math::{Camera, P3, P3d, Rigid, V3d, World};

/// Side of a cell (m).
const CELL: f32 = 0.03;
/// Cells of a side of the grid.
const SIDE: usize = 96;
/// Upper bounds of the slices (m).
const SLICES: [f32; 5] = [0.05, 0.16, 0.42, 0.9, 2.2];
/// Radius of the blur: at the floor (m), and its growth with the height of the slice.
const BLUR: [f32; 2] = [0.02, 0.24];
/// Shift of a slice along the light, share of that of a point light: light from above fills the rest.
const SHIFT: f32 = 0.45;
/// Loss of darkness with the height of a slice (1/m): light from all sides gets under it.
const THIN: f32 = 0.4;
/// Width of the rim in which the shadow fades, share of half a side.
const FADE: f32 = 0.5;

/// Share of light on the floor around a body.
#[derive(Debug)]
pub(super) struct FloorShadow {
    /// Floor position of the first cell's centre, world x and z, metres.
    corner: [f32; 2],
    light: Vec<f32>,
}

impl FloorShadow {
    /// Shadow of a body (camera frame, metres) around `centre` (camera frame).
    pub(super) fn cast(
        light: &LightSettings,
        world_from_camera: &Rigid<World, Camera>,
        vertices: &[P3],
        centre: &P3d,
    ) -> Self {
        let centre = world_from_camera.point(centre).cast::<f32>();
        let half = 0.5 * CELL * (SIDE - 1) as f32;
        let corner = [centre.x - half, centre.z - half];
        let to_light = V3d::from(light.key).cast::<f32>();
        let slope = [to_light.x, to_light.z].map(|x| -SHIFT * x / to_light.y.max(0.1));
        let mut slices = vec![vec![0.0f32; SIDE * SIDE]; SLICES.len()];
        for p in vertices {
            let p = world_from_camera.point(&p.cast()).cast::<f32>();
            let slice = SLICES.iter().position(|top| p.y < *top);
            let at = [p.x + slope[0] * p.y, p.z + slope[1] * p.y];
            if let (Some(k), Some(cell)) = (slice, cell(corner, at)) {
                slices[k][cell] = 1.0;
            }
        }
        let mut out = vec![1.0f32; SIDE * SIDE];
        let mut low = 0.0;
        for (slice, top) in slices.iter_mut().zip(SLICES) {
            let height = 0.5 * (low + top);
            low = top;
            blur(slice, BLUR[0] + BLUR[1] * height);
            for (light_here, covered) in out.iter_mut().zip(slice.iter()) {
                let dark = light.cast * (1.0 - THIN * height).max(0.0);
                *light_here *= 1.0 - dark * covered.min(1.0);
            }
        }
        for (k, light_here) in out.iter_mut().enumerate() {
            *light_here = 1.0 - (1.0 - *light_here) * inner(k);
        }
        Self { corner, light: out }
    }

    /// Share of light at a point of the floor, world x and z, metres; between cells linear.
    pub(super) fn light(&self, [x, z]: [f32; 2]) -> f32 {
        let (x, z) = ((x - self.corner[0]) / CELL, (z - self.corner[1]) / CELL);
        let last = (SIDE - 1) as f32;
        if !(x >= 0.0 && z >= 0.0 && x < last && z < last) {
            return 1.0;
        }
        let (column, row) = (x as usize, z as usize);
        let (s, t) = (x - column as f32, z - row as f32);
        let at = row * SIDE + column;
        let along = |at: usize| self.light[at] * (1.0 - s) + self.light[at + 1] * s;
        along(at) * (1.0 - t) + along(at + SIDE) * t
    }
}

/// Share of a cell's shadow that the fading rim leaves, 0 at the edge of the grid.
fn inner(cell: usize) -> f32 {
    let middle = 0.5 * (SIDE - 1) as f32;
    let (x, z) = ((cell % SIDE) as f32 - middle, (cell / SIDE) as f32 - middle);
    ramp(1.0 - x.hypot(z) / middle, 0.0, FADE)
}

/// Cell of a point of the floor.
fn cell(corner: [f32; 2], [x, z]: [f32; 2]) -> Option<usize> {
    let (column, row) = (
        ((x - corner[0]) / CELL).round(),
        ((z - corner[1]) / CELL).round(),
    );
    let side = SIDE as f32;
    let is_inside = column >= 0.0 && row >= 0.0 && column < side && row < side;
    is_inside.then(|| row as usize * SIDE + column as usize)
}

/// Three box filters in both directions: nearly a normal filter of standard deviation `radius` (m).
fn blur(values: &mut [f32], radius: f32) {
    let half = ((radius / CELL).round() as usize).clamp(1, SIDE / 2 - 1);
    let mut line = [0.0f32; SIDE];
    for _ in 0..3 {
        for k in 0..SIDE {
            box_filter(values, k * SIDE, 1, half, &mut line);
            box_filter(values, k, SIDE, half, &mut line);
        }
    }
}

/// Running mean over `2 half + 1` values of a line that starts at `from`; zero beyond its ends.
fn box_filter(values: &mut [f32], from: usize, stride: usize, half: usize, line: &mut [f32; SIDE]) {
    let mut sum = 0.0;
    for k in 0..half {
        sum += values[from + k * stride];
    }
    for (k, out) in line.iter_mut().enumerate() {
        if k + half < SIDE {
            sum += values[from + (k + half) * stride];
        }
        *out = sum / (2 * half + 1) as f32;
        if k >= half {
            sum -= values[from + (k - half) * stride];
        }
    }
    for (k, value) in line.iter().enumerate() {
        values[from + k * stride] = *value;
    }
}
