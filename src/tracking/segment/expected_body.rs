//! The body that is expected in a frame: which component it lies on, and where others begin who stand beside it.

use super::components::{Component, ComponentMap};
use crate::settings::ExpectedBodySettings;
use tryon_geometry::spatial::{OrganisedCloud, chessboard_distances};

/// The expected body; its depth in each cell, infinity beside it, metres, shape `[cells]`, is empty when nothing is expected.
#[derive(Clone, Copy)]
pub(super) struct ExpectedBody<'a> {
    pub(super) depth: &'a [f32],
    pub(super) settings: &'a ExpectedBodySettings,
}

/// Samples around a cell, in units of the reach.
const AROUND: [[f32; 2]; 13] = [
    [0.0, 0.0],
    [0.5, 0.0],
    [-0.5, 0.0],
    [0.0, 0.5],
    [0.0, -0.5],
    [1.0, 0.0],
    [-1.0, 0.0],
    [0.0, 1.0],
    [0.0, -1.0],
    [0.7, 0.7],
    [0.7, -0.7],
    [-0.7, 0.7],
    [-0.7, -0.7],
];

/// Area of a cell at depth `z` that faces the camera, m².
fn cell_area(cloud: &OrganisedCloud, z: f32) -> f32 {
    let [fx, fy] = cloud.focal();
    z * z / (fx * fy)
}

impl ExpectedBody<'_> {
    /// The component with the largest area on the body, where that is more than `least`, m².
    pub(super) fn covering<'m>(
        self,
        cloud: &OrganisedCloud,
        map: &'m ComponentMap,
        least: f32,
    ) -> Option<&'m Component> {
        let mut areas = vec![0.0f32; map.list.len()];
        for (i, z) in self.depth.iter().enumerate() {
            let id = map.of_cell[i];
            if id != ComponentMap::NONE && (cloud.depth[i] - z).abs() < self.settings.same_body {
                areas[id as usize] += cell_area(cloud, cloud.depth[i]);
            }
        }
        let of = |c: &Component| areas[c.id as usize];
        let covering = map.list.iter().filter(|c| of(c) > least);
        covering.max_by(|a, b| of(a).total_cmp(&of(b)).then(b.id.cmp(&a.id)))
    }

    /// Components near the body, across the view and in depth: its limbs, not who passes before it. All where nothing is
    /// expected. Shape `[components]`.
    pub(super) fn own(self, cloud: &OrganisedCloud, map: &ComponentMap) -> Vec<bool> {
        if self.depth.is_empty() {
            return vec![true; map.list.len()];
        }
        let mut near = vec![0usize; map.list.len()];
        for (cell, id) in map.of_cell.iter().enumerate() {
            if *id != ComponentMap::NONE && self.is_near(cloud, cell) {
                near[*id as usize] += 1;
            }
        }
        let share = self.settings.own_share;
        let own = |c: &Component| near[c.id as usize] as f32 >= share * c.cells as f32;
        map.list.iter().map(own).collect()
    }

    /// True for a reading near the body, by samples around it.
    fn is_near(self, cloud: &OrganisedCloud, cell: usize) -> bool {
        let settings = self.settings;
        let (columns, rows) = cloud.size();
        let z = cloud.depth[cell];
        let reach = settings.around * cloud.focal()[0] / z;
        let (u, v) = ((cell % columns) as f32, (cell / columns) as f32);
        let is_body = |[x, y]: [f32; 2]| {
            let (u, v) = (u + x * reach, v + y * reach);
            let is_inside = u >= 0.0 && v >= 0.0 && u < columns as f32 && v < rows as f32;
            is_inside
                && (self.depth[v as usize * columns + u as usize] - z).abs() < settings.same_body
        };
        AROUND.into_iter().any(is_body)
    }

    /// True where something stands before most of the body.
    pub(super) fn is_hidden(self, cloud: &OrganisedCloud) -> bool {
        let (mut hidden, mut drawn) = (0, 0);
        for (z, seen) in self.depth.iter().zip(&cloud.depth) {
            drawn += usize::from(z.is_finite());
            let is_before = *seen > 0.0 && *seen < z - self.settings.same_body;
            hidden += usize::from(z.is_finite() && is_before);
        }
        2 * hidden > drawn
    }

    /// Distance from the body beyond which cells are not the person's, cells, with the distances in `to_body`; `None` unless
    /// the members are larger than the body, so that something else may be among them.
    pub(super) fn split_limit(
        self,
        cloud: &OrganisedCloud,
        map: &ComponentMap,
        members: &[bool],
        to_body: &mut Vec<u16>,
    ) -> Option<u16> {
        let settings = self.settings;
        let drawn = self.depth.iter().filter(|z| z.is_finite());
        let (expected, depth, cells) = drawn.fold((0.0, 0.0, 0.0f32), |(area, depth, n), z| {
            (area + cell_area(cloud, *z), depth + z, n + 1.0)
        });
        let own = map.list.iter().filter(|c| members[c.id as usize]);
        let area: f32 = own.map(|c| c.area).sum();
        if expected < settings.least_area || area < settings.larger * expected {
            return None;
        }
        chessboard_distances(cloud, |k| self.depth[k].is_finite(), |_| u16::MAX, to_body);
        let focal = cloud.focal()[0].max(cloud.focal()[1]);
        Some((settings.around * focal * cells / depth).round() as u16)
    }
}

/// Takes components out of the members of which less than half of the cells are near the body.
pub(super) fn drop_others(
    map: &ComponentMap,
    main: &Component,
    near_body: impl Fn(usize) -> bool,
    members: &mut [bool],
) {
    let mut near = vec![0usize; map.list.len()];
    for (cell, id) in map.of_cell.iter().enumerate() {
        if *id != ComponentMap::NONE && near_body(cell) {
            near[*id as usize] += 1;
        }
    }
    for c in map.list.iter().filter(|c| c.id != main.id) {
        members[c.id as usize] &= 2 * near[c.id as usize] >= c.cells;
    }
}

#[cfg(test)]
mod tests {
    use crate::segment::fixture::cloud_of;
    use crate::segment::{PersonChoice, PersonPrior, ScenePlanes, SegmentScratch, find_person};
    use crate::settings::SegmentSettings;
    use tryon_geometry::math::P3;
    use tryon_geometry::spatial::OrganisedCloud;

    /// Two boxes of 0.4 × 1.4 m side by side at 2 m, whose gap is closed or not.
    fn pair(touching: bool) -> OrganisedCloud {
        cloud_of(|x, y| {
            let (x, y) = (x * 2.0, y * 2.0);
            let is_box = (0.2..0.6).contains(&x.abs()) && y.abs() < 0.7;
            let is_bridge = touching && x.abs() < 0.2 && y.abs() < 0.1;
            if is_box || is_bridge { 2000 } else { 0 }
        })
    }

    /// Columns of the person's first and last cell.
    fn columns(cloud: &mut OrganisedCloud, body: &[f32]) -> Option<(usize, usize)> {
        let prior = PersonPrior {
            centre: P3::new(0.0, 0.0, 2.0),
            reach: 0.8,
            body,
        };
        let scene = ScenePlanes::default();
        let choice = PersonChoice::Near(prior);
        let found = find_person(
            cloud,
            &scene,
            choice,
            &SegmentSettings::default(),
            &mut SegmentScratch::default(),
        );
        let columns = found.cells.iter().map(|c| *c as usize % cloud.size().0);
        Some((columns.clone().min()?, columns.max()?))
    }

    #[test]
    fn a_neighbour_is_neither_taken_for_the_person_nor_added() {
        for touching in [false, true] {
            for right in [false, true] {
                let mut cloud = pair(touching);
                let half = cloud.size().0 / 2;
                let is_own = |k: usize| (k % cloud.size().0 >= half) == right;
                let cells = 0..cloud.depth.len();
                let is_box = |k: usize| {
                    let p = cloud.centre(k);
                    cloud.depth[k] > 0.0 && p.x.abs() > 0.2
                };
                let body: Vec<f32> = cells
                    .map(|k| {
                        if is_box(k) && is_own(k) {
                            2.05
                        } else {
                            f32::INFINITY
                        }
                    })
                    .collect();
                let (first, last) = columns(&mut cloud, &body).expect("a person");
                // 15 cm beyond the body are 10 cells, and 20 cm separate it from the middle.
                assert!(
                    (first >= half) == right && (last >= half) == right,
                    "{first} {last}"
                );
            }
        }
    }

    #[test]
    fn who_passes_before_the_body_is_no_limb_of_it() {
        // A box at 2 m and, over its border, a bar of 0.3 × 1.2 m before it.
        let is_box = |x: f64, y: f64| x.abs() < 0.1 && y.abs() < 0.35;
        let alone = cloud_of(|x, y| if is_box(x, y) { 2000 } else { 0 });
        let drawn = alone.depth.iter();
        let body: Vec<f32> = drawn
            .map(|z| if *z > 0.0 { *z } else { f32::INFINITY })
            .collect();
        for (z, is_limb) in [(1.8, true), (1.4, false)] {
            let mut cloud = cloud_of(|x, y| {
                let is_bar = (0.1..0.4).contains(&(x * z)) && (y * z).abs() < 0.6;
                match () {
                    () if is_bar => (z * 1000.0) as u16,
                    () if is_box(x, y) => 2000,
                    () => 0,
                }
            });
            let (_, last) = columns(&mut cloud, &body).expect("a person");
            let border = cloud.size().0 / 2 + (0.1 * cloud.focal()[0]) as usize;
            assert_eq!(last > border + 2, is_limb, "{z} m");
        }
    }

    #[test]
    fn without_an_expected_body_the_largest_component_is_taken_whole() {
        let nothing = vec![f32::INFINITY; pair(true).depth.len()];
        for body in [vec![], nothing] {
            let mut cloud = pair(true);
            let half = cloud.size().0 / 2;
            let (first, last) = columns(&mut cloud, &body).expect("a person");
            assert!(first < half && last > half);
        }
    }
}
