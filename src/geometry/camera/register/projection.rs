//! Projection of depth pixels into the colour view, with the rays of all pixels tabulated.

use super::super::{Intrinsics, LensCalibration, undistort::LensRays};
use nalgebra::Vector3;

/// Pixels of a row that are computed together: local arrays of this length become vector registers.
pub(super) const BLOCK: usize = 32;
/// Nearest point of the colour camera that is drawn \[mm\].
const NEAR: f32 = 50.0;
/// Farthest one \[mm\]: 65535 is the empty value of the z-test.
const FAR: f32 = 65_534.0;
/// Columns and rows around the colour image within which points still count as neighbours [pixels].
const MARGIN: f32 = 8.0;
/// Ray of a pixel that the lens does not draw: behind the camera at every depth.
const NO_RAY: [f32; 3] = [0.0, 0.0, f32::NEG_INFINITY];

/// One number for each pixel of a block.
pub(super) type Lanes = [f32; BLOCK];

/// Affine map from depth z \[mm\] to homogeneous colour pixels: (u w, v w, w) = z · ray + origin, with w the depth along the
/// colour camera's axis \[mm\].
#[derive(Clone, Debug)]
pub(super) struct Projection {
    /// Rays of the depth pixels, row by row, the last block of a row filled up; twelve bytes a pixel.
    rays: Vec<[Lanes; 3]>,
    /// Columns of a depth image.
    width: usize,
    origin: [f32; 3],
    limit: [f32; 2],
}

/// Row of depth pixels as the colour camera draws them: column and row [pixels] and depth along the colour camera's axis
/// [mm, 0 = no reading]. One pixel without reading before it, at least one behind.
#[derive(Clone, Debug)]
pub(super) struct ProjectedRow(pub(super) [Vec<f32>; 3]);

impl ProjectedRow {
    pub(super) fn new(width: usize) -> Self {
        let length = width.next_multiple_of(BLOCK) + 2;
        Self(std::array::from_fn(|_| vec![0.0; length]))
    }

    /// True if the block of pixels from `first` on has a reading in view.
    #[inline(always)]
    pub(super) fn has_readings(&self, first: usize) -> bool {
        let depths = &self.0[2][1 + first..][..BLOCK];
        depths.iter().fold(0.0, |sum, z| sum + z) > 0.0
    }

    /// Removes all readings.
    pub(super) fn clear(&mut self) {
        self.0.iter_mut().for_each(|values| values.fill(0.0));
    }
}

impl Projection {
    /// Tabulates the rays of the depth camera's lens, in the colour camera and scaled by its focal lengths.
    pub(super) fn new(lenses: &LensCalibration, color: &Intrinsics) -> Self {
        let (lens, size) = (LensRays::new(lenses.depth), lenses.depth.intrinsics);
        let homogeneous = |p: Vector3<f64>| {
            [
                (color.fx * p.x + color.cx * p.z) as f32,
                (color.fy * p.y + color.cy * p.z) as f32,
                p.z as f32,
            ]
        };
        let entry = |u: u32, v: u32| {
            let [x, y] = lens.ray([f64::from(u), f64::from(v)])?;
            let direction = Vector3::new(x, y, 1.0);
            Some(homogeneous(lenses.color_from_depth.vector(&direction)))
        };

        let width = size.width as usize;
        let in_row = width.div_ceil(BLOCK);
        let mut rays = vec![NO_RAY.map(|c| [c; BLOCK]); in_row * size.height as usize];
        for v in 0..size.height {
            let row = &mut rays[v as usize * in_row..][..in_row];
            for u in 0..size.width {
                let ray = entry(u, v).unwrap_or(NO_RAY);
                let (block, lane) = (u as usize / BLOCK, u as usize % BLOCK);
                (0..3).for_each(|c| row[block][c][lane] = ray[c]);
            }
        }
        let millimetres = lenses.color_from_depth.iso().translation.vector * 1e3;
        Self {
            rays,
            width,
            origin: homogeneous(millimetres),
            limit: [color.width as f32 + MARGIN, color.height as f32 + MARGIN],
        }
    }

    /// Projects row `v` of a depth image \[mm\].
    #[inline(always)]
    pub(super) fn row(&self, v: usize, depth: &[u16], out: &mut ProjectedRow) {
        let blocks = self.width.div_ceil(BLOCK);
        let rays = &self.rays[v * blocks..][..blocks];
        let row = &depth[v * self.width..][..self.width];
        let [out_u, out_v, out_z] = &mut out.0;
        for (i, (rays, depth)) in rays.iter().zip(row.chunks(BLOCK)).enumerate() {
            let at = 1 + i * BLOCK..1 + (i + 1) * BLOCK;
            let [u, v, z] = match depth.first_chunk() {
                Some(depth) => self.block(rays, depth),
                None => {
                    let mut readings = [0; BLOCK];
                    readings[..depth.len()].copy_from_slice(depth);
                    self.block(rays, &readings)
                }
            };
            out_u[at.clone()].copy_from_slice(&u);
            out_v[at.clone()].copy_from_slice(&v);
            out_z[at].copy_from_slice(&z);
        }
    }

    #[inline(always)]
    fn block(&self, [a, b, c]: &[Lanes; 3], depth: &[u16; BLOCK]) -> [Lanes; 3] {
        let [mut u, mut v, mut z] = [[0.0; BLOCK]; 3];
        for k in 0..BLOCK {
            [u[k], v[k], z[k]] = self.point(depth[k], [a[k], b[k], c[k]]);
        }
        [u, v, z]
    }

    /// Column, row and depth in the colour view of depth pixel (`u`, `v`) at `depth` millimetres; zeros without reading or
    /// out of view.
    pub(super) fn pixel(&self, [u, v]: [usize; 2], depth: u16) -> [f32; 3] {
        let rays = &self.rays[v * self.width.div_ceil(BLOCK) + u / BLOCK];
        self.point(depth, rays.each_ref().map(|lanes| lanes[u % BLOCK]))
    }

    #[inline(always)]
    fn point(&self, depth: u16, ray: [f32; 3]) -> [f32; 3] {
        let (depth, origin) = (f32::from(depth), self.origin);
        let z = depth * ray[2] + origin[2];
        let inverse = 1.0 / z;
        let u = (depth * ray[0] + origin[0]) * inverse;
        let v = (depth * ray[1] + origin[1]) * inverse;
        let is_in_range = (depth > 0.0) & (NEAR..=FAR).contains(&z);
        let is_in_view = (u > -MARGIN) & (v > -MARGIN) & (u < self.limit[0]) & (v < self.limit[1]);
        let is_drawn = is_in_range & is_in_view;
        let or_none = |c: f32| if is_drawn { c } else { 0.0 };
        [or_none(u), or_none(v), or_none(z)]
    }
}
