//! Floor and walls: the dominant planes of a scene, by random sampling and least squares.

use crate::math::{Camera, P3, Rigid, World, principal_axes};
use crate::spatial::OrganisedCloud;
use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

/// Points p with `normal · p + offset = 0`; the normal is a unit vector towards the camera's side.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Unit normal, camera frame.
    pub normal: Vector3<f64>,
    /// Distance of the camera from the plane, metres.
    pub offset: f64,
}

impl Plane {
    /// Signed distance, positive on the camera's side, metres.
    pub fn distance(&self, p: &P3) -> f32 {
        self.normal.cast::<f32>().dot(&p.coords) + self.offset as f32
    }
}

/// What was found of the room.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScenePlanes {
    /// The floor.
    pub floor: Option<Plane>,
    /// Walls and other large planes with nothing behind them.
    pub background: Vec<Plane>,
}

/// Distance from the floor that still counts as floor, metres (paper, section 6: 20 mm).
pub(super) const FLOOR_TOLERANCE: f32 = 0.020;
/// Distance from a background plane that still counts as background, metres (paper, section 6: 200 mm).
pub(super) const BACKGROUND_TOLERANCE: f32 = 0.200;
/// Axial noise of the sensor: this × z² (metres), from Nguyen et al. 2012 (Kinect v1), twice the standard deviation.
const NOISE_PER_SQUARE_METRE: f32 = 0.004;
/// The floor's normal is within this angle of the image's up direction: cameras are tilted, seldom rolled.
const FLOOR_TILT: f64 = 0.75;
/// A plane holds at least this share of all cells. A person's chest held 4 % at most.
const SHARE: f64 = 0.04;
/// A plane extends at least this far (standard deviation, metres) in its second direction; a person's front is 0.15.
const SPREAD: f64 = 0.20;
/// A background shows at least this area, m²: more than the largest body, who may stand alone in the picture.
const LEAST_BACKGROUND: f64 = 1.2;
/// At most this share of the readings lies behind a background plane.
const BEHIND: f64 = 0.03;
/// The floor is looked for among planes of these tilts towards and across the view, radians: first, last, step.
const PITCHES: [f64; 3] = [-0.7, 0.7, 0.05];
/// The second look takes steps this many times smaller around the best of the first.
const FINER: f64 = 5.0;
/// See [`PITCHES`].
const ROLLS: [f64; 3] = [-0.35, 0.35, 0.07];
/// Heights of the floor below the camera, metres, and the width of the bins in which they are counted.
const HEIGHTS: [f32; 3] = [0.2, 3.0, 0.04];
/// So many points are enough to find a floor.
const FLOOR_POINTS: usize = 1500;
/// Random triples tried for each plane; a wall that fills a fifth of the picture is hit with 1 − 10⁻⁵.
const TRIALS: usize = 150;
/// Planes looked for.
const PLANES: usize = 4;
/// Corners of a random triple are at most this many cells apart, so that they likely share a plane.
const TRIPLE_REACH: i32 = 20;

/// How far a point of a plane may seem away from it.
pub(super) fn tolerance(plane: &Plane, p: &P3) -> f32 {
    // Depth noise acts along the ray; only its part along the normal leaves the plane.
    let along =
        (plane.normal.cast::<f32>().dot(&p.coords) / p.coords.norm().max(f32::MIN_POSITIVE)).abs();
    FLOOR_TOLERANCE + NOISE_PER_SQUARE_METRE * p.z * p.z * along
}

/// Depths along each cell's ray at which a reading belongs to a plane: the tolerances, solved for z once a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Bands {
    scene: ScenePlanes,
    /// Focal lengths, centre and size of the grid they were made for.
    layout: ([f32; 2], (usize, usize), u32),
    /// First and last depth, metres, shape `[cells]`; empty without a floor.
    pub floor: Vec<[f32; 2]>,
    /// The same for each background plane.
    pub background: Vec<Vec<[f32; 2]>>,
}

impl Bands {
    /// Makes the bands for a scene and a grid, unless they are those already.
    pub(super) fn update(&mut self, scene: &ScenePlanes, cloud: &OrganisedCloud) {
        let layout = (cloud.focal(), cloud.size(), cloud.stride());
        if self.scene == *scene && self.layout == layout {
            return;
        }
        let all = |plane: &Plane, extra: f64| -> Vec<[f32; 2]> {
            let (columns, rows) = cloud.size();
            let ray = |i: usize| {
                cloud
                    .unproject((i % columns) as f32, (i / columns) as f32, 1.0)
                    .coords
                    .cast::<f64>()
            };
            (0..columns * rows)
                .map(|i| band(plane, &ray(i), extra))
                .collect()
        };
        self.floor = scene.floor.map_or(vec![], |f| all(&f, 0.0));
        self.background = scene
            .background
            .iter()
            .map(|b| all(b, f64::from(BACKGROUND_TOLERANCE)))
            .collect();
        (self.scene, self.layout) = (scene.clone(), layout);
    }
}

/// Depths z with |n · z r + o| below the tolerance or below `extra`, for a ray r with z component 1.
fn band(plane: &Plane, ray: &Vector3<f64>, extra: f64) -> [f32; 2] {
    let slope = -plane.normal.dot(ray);
    if slope <= f64::EPSILON {
        // The ray leaves the plane.
        return [f32::INFINITY, f32::NEG_INFINITY];
    }
    let (o, c) = (plane.offset, f64::from(FLOOR_TOLERANCE));
    let k = f64::from(NOISE_PER_SQUARE_METRE) * slope / ray.norm();
    // o − slope z = c + k z² in front of the plane, = −(c + k z²) behind it.
    let near = (-slope + (slope * slope + 4.0 * k * (o - c)).max(0.0).sqrt()) / (2.0 * k);
    let inner = slope * slope - 4.0 * k * (o + c);
    let far = if inner < 0.0 {
        f64::INFINITY
    } else {
        (slope - inner.sqrt()) / (2.0 * k)
    };
    [
        near.min((o - extra) / slope) as f32,
        far.max((o + extra) / slope) as f32,
    ]
}

/// Looks for the floor and for background planes in a sampled cloud. Deterministic: the same cloud gives the same planes.
pub fn find_planes(cloud: &OrganisedCloud) -> ScenePlanes {
    let (columns, rows) = cloud.size();
    // Every second cell in both directions is plenty for planes.
    let cells: Vec<usize> = (0..rows)
        .step_by(2)
        .flat_map(|r| (0..columns).step_by(2).map(move |c| r * columns + c))
        .filter(|&i| cloud.depth[i] > 0.0)
        .collect();
    let mut points: Vec<P3> = cells.iter().map(|&i| cloud.centre(i)).collect();
    let total = points.len();
    let wanted = (SHARE * (columns * rows) as f64 / 4.0) as usize;
    let mut rng = rand_pcg::Pcg32::seed_from_u64(0x5eed);
    let mut scene = ScenePlanes::default();
    let all = points.clone();
    if let Some(floor) = find_floor(&all, wanted) {
        points.retain(|p| floor.distance(p).abs() >= tolerance(&floor, p));
        scene.floor = Some(floor);
    }
    for _ in 0..PLANES {
        if points.len() < wanted.max(3) {
            break;
        }
        let Some(plane) = largest_plane(cloud, &cells, &points, &mut rng) else {
            break;
        };
        let (inliers, rest): (Vec<P3>, Vec<P3>) = points
            .iter()
            .partition(|p| plane.distance(p).abs() < tolerance(&plane, p));
        if inliers.len() < wanted {
            break;
        }
        points = rest;
        let Some((_, _, variance)) = principal_axes(&inliers) else {
            break;
        };
        if variance[1].sqrt() < SPREAD {
            continue;
        }
        let behind = all
            .iter()
            .filter(|p| plane.distance(p) < -2.0 * tolerance(&plane, p))
            .count();
        if behind as f64 > BEHIND * total as f64 || area(cloud, &inliers) < LEAST_BACKGROUND {
            continue;
        }
        // Up in the image is −y: tables and steps are no background.
        if -plane.normal.y <= FLOOR_TILT.cos() {
            scene.background.push(plane);
        }
    }
    // Where a wall stands on the floor its lowest readings pull the floor up: once more without them.
    if let Some(floor) = scene.floor.as_mut() {
        let on_wall = |p: &P3| {
            scene
                .background
                .iter()
                .any(|b| b.distance(p).abs() < tolerance(b, p))
        };
        let free: Vec<P3> = all.iter().filter(|p| !on_wall(p)).copied().collect();
        for _ in 0..2 {
            *floor = polish(floor, &free, wanted / 2).unwrap_or(*floor);
        }
    }
    scene
}

/// Area of the view that points in every second cell stand for, as if they faced the camera, m².
fn area(cloud: &OrganisedCloud, points: &[P3]) -> f64 {
    let [fx, fy] = cloud.focal();
    points
        .iter()
        .map(|p| f64::from(4.0 * p.z * p.z / (fx * fy)))
        .sum()
}

/// The floor: of all planes that face up and have hardly anything below them, the one that holds the most points.
/// Counting heights along a fixed set of directions finds floors that fill a few rows of a coarse picture, which random
/// triples miss.
fn find_floor(all: &[P3], wanted: usize) -> Option<Plane> {
    let step = all.len().div_ceil(FLOOR_POINTS).max(1);
    let some: Vec<P3> = all.iter().step_by(step).copied().collect();
    let least = (wanted / step).max(3);
    let (pitch, roll, _) = vote(&some, PITCHES, ROLLS, HEIGHTS, least)?;
    let around = |at: f64, [_, _, by]: [f64; 3]| [at - by, at + by, by / FINER];
    let fine = [HEIGHTS[0], HEIGHTS[1], HEIGHTS[2] * 0.5];
    let (_, _, mut plane) = vote(
        &some,
        around(pitch, PITCHES),
        around(roll, ROLLS),
        fine,
        least / 2,
    )?;
    for _ in 0..4 {
        plane = polish(&plane, all, wanted)?;
    }
    let behind = all
        .iter()
        .filter(|p| plane.distance(p) < -2.0 * tolerance(&plane, p))
        .count();
    let up = -plane.normal.y > FLOOR_TILT.cos();
    (up && behind as f64 <= BEHIND * all.len() as f64).then_some(plane)
}

/// The plane of least squares through the points near `plane`; `None` when they are too few or lie along a line.
fn polish(plane: &Plane, points: &[P3], wanted: usize) -> Option<Plane> {
    let inliers: Vec<P3> = points
        .iter()
        .filter(|p| plane.distance(p).abs() < tolerance(plane, p))
        .copied()
        .collect();
    let (centroid, axes, variance) = principal_axes(&inliers)?;
    if inliers.len() < wanted || variance[1].sqrt() < SPREAD {
        return None;
    }
    through(&centroid, &axes.column(2).into_owned())
}

/// The pitch, roll and plane whose pair of neighbouring height bins holds the most points, `least` at least, with next
/// to nothing below. Ranges are first, last and step.
fn vote(
    points: &[P3],
    pitches: [f64; 3],
    rolls: [f64; 3],
    heights: [f32; 3],
    least: usize,
) -> Option<(f64, f64, Plane)> {
    let below = (BEHIND * points.len() as f64) as usize;
    let bins = ((heights[1] - heights[0]) / heights[2]) as usize;
    let range = |[from, to, by]: [f64; 3]| {
        (0..=((to - from) / by).round() as usize).map(move |i| from + by * i as f64)
    };
    let mut best: Option<(usize, f64, f64, Plane)> = None;
    let mut counts = vec![0usize; bins];
    for pitch in range(pitches) {
        for roll in range(rolls) {
            let normal = Vector3::new(
                roll.sin(),
                -roll.cos() * pitch.cos(),
                -roll.cos() * pitch.sin(),
            );
            let n = normal.cast::<f32>();
            counts.fill(0);
            let mut deeper = 0;
            for p in points {
                // Height below the camera along the candidate's down.
                let h = (-n.dot(&p.coords) - heights[0]) / heights[2];
                if h >= bins as f32 {
                    deeper += 1;
                } else if h >= 0.0 {
                    counts[h as usize] += 1;
                }
            }
            // From the lowest upward, two bins at a time, while next to nothing lies below.
            for b in (1..bins).rev() {
                if deeper > below {
                    break;
                }
                let count = counts[b] + counts[b - 1];
                if count >= least && best.is_none_or(|(c, ..)| count > c) {
                    let offset = f64::from(heights[0] + heights[2] * b as f32);
                    best = Some((count, pitch, roll, Plane { normal, offset }));
                }
                deeper += counts[b];
            }
        }
    }
    best.map(|(_, pitch, roll, plane)| (pitch, roll, plane))
}

/// Best plane of random neighbouring triples, polished twice by least squares on its inliers.
fn largest_plane(
    cloud: &OrganisedCloud,
    cells: &[usize],
    points: &[P3],
    rng: &mut rand_pcg::Pcg32,
) -> Option<Plane> {
    let columns = cloud.size().0;
    let count = |plane: &Plane, step: usize| {
        points
            .iter()
            .step_by(step)
            .filter(|p| plane.distance(p).abs() < tolerance(plane, p))
            .count()
    };
    let mut best: Option<(usize, Plane)> = None;
    for _ in 0..TRIALS {
        let at = cells[rng.random_range(0..cells.len())];
        let mut near = || {
            let (du, dv) = (
                rng.random_range(-TRIPLE_REACH..=TRIPLE_REACH),
                rng.random_range(-TRIPLE_REACH..=TRIPLE_REACH),
            );
            let cell = cloud.cell((at % columns) as i32 + du, (at / columns) as i32 + dv)?;
            (cloud.depth[cell] > 0.0).then(|| cloud.centre(cell).cast::<f64>())
        };
        let (Some(b), Some(c)) = (near(), near()) else {
            continue;
        };
        let a = cloud.centre(at).cast::<f64>();
        let Some(plane) = through(&a, &(b - a).cross(&(c - a))) else {
            continue;
        };
        let score = count(&plane, 4);
        if best.is_none_or(|(s, _)| score > s) {
            best = Some((score, plane));
        }
    }
    let (_, mut plane) = best?;
    for _ in 0..2 {
        let inliers: Vec<P3> = points
            .iter()
            .filter(|p| plane.distance(p).abs() < tolerance(&plane, p))
            .copied()
            .collect();
        let (centroid, axes, _) = principal_axes(&inliers)?;
        plane = through(&centroid, &axes.column(2).into_owned())?;
    }
    Some(plane)
}

fn through(p: &Point3<f64>, normal: &Vector3<f64>) -> Option<Plane> {
    let n = normal.try_normalize(f64::EPSILON)?;
    let offset = -n.dot(&p.coords);
    Some(if offset < 0.0 {
        Plane {
            normal: -n,
            offset: -offset,
        }
    } else {
        Plane { normal: n, offset }
    })
}

impl ScenePlanes {
    /// The world's upright frame: floor at y = 0 below the camera, −z where the camera looks. Without a floor the
    /// camera counts as level at `height` metres.
    pub fn world_from_camera(&self, height: f64) -> Rigid<World, Camera> {
        let Some(floor) = self.floor else {
            return Rigid::level(height);
        };
        let up = floor.normal;
        let forward = Vector3::z();
        let Some(back) = (-(forward - up * up.dot(&forward))).try_normalize(f64::EPSILON) else {
            return Rigid::level(height);
        };
        let right = up.cross(&back);
        // Rows are the world's axes in camera coordinates.
        let rotation =
            nalgebra::Matrix3::from_rows(&[right.transpose(), up.transpose(), back.transpose()]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Rigid::from_parts(Vector3::new(0.0, floor.offset, 0.0), rotation)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::camera::{DepthImage, Intrinsics};

    /// A room seen from 1.1 m, pitched down by `pitch`: floor and a wall at 4 m, with a box of 0.4 × 1.7 × 0.25 m
    /// standing at 2.5 m when `person`.
    pub(crate) fn room(pitch: f64, person: bool) -> (OrganisedCloud, DepthImage) {
        let k = Intrinsics {
            width: 320,
            height: 240,
            fx: 262.5,
            fy: 262.5,
            cx: 159.5,
            cy: 119.5,
        };
        let (sin, cos) = pitch.sin_cos();
        let data = (0..k.pixels()).map(|i| {
            let (x, y) = (
                ((i % 320) as f64 - k.cx) / k.fx,
                ((i / 320) as f64 - k.cy) / k.fy,
            );
            // Ray in a level frame (y down).
            let d = Vector3::new(x, y * cos + sin, cos - y * sin);
            let mut z = f64::INFINITY;
            if d.y > 0.0 {
                z = z.min(1.1 / d.y);
            }
            z = z.min(4.0 / d.z);
            if person {
                let t = 2.5 / d.z;
                let (px, py) = (t * d.x, 1.1 - t * d.y);
                if px.abs() < 0.2 && (0.0..1.7).contains(&py) {
                    z = z.min(t);
                }
            }
            (z * 1000.0).clamp(0.0, 60_000.0) as u16
        });
        let image = DepthImage::new(320, 240, data.collect()).expect("sizes agree");
        let mut cloud = OrganisedCloud::new(&k, Some(2));
        cloud.sample(&image, 8.0);
        (cloud, image)
    }

    #[test]
    fn floor_wall_and_gravity_are_found() {
        for pitch in [0.0, 0.2, -0.05] {
            let (cloud, _) = room(pitch, true);
            let scene = find_planes(&cloud);
            let floor = scene
                .floor
                .unwrap_or_else(|| panic!("no floor at pitch {pitch}"));
            assert!((floor.offset - 1.1).abs() < 0.01, "height {}", floor.offset);
            assert_eq!(scene.background.len(), 1, "the wall");
            let world = scene.world_from_camera(0.0);
            let up = world.vector(&Vector3::new(0.0, -pitch.cos(), -pitch.sin()));
            assert!((up - Vector3::y()).norm() < 0.02, "{up}");
            assert!((world.point(&Point3::origin()).y - 1.1).abs() < 0.01);
        }
    }

    #[test]
    fn bands_are_the_tolerances_solved_for_depth() {
        let (cloud, _) = room(0.15, true);
        let scene = find_planes(&cloud);
        let mut bands = Bands::default();
        bands.update(&scene, &cloud);
        let (floor, wall) = (scene.floor.expect("floor"), scene.background[0]);
        let mut differ = 0;
        for i in 0..cloud.depth.len() {
            let (u, v) = ((i % cloud.size().0) as f32, (i / cloud.size().0) as f32);
            for step in 1..40 {
                let z = 0.2 * step as f32;
                let p = cloud.unproject(u, v, z);
                let inside = |[lo, hi]: [f32; 2]| z > lo && z < hi;
                let on_floor = floor.distance(&p).abs() < tolerance(&floor, &p);
                let on_wall =
                    wall.distance(&p).abs() < tolerance(&wall, &p).max(BACKGROUND_TOLERANCE);
                differ += usize::from(inside(bands.floor[i]) != on_floor);
                differ += usize::from(inside(bands.background[0][i]) != on_wall);
            }
        }
        assert!(
            differ < cloud.depth.len() * 40 / 10_000,
            "{differ} of {}",
            cloud.depth.len() * 40
        );
    }

    #[test]
    fn a_person_alone_is_no_plane_and_nothing_is_no_plane() {
        let (mut cloud, _) = room(0.0, true);
        for i in 0..cloud.depth.len() {
            let p = cloud.centre(i);
            if (p.z - 2.5).abs() > 0.02 || p.x.abs() > 0.21 {
                cloud.depth[i] = 0.0;
            }
        }
        assert_eq!(find_planes(&cloud), ScenePlanes::default());
        cloud.depth.fill(0.0);
        assert_eq!(find_planes(&cloud), ScenePlanes::default());
        assert!(
            ScenePlanes::default()
                .world_from_camera(1.3)
                .point(&Point3::origin())
                .y
                == 1.3
        );
    }
}
