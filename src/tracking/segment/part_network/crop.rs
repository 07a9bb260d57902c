//! Square window about a person, upright with respect to gravity, in which the network sees them.

use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::OrganisedCloud;

/// Pixels of a side of the network's picture.
pub const CROP_SIDE: usize = 96;
/// Channels of the picture: depth, 1 at the person's readings, size.
pub const CROP_CHANNELS: usize = 3;
/// Margin about the person's bounding box, share of its longer side.
const MARGIN: f32 = 0.12;
/// Shortest side of a window, metres: a head with shoulders.
const LEAST_METRES: f32 = 0.7;
/// Length of a projected unit direction below which it gives no direction.
const LEAST_LEVEL: f32 = 0.1;

/// Cells of one person in a sampled cloud.
#[derive(Clone, Copy, Debug)]
pub struct PersonCells<'a> {
    /// The depth image on the tracker's grid.
    pub cloud: &'a OrganisedCloud,
    /// The person's cells, ascending. The network sees the depths of these cells only.
    pub cells: &'a [u32],
    /// Unit direction against gravity, camera frame.
    pub up: V3,
}

impl PersonCells<'_> {
    /// Mean of the person's readings, camera frame, metres; the origin without one.
    pub fn middle(&self) -> P3 {
        let points = self
            .cells
            .iter()
            .map(|c| self.cloud.centre(*c as usize).coords);
        P3::from(points.sum::<V3>() / self.cells.len().max(1) as f32)
    }
}

/// A square window about a person's cells. Its coordinates are right, down and away: right and down across the window from
/// 0 to 1, away from its middle in units of its side, level with respect to gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PersonCrop {
    /// Middle, cells.
    middle: [f32; 2],
    /// Direction to the upright right in the image, unit.
    right: [f32; 2],
    /// Side, cells.
    side: f32,
    /// Side at the person's depth, metres.
    pub metres: f32,
    /// Level direction away from the camera, unit, camera frame.
    away: V3,
    /// Median of the person's readings along it, metres.
    distance: f32,
}

impl PersonCrop {
    /// Window of a person; `None` without a reading.
    pub fn new(person: &PersonCells<'_>) -> Option<Self> {
        let (cloud, up) = (person.cloud, &person.up);
        let read = |c: &&u32| cloud.depth[**c as usize] > 0.0;
        let away = V3::z() - up * up.z;
        let away = away.try_normalize(LEAST_LEVEL).unwrap_or_else(V3::z);
        let along = |c: &u32| cloud.centre(*c as usize).dot_coords(&away);
        let mut distances: Vec<f32> = person.cells.iter().filter(read).map(along).collect();
        let half = distances.len() / 2;
        let (_, distance, _) = (!distances.is_empty())
            .then(|| distances.select_nth_unstable_by(half, f32::total_cmp))?;
        let distance = *distance;
        let mut depths: Vec<f32> = person
            .cells
            .iter()
            .map(|c| cloud.depth[*c as usize])
            .collect();
        depths.retain(|z| *z > 0.0);
        let (_, depth, _) = depths.select_nth_unstable_by(half, f32::total_cmp);
        let right = upright_right(person);
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for cell in person.cells.iter().filter(read) {
            for (k, x) in turned(right, place(cloud, *cell)).into_iter().enumerate() {
                low[k] = low[k].min(x);
                high[k] = high[k].max(x);
            }
        }
        let longest = (high[0] - low[0]).max(high[1] - low[1]) + 1.0;
        let per_metre = cloud.focal()[0] / *depth;
        let side = ((1.0 + MARGIN) * longest).max(LEAST_METRES * per_metre);
        let middle = [0, 1].map(|k| 0.5 * (low[k] + high[k]));
        Some(Self {
            middle: turned([right[0], -right[1]], middle),
            right,
            side,
            metres: side / per_metre,
            away,
            distance,
        })
    }

    /// Writes the picture, shape `[channels, side, side]`: depth in units of the window's side, 1 at the person's readings,
    /// the window's side in metres. Zero where the person has no reading.
    pub fn picture(&self, person: &PersonCells<'_>, out: &mut Vec<f32>) {
        let cloud = person.cloud;
        let pixels = CROP_SIDE * CROP_SIDE;
        out.clear();
        out.resize(CROP_CHANNELS * pixels, 0.0);
        out[2 * pixels..].fill(self.metres);
        for i in 0..pixels {
            let Some(cell) = self.cell(cloud, i) else {
                continue;
            };
            if cloud.depth[cell] > 0.0 && person.cells.binary_search(&(cell as u32)).is_ok() {
                let away = cloud.centre(cell).dot_coords(&self.away);
                out[i] = (away - self.distance) / self.metres;
                out[pixels + i] = 1.0;
            }
        }
    }

    /// Cell under a pixel's middle; `None` outside the image.
    pub fn cell(&self, cloud: &OrganisedCloud, pixel: usize) -> Option<usize> {
        let (column, row) = (pixel % CROP_SIDE, pixel / CROP_SIDE);
        let at = [column, row].map(|k| (k as f32 + 0.5) / CROP_SIDE as f32);
        let [u, v] = self.image_place(at).map(|x| x.round() as i32);
        cloud.cell(u, v)
    }

    /// Place across the window of a cell's middle.
    pub fn of_cell(&self, cloud: &OrganisedCloud, cell: u32) -> [f32; 2] {
        self.window_place(place(cloud, cell))
    }

    /// Window coordinates of a camera-frame point, metres; `None` behind the camera.
    pub fn of_point(&self, cloud: &OrganisedCloud, p: &P3) -> Option<[f32; 3]> {
        let [x, y] = self.window_place(cloud.project(p)?);
        Some([
            x,
            y,
            (p.dot_coords(&self.away) - self.distance) / self.metres,
        ])
    }

    /// Camera-frame point of window coordinates, metres; `None` where the ray never comes to that distance.
    pub fn point(&self, cloud: &OrganisedCloud, [x, y, away]: [f32; 3]) -> Option<P3> {
        let [u, v] = self.image_place([x, y]);
        let ray = cloud.unproject(u, v, 1.0);
        let level = ray.dot_coords(&self.away);
        let depth = (self.distance + away * self.metres) / level;
        (level > LEAST_LEVEL && depth > 0.0).then(|| P3::from(ray.coords * depth))
    }

    /// Column and row of a place across the window.
    fn image_place(&self, at: [f32; 2]) -> [f32; 2] {
        let off = at.map(|x| (x - 0.5) * self.side);
        let [u, v] = turned([self.right[0], -self.right[1]], off);
        [self.middle[0] + u, self.middle[1] + v]
    }

    fn window_place(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let off = [u - self.middle[0], v - self.middle[1]];
        turned(self.right, off).map(|x| x / self.side + 0.5)
    }
}

/// Level part of a point along a direction.
trait Along {
    fn dot_coords(&self, direction: &V3) -> f32;
}

impl Along for P3 {
    fn dot_coords(&self, direction: &V3) -> f32 {
        self.coords.dot(direction)
    }
}

/// Column and row of a cell.
fn place(cloud: &OrganisedCloud, cell: u32) -> [f32; 2] {
    let columns = cloud.size().0;
    let (u, v) = (cell as usize % columns, cell as usize / columns);
    [u as f32, v as f32]
}

/// Components of a vector along a unit direction and a quarter turn from it.
fn turned([c, s]: [f32; 2], [x, y]: [f32; 2]) -> [f32; 2] {
    [c * x + s * y, c * y - s * x]
}

/// Direction to the upright right in the image at the middle of the person's readings.
fn upright_right(person: &PersonCells<'_>) -> [f32; 2] {
    let (cloud, up) = (person.cloud, &person.up);
    let points = person.cells.iter().map(|c| cloud.centre(*c as usize));
    let sum = points.fold(V3::zeros(), |s, p| s + p.coords);
    let p = sum / sum.z.max(f32::MIN_POSITIVE);
    // Image of a step along `up` from that place: the derivative of its projection.
    let image = [up.x - p.x * up.z, up.y - p.y * up.z];
    let length = (image[0] * image[0] + image[1] * image[1]).sqrt();
    if length > LEAST_LEVEL {
        [-image[1] / length, image[0] / length]
    } else {
        [1.0, 0.0]
    }
}
