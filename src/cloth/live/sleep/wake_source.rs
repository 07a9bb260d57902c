//! Moving skin and cloth that wake what sleeps near them.

use super::state::SleepState;
use crate::live::outfit_model::Model;
use crate::live::state::GarmentState;
use tryon_geometry::math::{P3, V3};

/// Axis-aligned box, empty for no points.
#[derive(Clone, Copy, Debug)]
struct Aabb([V3; 2]);

impl Aabb {
    fn of(points: impl Iterator<Item = P3>) -> Self {
        let empty = [V3::repeat(f32::INFINITY), V3::repeat(f32::NEG_INFINITY)];
        Self(points.fold(empty, |[a, b], p| [a.inf(&p.coords), b.sup(&p.coords)]))
    }
    fn overlaps(&self, o: &Self, margin: f32) -> bool {
        (0..3).all(|d| self.0[0][d] - margin <= o.0[1][d] && o.0[0][d] - margin <= self.0[1][d])
    }
    fn contains(&self, p: &P3, margin: f32) -> bool {
        (0..3).all(|d| self.0[0][d] - margin <= p[d] && p[d] <= self.0[1][d] + margin)
    }
}

/// Points that move together.
struct WakeSource {
    points: Vec<P3>,
    bounds: Aabb,
    /// Distance within which they wake, metres.
    distance: f32,
    /// Garment and island of cloth, `None` for skin.
    island: Option<(usize, usize)>,
}

impl WakeSource {
    fn is_near(&self, cloth: &[P3], bounds: &Aabb) -> bool {
        if !self.bounds.overlaps(bounds, self.distance) {
            return false;
        }
        let own = self.points.iter();
        let here: Vec<&P3> = own.filter(|p| bounds.contains(p, self.distance)).collect();
        let mut there = cloth
            .iter()
            .filter(|p| self.bounds.contains(p, self.distance));
        let square = self.distance * self.distance;
        there.any(|p| here.iter().any(|q| (p - **q).norm_squared() < square))
    }
}

/// Everything that moves in a step.
#[derive(Default)]
pub(super) struct WakeSources(Vec<WakeSource>);

impl WakeSources {
    /// Adds points that wake within `distance` metres.
    pub(super) fn push(&mut self, points: Vec<P3>, distance: f32, island: Option<(usize, usize)>) {
        self.0.push(WakeSource {
            bounds: Aabb::of(points.iter().copied()),
            points,
            distance,
            island,
        });
    }
    /// Adds the islands that are awake and at least as fast as `speed`, m/s.
    pub(super) fn push_moving_cloth(
        &mut self,
        model: &Model,
        garments: &[GarmentState],
        sleep: &SleepState,
        speed: f32,
    ) {
        for (g, (m, s)) in model.garments.iter().zip(garments).enumerate() {
            for (r, island) in sleep.islands[g].iter().enumerate() {
                if !island.asleep && island.speed >= speed {
                    let points = positions(s, &m.islands.members[r]);
                    self.push(points, m.islands.wake_distance, Some((g, r)));
                }
            }
        }
    }
    /// Something moves near island `r` of garment `g`, other than cloth sewn to it.
    pub(super) fn reach(
        &self,
        model: &Model,
        garments: &[GarmentState],
        g: usize,
        r: usize,
    ) -> bool {
        let islands = &model.garments[g].islands;
        let own = positions(&garments[g], &islands.members[r]);
        let bounds = Aabb::of(own.iter().copied());
        let is_adjacent = |s: &WakeSource| {
            s.island
                .is_some_and(|(h, q)| h == g && islands.adjacent[r].contains(&(q as u32)))
        };
        let mut others = self.0.iter().filter(|s| !is_adjacent(s));
        others.any(|s| s.is_near(&own, &bounds))
    }
}

fn positions(s: &GarmentState, vertices: &[u32]) -> Vec<P3> {
    vertices.iter().map(|v| s.positions[*v as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn source_is_near_exactly_within_its_distance_and_an_empty_one_never() {
        let mut sources = WakeSources::default();
        sources.push(vec![P3::origin(), P3::new(0.1, 0.0, 0.0)], 0.03, None);
        sources.push(Vec::new(), 1.0, None);
        let near = |x: f32, y: f32| {
            let cloth = [P3::new(9.0, 9.0, 9.0), P3::new(x, y, 0.0)];
            let bounds = Aabb::of(cloth.iter().copied());
            [0, 1].map(|k: usize| sources.0[k].is_near(&cloth, &bounds))
        };
        assert_eq!(near(0.129, 0.0), [true, false]);
        assert_eq!(near(0.131, 0.0), [false, false]);
        // Within the margin of the box, but between the points.
        assert_eq!(near(0.05, 0.02), [false, false]);
    }
}
