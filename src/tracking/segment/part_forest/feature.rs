//! Depth-difference feature (eq. 1 of Shotton et al. 2011): two probes about a cell, offsets constant in metres of the
//! scene and upright with respect to gravity.

use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::OrganisedCloud;

/// Depth of a probe outside the person's cells, millimetres: beyond any person, and differences fit 16 bits.
const NOTHING: u16 = 15_000;
/// Length of the image of `up` at a cell, per unit of its normalised coordinates, below which gravity gives no direction.
const LEAST_UP: f32 = 0.1;

/// Offsets of two probes, centimetres: right and down of the first, right and down of the second. A second probe without
/// offset is the cell itself (the unary form).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct DepthFeature(pub(super) [i8; 4]);

/// Place of a cell and its scale.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ProbeFrame {
    /// Column and row in the window.
    pub(super) at: [f32; 2],
    /// Image of one centimetre to the upright right at the cell's depth, cells; a quarter turn from it is down.
    pub(super) right: [f32; 2],
    /// Depth, millimetres.
    pub(super) z: u16,
}

/// Cells of one person in a sampled cloud.
#[derive(Clone, Copy, Debug)]
pub struct PersonCells<'a> {
    /// The depth image on the tracker's grid.
    pub cloud: &'a OrganisedCloud,
    /// The person's cells, ascending. Features read the depths of these cells only.
    pub cells: &'a [u32],
    /// Unit direction against gravity, camera frame.
    pub up: V3,
}

/// Axes at a cell: right and down upright with respect to gravity, and away along the viewing ray; unit, orthogonal.
pub(super) fn ray_axes(p: &P3, up: &V3) -> [V3; 3] {
    let away = p.coords.try_normalize(0.0).unwrap_or_else(V3::z);
    let across = |v: V3| v - away * away.dot(&v);
    let down = across(-up).try_normalize(LEAST_UP);
    let down = down.unwrap_or_else(|| across(V3::y()).normalize());
    [down.cross(&away), down, away]
}

/// Depths of the person's cells within their bounding box, row-major, millimetres; [`NOTHING`] elsewhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthWindow<'a> {
    pub(super) columns: u16,
    pub(super) rows: u16,
    pub(super) depth: &'a [u16],
}

/// Bounding box of a window in its grid, cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct WindowBox {
    pub(super) column: usize,
    pub(super) row: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// Depth of a cell that has a reading, millimetres.
fn millimetres(z: f32) -> u16 {
    (z * 1000.0 + 0.5).clamp(1.0, f32::from(NOTHING)) as u16
}

impl WindowBox {
    /// Bounding box of a person's cells and their depths, appended to `depth`. Cells without a reading count as nothing.
    pub(super) fn append(person: &PersonCells<'_>, depth: &mut Vec<u16>) -> Self {
        let (cloud, cells) = (person.cloud, person.cells);
        let columns = cloud.size().0;
        let (mut lo, mut hi) = ([usize::MAX; 2], [0; 2]);
        for &c in cells {
            let p = [c as usize % columns, c as usize / columns];
            for k in 0..2 {
                lo[k] = lo[k].min(p[k]);
                hi[k] = hi[k].max(p[k] + 1);
            }
        }
        if cells.is_empty() {
            return Self::default();
        }
        let out = Self {
            column: lo[0],
            row: lo[1],
            columns: hi[0] - lo[0],
            rows: hi[1] - lo[1],
        };
        let start = depth.len();
        depth.resize(start + out.columns * out.rows, NOTHING);
        for &c in cells {
            let (u, v) = (c as usize % columns - lo[0], c as usize / columns - lo[1]);
            if cloud.depth[c as usize] > 0.0 {
                depth[start + v * out.columns + u] = millimetres(cloud.depth[c as usize]);
            }
        }
        out
    }

    /// Frame of a cell with a reading.
    pub(super) fn frame(&self, person: &PersonCells<'_>, cell: usize) -> ProbeFrame {
        let (cloud, up) = (person.cloud, &person.up);
        let columns = cloud.size().0;
        let z = cloud.depth[cell].max(f32::MIN_POSITIVE);
        let p = cloud.centre(cell).coords / z;
        // Image of a step along `up` from the cell's point: the derivative of its projection.
        let image = [up.x - p.x * up.z, up.y - p.y * up.z];
        let length = (image[0] * image[0] + image[1] * image[1]).sqrt();
        let down = if length > LEAST_UP {
            [-image[0] / length, -image[1] / length]
        } else {
            [0.0, 1.0]
        };
        let scale = 0.01 * cloud.focal()[0] / z;
        ProbeFrame {
            at: [
                (cell % columns - self.column) as f32,
                (cell / columns - self.row) as f32,
            ],
            right: [down[1] * scale, -down[0] * scale],
            z: millimetres(z),
        }
    }
}

impl DepthWindow<'_> {
    /// Depth at a place in cells, millimetres.
    #[inline]
    fn at(&self, column: f32, row: f32) -> i32 {
        // Casts truncate towards zero; the shift makes them round to the nearest.
        const SHIFT: i32 = 4096;
        let u = (column + (SHIFT as f32 + 0.5)) as i32 - SHIFT;
        let v = (row + (SHIFT as f32 + 0.5)) as i32 - SHIFT;
        let inside = (u as u32) < u32::from(self.columns) && (v as u32) < u32::from(self.rows);
        if inside {
            i32::from(self.depth[v as usize * usize::from(self.columns) + u as usize])
        } else {
            i32::from(NOTHING)
        }
    }

    /// Response of a feature at a cell, millimetres.
    #[inline]
    pub(super) fn response(&self, feature: DepthFeature, frame: &ProbeFrame) -> i16 {
        let probe = |right: i8, down: i8| {
            let (a, b) = (f32::from(right), f32::from(down));
            let [x, y] = frame.right;
            self.at(frame.at[0] + a * x - b * y, frame.at[1] + a * y + b * x)
        };
        let [a, b, c, d] = feature.0;
        let second = if (c, d) == (0, 0) {
            i32::from(frame.z)
        } else {
            probe(c, d)
        };
        (probe(a, b) - second) as i16
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::camera::{DepthImage, Intrinsics};

    /// A square camera of 40 × 40 pixels and a cloud of every pixel; `depth` in millimetres.
    fn cloud(depth: impl Fn(i32, i32) -> u16) -> (OrganisedCloud, Vec<u32>) {
        let k = Intrinsics {
            width: 40,
            height: 40,
            fx: 40.0,
            fy: 40.0,
            cx: 19.5,
            cy: 19.5,
        };
        let data = (0..1600).map(|i| depth(i % 40, i / 40)).collect();
        let image = DepthImage::new(40, 40, data).expect("sizes agree");
        let mut cloud = OrganisedCloud::new(&k, Some(1));
        cloud.sample(&image, 8.0);
        let cells = (0..1600).filter(|c| cloud.depth[*c as usize] > 0.0);
        let cells = cells.collect();
        (cloud, cells)
    }

    /// Responses of some features at all cells.
    fn responses(cloud: &OrganisedCloud, cells: &[u32], up: V3) -> Vec<[i16; 3]> {
        let mut depth = Vec::new();
        let person = PersonCells { cloud, cells, up };
        let b = WindowBox::append(&person, &mut depth);
        let window = DepthWindow {
            columns: b.columns as u16,
            rows: b.rows as u16,
            depth: &depth,
        };
        let features = [[20, 0, 0, 0], [0, -30, 10, 10], [-25, 5, 15, 0]].map(DepthFeature);
        let of = |c: &u32| {
            let frame = b.frame(&person, *c as usize);
            features.map(|f| window.response(f, &frame))
        };
        cells.iter().map(of).collect()
    }

    #[test]
    fn a_rolled_camera_gives_the_same_responses() {
        let scene = |u: i32, v: i32| {
            let inside = (8..30).contains(&u) && (5..36).contains(&v);
            if inside {
                (1800 + 7 * u + 11 * v) as u16
            } else {
                0
            }
        };
        let (upright, cells) = cloud(scene);
        let level = responses(&upright, &cells, V3::new(0.0, -1.0, 0.0));
        // The scene a quarter turn clockwise: its up is the image's right.
        let (rolled, turned) = cloud(|u, v| scene(v, 39 - u));
        let across = responses(&rolled, &turned, V3::new(1.0, 0.0, 0.0));
        for (c, r) in turned.iter().zip(&across) {
            let (u, v) = (c % 40, c / 40);
            let k = cells.iter().position(|o| *o == (39 - u) * 40 + v);
            assert_eq!(level[k.expect("same cells")], *r, "cell {u} {v}");
        }
    }

    #[test]
    fn probes_outside_the_person_are_far() {
        let (cloud, cells) = cloud(|u, v| if u == 20 && v == 20 { 2000 } else { 0 });
        let r = responses(&cloud, &cells, V3::new(0.0, -1.0, 0.0));
        assert_eq!(r, [[13_000, 0, 0]]);
        let nobody = PersonCells {
            cloud: &cloud,
            cells: &[],
            up: V3::new(0.0, -1.0, 0.0),
        };
        let none = WindowBox::append(&nobody, &mut Vec::new());
        assert_eq!(none, WindowBox::default());
    }
}
