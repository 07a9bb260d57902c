//! Floor below a person in a scan: a plane that the rest stands on.

use super::settings::ScanFloorSettings;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::collections::HashSet;
use tryon_geometry::math::order_statistics::quantile;
use tryon_geometry::math::{P3, V3, principal_axes};

/// Plane with everything else on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Floor {
    /// Unit normal towards what stands on it.
    pub(super) up: V3,
    /// Height of the plane along the normal, units of the cloud.
    height: f32,
    thickness: f32,
    settings: ScanFloorSettings,
}

impl Floor {
    /// Floor of a cloud; points that are not finite are passed over.
    pub(super) fn find(points: &[P3], settings: &ScanFloorSettings) -> Option<Self> {
        let is_finite = |p: &&P3| p.iter().all(|c| c.is_finite());
        let finite: Vec<P3> = points.iter().filter(is_finite).copied().collect();
        let stride = finite.len().div_ceil(settings.samples).max(1);
        let some: Vec<P3> = finite.iter().step_by(stride).copied().collect();
        if some.len() < 100 {
            return None;
        }
        let extents = (0..3).map(|a| spread(some.iter().map(|p| p[a]), settings.strays));
        let extent = extents.fold(0.0, f32::max);
        let mut random = Pcg32::seed_from_u64(1);
        let mut best: Option<(usize, Self)> = None;
        for _ in 0..settings.trials {
            let corners = [(); 3].map(|()| some[random.random_range(0..some.len())]);
            let Some(plane) = Self::through(corners, settings.thickness * extent, settings) else {
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
        let is_large = on as f64 >= settings.least_share * some.len() as f64;
        (is_large && floor.carries(&some)).then(|| floor.thickened(&finite))
    }

    /// The plane through the middle of its points, as thick as they spread: only noise lies below a floor, and as much of
    /// it above.
    fn thickened(self, points: &[P3]) -> Self {
        let near = |p: &&P3| self.over(p).abs() < self.settings.most_spread * self.thickness;
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
        let [_, spread] = inner_range(below.map(|d| middle - d), self.settings.strays);
        if spread < self.thickness {
            return self;
        }
        Self {
            height: height + middle,
            thickness: spread,
            ..level
        }
    }

    fn through([a, b, c]: [P3; 3], thickness: f32, settings: &ScanFloorSettings) -> Option<Self> {
        let up = (b - a).cross(&(c - a)).try_normalize(f32::MIN_POSITIVE)?;
        Some(Self {
            up,
            height: up.dot(&a.coords),
            thickness,
            settings: *settings,
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
        let most = (self.settings.most_below * points.len() as f64) as usize;
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
        let settings = &self.settings;
        let tall = spread(rest.iter().map(|p| self.over(p)), settings.strays);
        let aside = self.up.cross(&V3::x());
        let aside = if aside.norm() > 0.5 {
            aside
        } else {
            self.up.cross(&V3::z())
        }
        .normalize();
        let wide = [aside, self.up.cross(&aside)].map(|axis| {
            let along =
                |part: &[&P3]| spread(part.iter().map(|p| axis.dot(&p.coords)), settings.strays);
            [along(&on), along(&rest)]
        });
        let is_wide = wide.iter().all(|[on, _]| *on > settings.least_width * tall);
        is_wide && wide.iter().all(|[_, rest]| tall >= settings.upright * rest)
    }
}

/// Points low over a floor, and farther from all legs than feet reach; y up, metres. Shape `[points]`.
pub(super) fn are_floor_rests(points: &[P3], top: f32, settings: &ScanFloorSettings) -> Vec<bool> {
    let (low, legs, side) = (settings.low, settings.legs, settings.foot_cell);
    let over = |p: &P3| p.y - top;
    let cell = |p: &P3| [p.x, p.z].map(|c| (c / side).floor() as i32);
    let is_leg = |p: &&P3| (low..legs).contains(&over(p));
    let legs: HashSet<[i32; 2]> = points.iter().filter(is_leg).map(cell).collect();
    if legs.is_empty() {
        return vec![false; points.len()];
    }
    let reach = (settings.foot / side) as i32;
    let around = (-reach..=reach).flat_map(|a| (-reach..=reach).map(move |b| [a, b]));
    let around = around.filter(|[a, b]| a * a + b * b <= reach * reach);
    let around: Vec<[i32; 2]> = around.collect();
    let near = legs
        .iter()
        .flat_map(|[x, z]| around.iter().map(move |[a, b]| [x + a, z + b]));
    let near: HashSet<[i32; 2]> = near.collect();
    let is_rest = |p: &P3| over(p) < low && !near.contains(&cell(p));
    points.iter().map(is_rest).collect()
}

/// Length of the range of some values without strays.
fn spread(values: impl Iterator<Item = f32>, strays: f64) -> f32 {
    let [low, high] = inner_range(values, strays);
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
            let y = lowest + 0.01 * (random.random::<f32>() - 0.5);
            points.push(P3::new(x, y, z));
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
        let rests = are_floor_rests(&points, lowest, &ScanFloorSettings::default());
        assert_eq!(rests[person..], [true, true, false]);
        assert!(!rests[..person].contains(&true));
    }

    #[test]
    fn a_floor_is_found_with_its_up_and_people_have_none() {
        let settings = ScanFloorSettings::default();
        for (size, tilt) in [(1.5, 0.0), (4.0, 0.3), (3.0, 3.0)] {
            let points = person_on_floor(size, 4000, tilt);
            let floor = Floor::find(&points, &settings).expect("a floor");
            let up = nalgebra::Rotation3::from_axis_angle(&V3::x_axis(), tilt) * V3::y();
            assert!(floor.up.dot(&up) > 0.999, "{size} {tilt}: {:?}", floor.up);
            let kept = points.iter().filter(|p| !floor.holds(p)).count();
            let person = points.len() - 4000;
            assert!(kept <= person && kept * 10 > person * 9, "{kept}");
        }
        assert_eq!(Floor::find(&person_on_floor(1.0, 0, 0.0), &settings), None);
        assert_eq!(Floor::find(&[], &settings), None);
    }
}
