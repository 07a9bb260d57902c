//! Floor below a person in a scan: a plane that the rest stands on.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::collections::HashSet;
use tryon_geometry::math::order_statistics::quantile;
use tryon_geometry::math::{P3, V3, principal_axes};

/// Points that planes are searched among.
const SAMPLES: usize = 2000;
/// Planes that are tried; three points lie on a floor of a tenth of all once in 1000.
const TRIALS: usize = 6000;
/// Distance of a floor's points from its plane, as a share of the cloud's extent: 13 mm for a person.
const THICKNESS: f32 = 0.007;
/// Least share of the points that make a floor.
const LEAST_SHARE: f64 = 0.08;
/// Most of the other points that lie below it, as a share of all.
const MOST_BELOW: f64 = 0.01;
/// Least height of what stands on it beside its width: a person's back is a plane too, with nothing standing on it.
const UPRIGHT: f32 = 0.7;
/// Least width of a floor beside the height of what stands on it: soles are none.
const LEAST_WIDTH: f32 = 0.25;
/// Share of points left out at each end of an extent: strays.
const STRAYS: f64 = 0.01;

/// Largest distance of a floor's points from its plane beside [`THICKNESS`]: those of several cameras disagree.
const MOST_SPREAD: f32 = 2.5;

/// Height of feet and of the rests of floors, and of legs, metres.
const LOW: f32 = 0.05;
const LEGS: f32 = 0.30;
/// Farthest that feet and heels reach from legs, and the side of a cell in which that is looked up, metres.
const FOOT: f32 = 0.22;
const FOOT_CELL: f32 = 0.02;

/// Plane with everything else on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Floor {
    /// Unit normal towards what stands on it.
    pub(super) up: V3,
    /// Height of the plane along the normal, units of the cloud.
    height: f32,
    thickness: f32,
}

impl Floor {
    /// Floor of a cloud; points that are not finite are passed over.
    pub(super) fn find(points: &[P3]) -> Option<Self> {
        let finite: Vec<P3> = points
            .iter()
            .filter(|p| p.iter().all(|c| c.is_finite()))
            .copied()
            .collect();
        let stride = finite.len().div_ceil(SAMPLES).max(1);
        let some: Vec<P3> = finite.iter().step_by(stride).copied().collect();
        if some.len() < 100 {
            return None;
        }
        let extent = (0..3)
            .map(|a| spread(some.iter().map(|p| p[a])))
            .fold(0.0, f32::max);
        let mut random = Pcg32::seed_from_u64(1);
        let mut best: Option<(usize, Self)> = None;
        for _ in 0..TRIALS {
            let corners = [(); 3].map(|()| some[random.random_range(0..some.len())]);
            let Some(plane) = Self::through(corners, THICKNESS * extent) else {
                continue;
            };
            // A plane that cuts through the cloud is no floor: most trials end after a few points.
            let Some((floor, on)) = plane.support(&some) else {
                continue;
            };
            if best.as_ref().is_none_or(|(n, _)| on > *n) {
                best = Some((on, floor));
            }
        }
        let (on, floor) = best?;
        let is_large = on as f64 >= LEAST_SHARE * some.len() as f64;
        (is_large && floor.carries(&some)).then(|| floor.thickened(&finite))
    }

    /// The plane through the middle of its points, as thick as they spread: only noise lies below a floor, and as much of
    /// it above.
    fn thickened(self, points: &[P3]) -> Self {
        let near = |p: &&P3| self.over(p).abs() < MOST_SPREAD * self.thickness;
        let near: Vec<P3> = points.iter().filter(near).copied().collect();
        let Some((middle, axes, _)) = principal_axes(&near) else {
            return self;
        };
        let normal: V3 = axes.column(2).into_owned().cast();
        let up = normal * normal.dot(&self.up).signum();
        let height = up.dot(&middle.coords.cast());
        let level = Self { up, height, ..self };
        let over = near.iter().map(|p| level.over(p));
        let [middle, _] = inner_range(over.clone(), 0.5);
        let below = over.filter(|d| *d < middle);
        let [_, spread] = inner_range(below.map(|d| middle - d), STRAYS);
        if spread < self.thickness {
            return self;
        }
        Self {
            height: height + middle,
            thickness: spread,
            ..level
        }
    }

    fn through([a, b, c]: [P3; 3], thickness: f32) -> Option<Self> {
        let up = (b - a).cross(&(c - a)).try_normalize(f32::MIN_POSITIVE)?;
        Some(Self {
            up,
            height: up.dot(&a.coords),
            thickness,
        })
    }

    /// Height of a point over the plane, units of the cloud.
    fn over(&self, p: &P3) -> f32 {
        self.up.dot(&p.coords) - self.height
    }

    /// Is part of the floor, or lies below it.
    pub(super) fn holds(&self, p: &P3) -> bool {
        self.over(p) < self.thickness
    }

    /// Height along the normal up to which points belong to it, units of the cloud.
    pub(super) fn top(&self) -> f32 {
        self.height + self.thickness
    }

    /// The plane turned to the side of the other points, and the number of points on it; `None` with points on both sides.
    fn support(mut self, points: &[P3]) -> Option<(Self, usize)> {
        let most = (MOST_BELOW * points.len() as f64) as usize;
        let (mut above, mut below, mut on) = (0, 0, 0);
        for p in points {
            let over = self.over(p);
            if over.abs() < self.thickness {
                on += 1;
            } else if over > 0.0 {
                above += 1;
            } else {
                below += 1;
            }
            if above.min(below) > most {
                return None;
            }
        }
        if below > above {
            (self.up, self.height) = (-self.up, -self.height);
        }
        Some((self, on))
    }

    /// It is wide, and what is not on it stands upright.
    fn carries(&self, points: &[P3]) -> bool {
        let (on, rest): (Vec<&P3>, Vec<&P3>) = points.iter().partition(|p| self.holds(p));
        let tall = spread(rest.iter().map(|p| self.over(p)));
        let aside = self.up.cross(&V3::x());
        let aside = if aside.norm() > 0.5 {
            aside
        } else {
            self.up.cross(&V3::z())
        }
        .normalize();
        let wide = [aside, self.up.cross(&aside)]
            .map(|axis| [&on, &rest].map(|part| spread(part.iter().map(|p| axis.dot(&p.coords)))));
        let is_wide = wide.iter().all(|[on, _]| *on > LEAST_WIDTH * tall);
        is_wide && wide.iter().all(|[_, rest]| tall >= UPRIGHT * rest)
    }
}

/// Points less than [`LOW`] over a floor, and farther from all legs than feet reach; y up, metres. Shape `[points]`.
pub(super) fn are_floor_rests(points: &[P3], top: f32) -> Vec<bool> {
    let over = |p: &P3| p.y - top;
    let cell = |p: &P3| [p.x, p.z].map(|c| (c / FOOT_CELL).floor() as i32);
    let is_leg = |p: &&P3| (LOW..LEGS).contains(&over(p));
    let legs: HashSet<[i32; 2]> = points.iter().filter(is_leg).map(cell).collect();
    if legs.is_empty() {
        return vec![false; points.len()];
    }
    let reach = (FOOT / FOOT_CELL) as i32;
    let around = (-reach..=reach).flat_map(|a| (-reach..=reach).map(move |b| [a, b]));
    let around = around.filter(|[a, b]| a * a + b * b <= reach * reach);
    let around: Vec<[i32; 2]> = around.collect();
    let near = legs
        .iter()
        .flat_map(|[x, z]| around.iter().map(move |[a, b]| [x + a, z + b]));
    let near: HashSet<[i32; 2]> = near.collect();
    let is_rest = |p: &P3| over(p) < LOW && !near.contains(&cell(p));
    points.iter().map(is_rest).collect()
}

/// Length of the range of some values without strays.
fn spread(values: impl Iterator<Item = f32>) -> f32 {
    let [low, high] = inner_range(values, STRAYS);
    high - low
}

/// Range of some finite values without a share of them at each end; zeros without any.
pub(super) fn inner_range(values: impl Iterator<Item = f32>, strays: f64) -> [f32; 2] {
    let mut all: Vec<f32> = values.collect();
    [strays, 1.0 - strays].map(|share| quantile(&mut all, share).unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    /// The template's vertices, and a floor of `size` metres under its feet, with `count` points, turned by `tilt` about x.
    fn person_on_floor(size: f32, count: usize, tilt: f32) -> Vec<P3> {
        let template = embedded::template();
        let mut points = template.mesh().vertices().to_vec();
        let lowest = points.iter().map(|p| p.y).fold(f32::MAX, f32::min);
        let mut random = Pcg32::seed_from_u64(3);
        for _ in 0..count {
            let [x, z] = [(); 2].map(|()| (random.random::<f32>() - 0.5) * size);
            points.push(P3::new(
                x,
                lowest + 0.01 * (random.random::<f32>() - 0.5),
                z,
            ));
        }
        let turn = nalgebra::Rotation3::from_axis_angle(&V3::x_axis(), tilt);
        points.iter().map(|p| turn * p).collect()
    }

    #[test]
    fn what_lies_low_and_apart_from_legs_is_floor() {
        let template = embedded::template();
        let mut points = template.mesh().vertices().to_vec();
        let lowest = points.iter().map(|p| p.y).fold(f32::MAX, f32::min);
        let person = points.len();
        points.extend([
            P3::new(0.7, lowest + 0.02, 0.0),
            P3::new(-0.1, lowest + 0.03, -0.6),
        ]);
        points.push(P3::new(0.9, lowest + 0.7, 0.0));
        let rests = are_floor_rests(&points, lowest);
        assert_eq!(rests[person..], [true, true, false]);
        assert!(!rests[..person].contains(&true));
    }

    #[test]
    fn a_floor_is_found_with_its_up_and_people_have_none() {
        for (size, tilt) in [(1.5, 0.0), (4.0, 0.3), (3.0, 3.0)] {
            let points = person_on_floor(size, 4000, tilt);
            let floor = Floor::find(&points).expect("a floor");
            let up = nalgebra::Rotation3::from_axis_angle(&V3::x_axis(), tilt) * V3::y();
            assert!(floor.up.dot(&up) > 0.999, "{size} {tilt}: {:?}", floor.up);
            let kept = points.iter().filter(|p| !floor.holds(p)).count();
            let person = points.len() - 4000;
            assert!(
                kept <= person && kept * 10 > person * 9,
                "{kept} of {person}"
            );
        }
        assert_eq!(Floor::find(&person_on_floor(1.0, 0, 0.0)), None);
        assert_eq!(Floor::find(&[]), None);
    }
}
