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
/// At most this share of the readings lies behind a background plane.
const BEHIND: f64 = 0.03;
/// Random triples tried for each plane; a floor that fills a fifth of the picture is hit with 1 − 10⁻⁵.
const TRIALS: usize = 150;
/// Planes looked for.
const PLANES: usize = 4;
/// Corners of a random triple are at most this many cells apart, so that they likely share a plane.
const TRIPLE_REACH: i32 = 20;

/// How far a point of a plane may seem away from it.
pub(super) fn tolerance(plane: &Plane, p: &P3) -> f32 {
    // Depth noise acts along the ray; only its part along the normal leaves the plane.
    let along = (plane.normal.cast::<f32>().dot(&p.coords) / p.coords.norm().max(f32::MIN_POSITIVE)).abs();
    FLOOR_TOLERANCE + NOISE_PER_SQUARE_METRE * p.z * p.z * along
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
    for _ in 0..PLANES {
        if points.len() < wanted.max(3) {
            break;
        }
        let Some(plane) = largest_plane(cloud, &cells, &points, &mut rng) else { break };
        let (inliers, rest): (Vec<P3>, Vec<P3>) =
            points.iter().partition(|p| plane.distance(p).abs() < tolerance(&plane, p));
        if inliers.len() < wanted {
            break;
        }
        points = rest;
        let Some((_, _, variance)) = principal_axes(&inliers) else { break };
        if variance[1].sqrt() < SPREAD {
            continue;
        }
        let behind = all.iter().filter(|p| plane.distance(p) < -2.0 * tolerance(&plane, p)).count();
        if behind as f64 > BEHIND * total as f64 {
            continue;
        }
        // Up in the image is −y.
        if -plane.normal.y > FLOOR_TILT.cos() {
            if scene.floor.is_none() {
                scene.floor = Some(plane);
            }
        } else {
            scene.background.push(plane);
        }
    }
    scene
}

/// Best plane of random neighbouring triples, polished twice by least squares on its inliers.
fn largest_plane(cloud: &OrganisedCloud, cells: &[usize], points: &[P3], rng: &mut rand_pcg::Pcg32) -> Option<Plane> {
    let columns = cloud.size().0;
    let count = |plane: &Plane, step: usize| {
        points.iter().step_by(step).filter(|p| plane.distance(p).abs() < tolerance(plane, p)).count()
    };
    let mut best: Option<(usize, Plane)> = None;
    for _ in 0..TRIALS {
        let at = cells[rng.random_range(0..cells.len())];
        let mut near = || {
            let (du, dv) =
                (rng.random_range(-TRIPLE_REACH..=TRIPLE_REACH), rng.random_range(-TRIPLE_REACH..=TRIPLE_REACH));
            let cell = cloud.cell((at % columns) as i32 + du, (at / columns) as i32 + dv)?;
            (cloud.depth[cell] > 0.0).then(|| cloud.centre(cell).cast::<f64>())
        };
        let (Some(b), Some(c)) = (near(), near()) else { continue };
        let a = cloud.centre(at).cast::<f64>();
        let Some(plane) = through(&a, &(b - a).cross(&(c - a))) else { continue };
        let score = count(&plane, 4);
        if best.is_none_or(|(s, _)| score > s) {
            best = Some((score, plane));
        }
    }
    let (_, mut plane) = best?;
    for _ in 0..2 {
        let inliers: Vec<P3> =
            points.iter().filter(|p| plane.distance(p).abs() < tolerance(&plane, p)).copied().collect();
        let (centroid, axes, _) = principal_axes(&inliers)?;
        plane = through(&centroid, &axes.column(2).into_owned())?;
    }
    Some(plane)
}

fn through(p: &Point3<f64>, normal: &Vector3<f64>) -> Option<Plane> {
    let n = normal.try_normalize(f64::EPSILON)?;
    let offset = -n.dot(&p.coords);
    Some(if offset < 0.0 { Plane { normal: -n, offset: -offset } } else { Plane { normal: n, offset } })
}

impl ScenePlanes {
    /// The world's upright frame: floor at y = 0 below the camera, −z where the camera looks. Without a floor the
    /// camera counts as level at `height` metres.
    pub fn world_from_camera(&self, height: f64) -> Rigid<World, Camera> {
        let Some(floor) = self.floor else { return Rigid::level(height) };
        let up = floor.normal;
        let forward = Vector3::z();
        let Some(back) = (-(forward - up * up.dot(&forward))).try_normalize(f64::EPSILON) else {
            return Rigid::level(height);
        };
        let right = up.cross(&back);
        // Rows are the world's axes in camera coordinates.
        let rotation = nalgebra::Matrix3::from_rows(&[right.transpose(), up.transpose(), back.transpose()]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
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
        let k = Intrinsics { width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5 };
        let (sin, cos) = pitch.sin_cos();
        let data = (0..k.pixels()).map(|i| {
            let (x, y) = (((i % 320) as f64 - k.cx) / k.fx, ((i / 320) as f64 - k.cy) / k.fy);
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
            let floor = scene.floor.unwrap_or_else(|| panic!("no floor at pitch {pitch}"));
            assert!((floor.offset - 1.1).abs() < 0.01, "height {}", floor.offset);
            assert_eq!(scene.background.len(), 1, "the wall");
            let world = scene.world_from_camera(0.0);
            let up = world.vector(&Vector3::new(0.0, -pitch.cos(), -pitch.sin()));
            assert!((up - Vector3::y()).norm() < 0.02, "{up}");
            assert!((world.point(&Point3::origin()).y - 1.1).abs() < 0.01);
        }
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
        assert!(ScenePlanes::default().world_from_camera(1.3).point(&Point3::origin()).y == 1.3);
    }
}
