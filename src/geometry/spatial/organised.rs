//! A depth image as a grid of points: neighbours in the image are neighbours in space, except across edges.
//!
//! The grid is decimated: one cell stands for `stride × stride` pixels, whose readings are averaged where they
//! belong to the same surface. Each cell has a class (person, background, no reading), so that "no reading"
//! never passes for "empty space".

use super::settings::CellSettings;
use crate::camera::{DepthImage, Intrinsics};
use crate::math::{P3, V3};

/// Class of the surface in a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Label {
    /// No reading: shiny, dark, too near or in shadow. It may hide anything.
    #[default]
    Unknown,
    /// The floor plane.
    Floor,
    /// Walls, and images whose background was removed.
    Background,
    /// Something else that is not the person.
    Other,
    /// The person.
    Person,
}

/// Readings of one cell support each other within their depth over this (2 %) plus [`SUPPORT`]: steep surfaces included.
const SUPPORT_SLOPE: u16 = 50;
/// See [`SUPPORT_SLOPE`], millimetres.
const SUPPORT: u16 = 20;

/// Filled cells per cell that misses two or three of its four probes, at or below which an image is thin. The outlines
/// of a subject alone give one in five.
const THIN: usize = 3;

/// True for two readings of one cell (millimetres) that support each other.
fn agree(a: u16, b: u16) -> bool {
    b > 0 && a.abs_diff(b) <= a / SUPPORT_SLOPE + SUPPORT
}

/// The first of four readings (millimetres) that another one supports, else the first one there is. A lone corrupt
/// pixel does not decide the class of its cell.
fn supported(readings: [u16; 4]) -> u16 {
    let backed = |i: &usize| {
        let a = readings[*i];
        a > 0 && (0..4).any(|j| j != *i && agree(a, readings[j]))
    };
    (0..4)
        .find(backed)
        .map(|i| readings[i])
        .or_else(|| readings.into_iter().find(|d| *d > 0))
        .unwrap_or(0)
}

/// A decimated depth image with points, normals and labels; all arrays are row-major, shape `[rows × columns]`.
#[derive(Clone, Debug)]
pub struct OrganisedCloud {
    stride: u32,
    columns: u32,
    rows: u32,
    /// Focal lengths and centre in cells.
    f: [f32; 2],
    c: [f32; 2],
    /// Depth of each cell, metres; 0 = no reading.
    pub depth: Vec<f32>,
    settings: CellSettings,
    /// Most pixels have no reading: one reading without support is enough for a cell.
    thin: bool,
    /// Class of each cell.
    pub labels: Vec<Label>,
    /// Mean point of each refined cell, camera frame, metres; zero elsewhere.
    pub points: Vec<P3>,
    /// Unit normals towards the camera of refined cells; zero where a neighbour is missing.
    pub normals: Vec<V3>,
}

impl OrganisedCloud {
    /// An empty grid for a camera; `stride` in pixels, or `None` for the default.
    pub fn new(camera: &Intrinsics, stride: Option<u32>) -> Self {
        let settings = CellSettings::default();
        let (stride, (f, c, (columns, rows))) = Self::layout(&settings, camera, stride);
        let n = columns as usize * rows as usize;
        Self {
            stride,
            columns,
            rows,
            f,
            c,
            settings,
            thin: false,
            depth: vec![0.0; n],
            labels: vec![Label::Unknown; n],
            points: vec![P3::origin(); n],
            normals: vec![V3::zeros(); n],
        }
    }
    /// True for a grid made for that camera and stride.
    pub fn fits(&self, camera: &Intrinsics, stride: Option<u32>) -> bool {
        let (s, focal) = Self::layout(&self.settings, camera, stride);
        self.stride == s
            && self.f == focal.0
            && self.c == focal.1
            && (self.columns, self.rows) == focal.2
    }
    /// Stride, and focal lengths, centre and size in cells.
    #[allow(clippy::type_complexity)] // three pairs of numbers, used twice below
    fn layout(
        settings: &CellSettings,
        camera: &Intrinsics,
        stride: Option<u32>,
    ) -> (u32, ([f32; 2], [f32; 2], (u32, u32))) {
        let focal = camera.fx.min(camera.fy);
        let automatic = (focal / settings.cells_per_focal_length)
            .round()
            .clamp(1.0, 16.0) as u32;
        let stride = stride
            .unwrap_or(automatic)
            .clamp(1, camera.width.min(camera.height).max(1));
        let s = f64::from(stride);
        let f = [(camera.fx / s) as f32, (camera.fy / s) as f32];
        let c = [
            ((camera.cx + 0.5) / s - 0.5) as f32,
            ((camera.cy + 0.5) / s - 0.5) as f32,
        ];
        (
            stride,
            (f, c, (camera.width / stride, camera.height / stride)),
        )
    }
    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.columns as usize, self.rows as usize)
    }
    /// Pixels per cell side.
    pub fn stride(&self) -> u32 {
        self.stride
    }
    /// Focal lengths in cells.
    pub fn focal(&self) -> [f32; 2] {
        self.f
    }
    /// Row-major index of a cell; `None` outside.
    pub fn cell(&self, column: i32, row: i32) -> Option<usize> {
        let inside =
            column >= 0 && row >= 0 && column < self.columns as i32 && row < self.rows as i32;
        inside.then(|| row as usize * self.columns as usize + column as usize)
    }
    /// Column and row, in cells, of a camera-frame point; `None` behind the camera or for NaN.
    pub fn project(&self, p: &P3) -> Option<[f32; 2]> {
        (p.z > f32::MIN_POSITIVE).then(|| {
            [
                p.x / p.z * self.f[0] + self.c[0],
                p.y / p.z * self.f[1] + self.c[1],
            ]
        })
    }
    /// Column and row of the cell that holds a point; may lie outside the grid.
    pub fn cell_of(&self, p: &P3) -> Option<(i32, i32)> {
        // The cast saturates, so far-off points stay outside; it truncates, so the shift makes it round to the nearest
        // (several times faster than a call of `round`).
        const SHIFT: i32 = 4096;
        let nearest = |x: f32| ((x + (SHIFT as f32 + 0.5)) as i32).saturating_sub(SHIFT);
        self.project(p).map(|[u, v]| (nearest(u), nearest(v)))
    }
    /// Camera-frame point of a cell at depth `z`.
    pub fn unproject(&self, column: f32, row: f32, z: f32) -> P3 {
        P3::new(
            (column - self.c[0]) / self.f[0] * z,
            (row - self.c[1]) / self.f[1] * z,
            z,
        )
    }
    /// Point of a cell at its own depth.
    pub fn centre(&self, cell: usize) -> P3 {
        let (u, v) = (cell % self.columns as usize, cell / self.columns as usize);
        self.unproject(u as f32, v as f32, self.depth[cell])
    }
    /// A cell on the rim of the image: what it shows may go on outside.
    pub fn on_rim(&self, cell: usize) -> bool {
        let (u, v) = (cell % self.columns as usize, cell / self.columns as usize);
        u == 0 || v == 0 || u + 1 == self.columns as usize || v + 1 == self.rows as usize
    }

    /// First pass: one reading a cell, near its middle; forgets labels. Readings above `farthest` (metres) count as
    /// none. Returns the number of cells with a reading.
    pub fn sample(&mut self, image: &DepthImage, farthest: f32) -> usize {
        let (s, w) = (self.stride as usize, image.width() as usize);
        let limit = (farthest * 1000.0).clamp(0.0, f32::from(u16::MAX - 1)) as u16;
        let data = image.data();
        // The middle and three others, so that one missing pixel leaves no hole.
        let offsets = [
            (s / 2, s / 2),
            (s / 4, s / 4),
            (3 * s / 4, s / 4),
            (s / 4, 3 * s / 4),
        ];
        let probes = if s > 1 { 4 } else { 1 };
        let (mut filled, mut mixed) = (0, 0);
        self.labels.fill(Label::Unknown);
        for row in 0..self.rows as usize {
            for column in 0..self.columns as usize {
                let at = |k: usize| {
                    let (dx, dy) = offsets[k];
                    let d = data
                        .get((row * s + dy) * w + column * s + dx)
                        .copied()
                        .unwrap_or(0);
                    if d <= limit { d } else { 0 }
                };
                let first = at(0);
                let reading = if probes == 1 || (first > 0 && agree(first, at(1))) {
                    first
                } else {
                    let others = [first, at(1), at(2), at(3)];
                    let missing = others.iter().filter(|d| **d == 0).count();
                    mixed += usize::from(missing > 1 && missing < 4);
                    supported(others)
                };
                filled += usize::from(reading > 0);
                self.depth[row * self.columns as usize + column] = f32::from(reading) * 1e-3;
            }
        }
        self.thin = mixed * THIN > filled;
        if self.thin {
            filled += self.fill_thin(data, w, limit);
        }
        filled
    }

    /// Gives cells whose few probes missed the first reading of all their pixels. Returns how many it filled.
    fn fill_thin(&mut self, data: &[u16], w: usize, limit: u16) -> usize {
        let s = self.stride as usize;
        let mut filled = 0;
        for cell in 0..self.depth.len() {
            if self.depth[cell] > 0.0 {
                continue;
            }
            let (u0, v0) = (
                (cell % self.columns as usize) * s,
                (cell / self.columns as usize) * s,
            );
            let pixels = (0..s * s).map(|k| data[(v0 + k / s) * w + u0 + k % s]);
            if let Some(d) = pixels.into_iter().find(|d| *d > 0 && *d <= limit) {
                self.depth[cell] = f32::from(d) * 1e-3;
                filled += 1;
            }
        }
        filled
    }

    /// Second pass: the mean of all readings of each given cell that lie on one surface, then normals. A cell whose
    /// readings don't support each other (lone corrupt pixels) loses its depth. Returns how many kept it.
    pub fn refine(&mut self, image: &DepthImage, cells: &[u32]) -> usize {
        let (s, w) = (self.stride as usize, image.width() as usize);
        let data = image.data();
        let settings = self.settings;
        // A quarter of the pixels must agree; a single pixel is all there is at stride 1.
        let support = if self.thin {
            1
        } else {
            (s * s / 4).max(1) as u32
        };
        let mut kept = 0;
        for &cell in cells {
            let cell = cell as usize;
            let (u0, v0) = (
                (cell % self.columns as usize) * s,
                (cell / self.columns as usize) * s,
            );
            let mean_about = |reference: f32| {
                let tolerance = settings.same_surface + settings.same_surface_slope * reference;
                let (lo, hi) = (
                    ((reference - tolerance) * 1e3).max(1.0) as u16,
                    ((reference + tolerance) * 1e3) as u16,
                );
                let (mut n, mut sum, mut su, mut sv) = (0u32, 0u32, 0u32, 0u32);
                for dv in 0..s {
                    let start = (v0 + dv) * w + u0;
                    for (du, &d) in data[start..start + s].iter().enumerate() {
                        let inside = u32::from(d >= lo && d <= hi);
                        n += inside;
                        sum += inside * u32::from(d);
                        su += inside * du as u32;
                        sv += inside * dv as u32;
                    }
                }
                (n, sum, su, sv)
            };
            let mut best = mean_about(self.depth[cell]);
            if best.0 < support && s > 1 {
                // The first reading stands alone: ask a few others.
                for k in 0..4 {
                    let d = data[(v0 + (k * 5 + 1) % s) * w + u0 + (k * 3 + 2) % s];
                    let other = mean_about(f32::from(d) * 1e-3);
                    if d > 0 && other.0 > best.0 {
                        best = other;
                    }
                }
            }
            let (n, sum, su, sv) = best;
            if n < support {
                self.depth[cell] = 0.0;
                self.points[cell] = P3::origin();
                continue;
            }
            if (sum as f32 / n as f32 * 1e-3 - self.depth[cell]).abs() > settings.misled {
                self.depth[cell] = 0.0;
                self.points[cell] = P3::origin();
                continue;
            }
            let (nf, half) = (n as f32, (s as f32 - 1.0) * 0.5);
            let z = sum as f32 / nf * 1e-3;
            // Centroid of the readings in the cell: partly covered cells would otherwise stand out by half a cell.
            let column = (cell % self.columns as usize) as f32 + (su as f32 / nf - half) / s as f32;
            let row = (cell / self.columns as usize) as f32 + (sv as f32 / nf - half) / s as f32;
            self.depth[cell] = z;
            self.points[cell] = self.unproject(column, row, z);
            kept += 1;
        }
        for &cell in cells {
            self.normals[cell as usize] = self.normal(cell as usize);
        }
        kept
    }

    /// Normal from the refined neighbours on the same surface, by central or one-sided differences.
    fn normal(&self, cell: usize) -> V3 {
        let z = self.depth[cell];
        if z <= 0.0 || self.labels[cell] != Label::Person {
            return V3::zeros();
        }
        let (u, v) = (
            (cell % self.columns as usize) as i32,
            (cell / self.columns as usize) as i32,
        );
        let at = |du: i32, dv: i32| {
            let k = self.cell(u + du, v + dv)?;
            let same = self.labels[k] == Label::Person
                && self.depth[k] > 0.0
                && (self.depth[k] - z).abs() < self.settings.discontinuity;
            same.then(|| self.points[k])
        };
        let here = self.points[cell];
        let difference = |a: Option<P3>, b: Option<P3>| match (a, b) {
            (Some(a), Some(b)) => Some(b - a),
            (Some(a), None) => Some(here - a),
            (None, Some(b)) => Some(b - here),
            (None, None) => None,
        };
        let (Some(du), Some(dv)) = (
            difference(at(-1, 0), at(1, 0)),
            difference(at(0, -1), at(0, 1)),
        ) else {
            return V3::zeros();
        };
        // x right, y down, z forward: dv × du points at the camera.
        let n = dv.cross(&du).try_normalize(0.0).unwrap_or_else(V3::zeros);
        if n.dot(&here.coords) > 0.0 { -n } else { n }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane z = 2 + 0.3 x seen by a small camera, every pixel.
    fn slanted() -> (Intrinsics, DepthImage) {
        let k = Intrinsics {
            width: 64,
            height: 48,
            fx: 60.0,
            fy: 60.0,
            cx: 31.5,
            cy: 23.5,
        };
        let data = (0..48 * 64).map(|i| {
            let x = (f64::from(i % 64) - k.cx) / k.fx;
            (2.0 / (1.0 - 0.3 * x) * 1000.0).round() as u16
        });
        (
            k,
            DepthImage::new(64, 48, data.collect()).expect("sizes agree"),
        )
    }

    fn person_everywhere(cloud: &mut OrganisedCloud) -> Vec<u32> {
        cloud.labels.fill(Label::Person);
        (0..cloud.depth.len() as u32).collect()
    }

    #[test]
    fn averages_lie_on_the_plane_and_normals_across_it() {
        let (k, image) = slanted();
        let mut cloud = OrganisedCloud::new(&k, Some(4));
        assert_eq!(cloud.sample(&image, 8.0), 16 * 12);
        let cells = person_everywhere(&mut cloud);
        assert_eq!(cloud.refine(&image, &cells), cells.len());
        let n = V3::new(0.3, 0.0, -1.0).normalize();
        for &c in &cells {
            let p = cloud.points[c as usize];
            assert!((p.z - 2.0 - 0.3 * p.x).abs() < 2e-3, "{p}");
            assert!(cloud.normals[c as usize].dot(&n) > 0.995);
        }
        let p = cloud.points[5 * 16 + 7];
        assert_eq!(cloud.cell_of(&p), Some((7, 5)));
    }

    #[test]
    fn corrupt_pixels_are_outvoted() {
        let (k, mut image) = slanted();
        let truth = image.clone();
        let values = [0u16, u16::MAX, 700, 5000];
        for (i, d) in image.data_mut().iter_mut().enumerate() {
            if (i * 7919) % 100 < 10 {
                *d = values[i % 4];
            }
        }
        let mut cloud = OrganisedCloud::new(&k, Some(4));
        cloud.sample(&image, 8.0);
        let cells = person_everywhere(&mut cloud);
        assert!(cloud.refine(&image, &cells) > cells.len() * 90 / 100);
        let mut clean = OrganisedCloud::new(&k, Some(4));
        clean.sample(&truth, 8.0);
        person_everywhere(&mut clean);
        clean.refine(&truth, &cells);
        let off = cells
            .iter()
            .filter(|&&c| cloud.depth[c as usize] > 0.0)
            .map(|&c| (cloud.points[c as usize] - clean.points[c as usize]).norm());
        assert!(off.fold(0.0f32, f32::max) < 0.03);
    }

    #[test]
    fn degenerate_images_leave_empty_grids() {
        let k = Intrinsics {
            width: 3,
            height: 2,
            fx: 500.0,
            fy: 500.0,
            cx: 1.0,
            cy: 0.5,
        };
        let mut cloud = OrganisedCloud::new(&k, None);
        assert_eq!(cloud.sample(&DepthImage::empty(3, 2), 8.0), 0);
        let saturated = DepthImage::new(3, 2, vec![u16::MAX; 6]).expect("sizes agree");
        assert_eq!(cloud.sample(&saturated, 8.0), 0);
        assert!(cloud.project(&P3::new(0.0, 0.0, f32::NAN)).is_none());
        assert!(cloud.cell(-1, 0).is_none());
    }
}
