//! Plane search: the floor by voting, background planes by RANSAC, both refitted by least squares.

use super::planes::{ScenePlane, ScenePlanes};
use crate::settings::PlaneSettings;
use nalgebra::{Point3, Vector3};
use rand::{Rng, SeedableRng};
use tryon_geometry::math::{P3, principal_axes};
use tryon_geometry::spatial::OrganisedCloud;

/// Seed of the random triples.
const SEED: u64 = 0x5eed;

/// Finds the floor and the background planes of a sampled cloud. Deterministic: the same cloud gives the same planes.
pub fn find_planes(cloud: &OrganisedCloud, settings: &PlaneSettings) -> ScenePlanes {
    let (columns, rows) = cloud.size();
    // Every second cell in both directions suffices for planes.
    let cells: Vec<usize> = (0..rows)
        .step_by(2)
        .flat_map(|r| (0..columns).step_by(2).map(move |c| r * columns + c))
        .filter(|&i| cloud.depth[i] > 0.0)
        .collect();
    let search = PlaneSearch {
        cloud,
        points: cells.iter().map(|&i| cloud.centre(i)).collect(),
        cells,
        wanted: (settings.share * (columns * rows) as f64 / 4.0) as usize,
        settings,
    };
    let floor = search.floor();
    let background = search.background(floor.as_ref());
    // The lowest readings of a wall that stands on the floor pull the floor up: refit without them.
    let floor = floor.map(|mut floor| {
        let on_wall = |p: &P3| background.iter().any(|b| b.contains(p, settings));
        let points = search.points.iter();
        let free: Vec<P3> = points.filter(|p| !on_wall(p)).copied().collect();
        for _ in 0..2 {
            floor = search
                .polish(&floor, &free, search.wanted / 2)
                .unwrap_or(floor);
        }
        floor
    });
    ScenePlanes { floor, background }
}

/// Grid of directions and heights of a vote, each first, last and step, radians and metres.
struct VoteGrid {
    pitches: [f64; 3],
    rolls: [f64; 3],
    heights: [f32; 3],
}

/// Search for the planes of one cloud.
struct PlaneSearch<'a> {
    cloud: &'a OrganisedCloud,
    /// Cells with a reading, and their points.
    cells: Vec<usize>,
    points: Vec<P3>,
    /// Least points on a plane.
    wanted: usize,
    settings: &'a PlaneSettings,
}

impl PlaneSearch<'_> {
    /// Background planes by RANSAC on the points that are not floor, largest first.
    fn background(&self, floor: Option<&ScenePlane>) -> Vec<ScenePlane> {
        let (settings, wanted) = (self.settings, self.wanted);
        let mut points = self.points.clone();
        if let Some(floor) = floor {
            points.retain(|p| !floor.contains(p, settings));
        }
        let mut rng = rand_pcg::Pcg32::seed_from_u64(SEED);
        let mut background = Vec::new();
        for _ in 0..settings.most_planes {
            if points.len() < wanted.max(3) {
                break;
            }
            let Some(plane) = self.largest_plane(&points, &mut rng) else {
                break;
            };
            let (inliers, rest): (Vec<P3>, Vec<P3>) =
                points.iter().partition(|p| plane.contains(p, settings));
            if inliers.len() < wanted {
                break;
            }
            points = rest;
            let Some((_, _, variance)) = principal_axes(&inliers) else {
                break;
            };
            // Up in the image is −y: tables and steps are no background.
            if variance[1].sqrt() >= settings.spread
                && self.is_last_surface(&plane)
                && self.area(&inliers) >= settings.least_background
                && -plane.normal.y <= settings.floor_tilt.cos()
            {
                background.push(plane);
            }
        }
        background
    }

    /// True if next to no points lie behind the plane.
    fn is_last_surface(&self, plane: &ScenePlane) -> bool {
        let (points, settings) = (&self.points, self.settings);
        let behind = points
            .iter()
            .filter(|p| plane.distance(p) < -2.0 * plane.tolerance(p, settings))
            .count();
        behind as f64 <= settings.behind * points.len() as f64
    }

    /// Area that points in every second cell represent, as if they faced the camera, m².
    fn area(&self, points: &[P3]) -> f64 {
        let [fx, fy] = self.cloud.focal();
        points
            .iter()
            .map(|p| f64::from(4.0 * p.z * p.z / (fx * fy)))
            .sum()
    }

    /// The floor: of all planes that face up with next to no points below, the one with the most inliers.
    /// Voting over a grid of directions and heights finds floors that fill a few image rows, which RANSAC misses.
    fn floor(&self) -> Option<ScenePlane> {
        let (settings, all) = (self.settings, &self.points);
        let step = all.len().div_ceil(settings.floor_points).max(1);
        let some: Vec<P3> = all.iter().step_by(step).copied().collect();
        let least = (self.wanted / step).max(3);
        let coarse = VoteGrid {
            pitches: settings.pitches,
            rolls: settings.rolls,
            heights: settings.heights,
        };
        let (pitch, roll, _) = self.vote(&some, &coarse, least)?;
        let around = |at: f64, [_, _, by]: [f64; 3]| [at - by, at + by, by / settings.finer];
        let [lowest, highest, bin] = settings.heights;
        let fine = VoteGrid {
            pitches: around(pitch, settings.pitches),
            rolls: around(roll, settings.rolls),
            heights: [lowest, highest, bin * 0.5],
        };
        let (_, _, mut plane) = self.vote(&some, &fine, least / 2)?;
        for _ in 0..settings.floor_refits {
            plane = self.polish(&plane, all, self.wanted)?;
        }
        let up = -plane.normal.y > settings.floor_tilt.cos();
        (up && self.is_last_surface(&plane)).then_some(plane)
    }

    /// Least-squares plane through the inliers of `plane`; `None` if they are fewer than `wanted` or lie along a line.
    fn polish(&self, plane: &ScenePlane, points: &[P3], wanted: usize) -> Option<ScenePlane> {
        let settings = self.settings;
        let inliers: Vec<P3> = points
            .iter()
            .filter(|p| plane.contains(p, settings))
            .copied()
            .collect();
        let (centroid, axes, variance) = principal_axes(&inliers)?;
        if inliers.len() < wanted || variance[1].sqrt() < settings.spread {
            return None;
        }
        through(&centroid, &axes.column(2).into_owned())
    }

    /// Pitch, roll and plane of the fullest pair of neighbouring height bins, with at least `least` points and next to none
    /// below.
    fn vote(&self, points: &[P3], grid: &VoteGrid, least: usize) -> Option<(f64, f64, ScenePlane)> {
        let heights = grid.heights;
        let below = (self.settings.behind * points.len() as f64) as usize;
        let bins = ((heights[1] - heights[0]) / heights[2]) as usize;
        let range = |[from, to, by]: [f64; 3]| {
            (0..=((to - from) / by).round() as usize).map(move |i| from + by * i as f64)
        };
        let mut best: Option<(usize, f64, f64, ScenePlane)> = None;
        let mut counts = vec![0usize; bins];
        for pitch in range(grid.pitches) {
            for roll in range(grid.rolls) {
                let normal = Vector3::new(
                    roll.sin(),
                    -roll.cos() * pitch.cos(),
                    -roll.cos() * pitch.sin(),
                );
                let n = normal.cast::<f32>();
                counts.fill(0);
                let mut deeper = 0;
                for p in points {
                    // Height below the camera along the normal of the candidate.
                    let h = (-n.dot(&p.coords) - heights[0]) / heights[2];
                    if h >= bins as f32 {
                        deeper += 1;
                    } else if h >= 0.0 {
                        counts[h as usize] += 1;
                    }
                }
                // From the lowest upward, two bins at a time, while next to no points lie below.
                for b in (1..bins).rev() {
                    if deeper > below {
                        break;
                    }
                    let count = counts[b] + counts[b - 1];
                    if count >= least && best.is_none_or(|(c, ..)| count > c) {
                        let offset = f64::from(heights[0] + heights[2] * b as f32);
                        best = Some((count, pitch, roll, ScenePlane { normal, offset }));
                    }
                    deeper += counts[b];
                }
            }
        }
        best.map(|(_, pitch, roll, plane)| (pitch, roll, plane))
    }

    /// Best plane of random neighbouring triples (RANSAC), refitted twice by least squares on its inliers.
    fn largest_plane(&self, points: &[P3], rng: &mut rand_pcg::Pcg32) -> Option<ScenePlane> {
        let (cloud, cells, settings) = (self.cloud, &self.cells, self.settings);
        let columns = cloud.size().0;
        let count = |plane: &ScenePlane, step: usize| {
            points
                .iter()
                .step_by(step)
                .filter(|p| plane.contains(p, settings))
                .count()
        };
        let mut best: Option<(usize, ScenePlane)> = None;
        for _ in 0..settings.trials {
            let at = cells[rng.random_range(0..cells.len())];
            let mut near = || {
                let (du, dv) = (
                    rng.random_range(-settings.triple_reach..=settings.triple_reach),
                    rng.random_range(-settings.triple_reach..=settings.triple_reach),
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
            let score = count(&plane, settings.score_step);
            if best.is_none_or(|(s, _)| score > s) {
                best = Some((score, plane));
            }
        }
        let (_, mut plane) = best?;
        for _ in 0..2 {
            let inliers: Vec<P3> = points
                .iter()
                .filter(|p| plane.contains(p, settings))
                .copied()
                .collect();
            let (centroid, axes, _) = principal_axes(&inliers)?;
            plane = through(&centroid, &axes.column(2).into_owned())?;
        }
        Some(plane)
    }
}

/// Plane through a point with this normal, turned to the camera's side; `None` for a zero normal.
fn through(p: &Point3<f64>, normal: &Vector3<f64>) -> Option<ScenePlane> {
    let n = normal.try_normalize(f64::EPSILON)?;
    let offset = -n.dot(&p.coords);
    Some(if offset < 0.0 {
        ScenePlane {
            normal: -n,
            offset: -offset,
        }
    } else {
        ScenePlane { normal: n, offset }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::fixture::room;

    #[test]
    fn floor_wall_and_gravity_are_found_at_any_pitch() {
        for pitch in [0.0, 0.2, -0.05] {
            let cloud = room(pitch, true);
            let scene = find_planes(&cloud, &Default::default());
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
    fn a_person_alone_and_an_empty_image_have_no_plane() {
        let mut cloud = room(0.0, true);
        for i in 0..cloud.depth.len() {
            let p = cloud.centre(i);
            if (p.z - 2.5).abs() > 0.02 || p.x.abs() > 0.21 {
                cloud.depth[i] = 0.0;
            }
        }
        assert_eq!(
            find_planes(&cloud, &Default::default()),
            ScenePlanes::default()
        );
        cloud.depth.fill(0.0);
        assert_eq!(
            find_planes(&cloud, &Default::default()),
            ScenePlanes::default()
        );
        assert!(
            ScenePlanes::default()
                .world_from_camera(1.3)
                .point(&Point3::origin())
                .y
                == 1.3
        );
    }
}
