//! Ends of the body: cells that are farthest from the torso along the surface (Plagemann et al. 2010, accumulative
//! geodesic extrema).

use crate::settings::ExtremitySettings;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use tryon_geometry::math::P3;
use tryon_geometry::spatial::OrganisedCloud;

/// One end of the body: a hand, a foot, the head, or the elbow of an arm whose hand lies on the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Extremity {
    /// Camera frame, metres.
    pub point: P3,
    /// Geodesic distance to the torso or to the path of an earlier end, metres.
    pub length: f32,
    /// Points of that geodesic path, from the end on, camera frame, metres.
    pub path: Vec<P3>,
}

impl Extremity {
    /// Point of the path at `length` metres from the end; its last point if the path is shorter.
    pub fn along(&self, length: f32) -> P3 {
        let mut left = length;
        for pair in self.path.windows(2) {
            let step = (pair[1] - pair[0]).norm();
            if step >= left {
                return pair[0] + (pair[1] - pair[0]) * (left / step.max(f32::MIN_POSITIVE));
            }
            left -= step;
        }
        self.path.last().copied().unwrap_or(self.point)
    }
}

/// Rows and columns to the farthest neighbour of a cell: fingers and sleeves leave gaps of one cell.
const NEIGHBOURS: i32 = 2;

/// Distance and number of a cell on the front of the search, nearest first.
#[derive(PartialEq)]
struct Front(f32, u32);

impl Eq for Front {}
impl Ord for Front {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}
impl PartialOrd for Front {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Geodesic distances over the cells of the body, and the predecessor of each on its shortest path.
struct Geodesics<'a> {
    cloud: &'a OrganisedCloud,
    /// Metres; infinity before it is reached, NaN for cells that are not the body. Shape `[cells]`.
    distance: Vec<f32>,
    predecessor: Vec<u32>,
    front: BinaryHeap<Reverse<Front>>,
}

impl<'a> Geodesics<'a> {
    const NONE: u32 = u32::MAX;

    fn new(cloud: &'a OrganisedCloud, cells: impl Iterator<Item = u32>) -> Self {
        let mut distance = vec![f32::NAN; cloud.depth.len()];
        for c in cells {
            distance[c as usize] = f32::INFINITY;
        }
        Self {
            cloud,
            distance,
            predecessor: vec![Self::NONE; cloud.depth.len()],
            front: BinaryHeap::new(),
        }
    }
    /// Makes a cell a source of distance zero.
    fn add_source(&mut self, cell: u32) {
        self.predecessor[cell as usize] = Self::NONE;
        if self.distance[cell as usize] > 0.0 {
            self.distance[cell as usize] = 0.0;
            self.front.push(Reverse(Front(0.0, cell)));
        }
    }
    /// Propagates distances from the sources (Dijkstra).
    fn propagate(&mut self, settings: &ExtremitySettings) {
        let columns = self.cloud.size().0;
        while let Some(Reverse(Front(d, c))) = self.front.pop() {
            if d > self.distance[c as usize] {
                continue;
            }
            let (u, v) = ((c as usize % columns) as i32, (c as usize / columns) as i32);
            let p = self.cloud.points[c as usize];
            let reach = settings.jump + settings.jump_slope * p.z;
            for dv in -NEIGHBOURS..=NEIGHBOURS {
                for du in -NEIGHBOURS..=NEIGHBOURS {
                    let Some(k) = self.cloud.cell(u + du, v + dv) else {
                        continue;
                    };
                    let step = (self.cloud.points[k] - p).norm();
                    // The distance of cells that are not the body is NaN: no comparison with it holds.
                    if step < reach && d + step < self.distance[k] {
                        self.distance[k] = d + step;
                        self.predecessor[k] = c;
                        self.front.push(Reverse(Front(d + step, k as u32)));
                    }
                }
            }
        }
    }
    /// Farthest cell that was reached.
    fn farthest(&self, cells: &[u32]) -> Option<u32> {
        let at = |c: &u32| self.distance[*c as usize];
        let reached = cells.iter().copied().filter(|c| at(c).is_finite());
        reached.max_by(|a, b| at(a).total_cmp(&at(b)).then(b.cmp(a)))
    }
    /// Path from an end to its source. Its cells become sources: cells beside it are no other end.
    fn take_path(&mut self, end: u32) -> Vec<P3> {
        let mut path = Vec::new();
        let mut at = end;
        while at != Self::NONE {
            path.push(self.cloud.points[at as usize]);
            let next = self.predecessor[at as usize];
            self.add_source(at);
            at = next;
        }
        path
    }
}

/// Ends of the body whose refined cells are `cells`, the farthest first, measured from the cell nearest to
/// `torso` (camera frame, metres). Cells that are not connected to the torso have no end.
pub fn extremities(
    cloud: &OrganisedCloud,
    cells: &[u32],
    torso: &P3,
    settings: &ExtremitySettings,
) -> Vec<Extremity> {
    let usable = || {
        cells
            .iter()
            .copied()
            .filter(|c| cloud.depth[*c as usize] > 0.0)
    };
    let off = |c: u32| (cloud.points[c as usize] - torso).norm_squared();
    let Some(source) = usable().min_by(|a, b| off(*a).total_cmp(&off(*b))) else {
        return Vec::new();
    };
    let mut geodesics = Geodesics::new(cloud, usable());
    geodesics.add_source(source);
    let mut out: Vec<Extremity> = Vec::new();
    while out.len() < settings.most {
        geodesics.propagate(settings);
        let Some(end) = geodesics.farthest(cells) else {
            break;
        };
        let length = geodesics.distance[end as usize];
        if length < settings.shortest {
            break;
        }
        out.push(Extremity {
            point: cloud.points[end as usize],
            length,
            path: geodesics.take_path(end),
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::camera::{DepthImage, Intrinsics};

    /// A flat figure 2 m away: trunk, two arms of different lengths, a stick that lies 30 cm before the trunk.
    fn figure() -> (OrganisedCloud, Vec<u32>) {
        let camera = Intrinsics {
            width: 120,
            height: 100,
            fx: 100.0,
            fy: 100.0,
            cx: 60.0,
            cy: 50.0,
        };
        let mut depth = DepthImage::empty(120, 100);
        let mut fill = |u: std::ops::Range<u32>, v: std::ops::Range<u32>, mm: u16| {
            for (u, v) in u.flat_map(|u| v.clone().map(move |v| (u, v))) {
                depth.data_mut()[(v * 120 + u) as usize] = mm;
            }
        };
        fill(50..70, 30..80, 2000);
        fill(20..50, 34..38, 2000);
        fill(70..110, 34..38, 2000);
        fill(56..59, 5..30, 2000);
        fill(60..64, 50..70, 1700);
        let mut cloud = OrganisedCloud::new(&camera, Some(1));
        cloud.sample(&depth, 8.0);
        let cells: Vec<u32> = (0..cloud.depth.len() as u32)
            .filter(|c| cloud.depth[*c as usize] > 0.0)
            .collect();
        cloud.refine(&depth, &cells);
        (cloud, cells)
    }

    #[test]
    fn ends_are_sorted_by_geodesic_distance() {
        let (cloud, cells) = figure();
        let ends = extremities(&cloud, &cells, &P3::new(0.0, 0.0, 2.0), &most(8));
        assert!(ends.len() >= 3, "{}", ends.len());
        assert!(
            ends.windows(2).all(|w| w[0].length >= w[1].length),
            "farthest first"
        );
        let at = |k: usize| {
            [
                (ends[k].point.x * 50.0 + 60.0).round() as i32,
                (ends[k].point.y * 50.0 + 50.0).round() as i32,
            ]
        };
        assert!(at(0)[0] >= 108, "the longer arm: {:?}", at(0));
        let others = [at(1), at(2)];
        assert!(
            others.iter().any(|p| p[0] <= 22),
            "the shorter arm: {others:?}"
        );
        assert!(
            others.iter().any(|p| p[1] <= 6),
            "the upright stick: {others:?}"
        );
        assert!(
            ends.iter().all(|e| e.point.z > 1.9),
            "the stick before the trunk is not connected"
        );
        // The long arm is straight: half a metre along the path is half a metre towards the trunk.
        let along = ends[0].along(0.5);
        assert!(
            (along.x - (ends[0].point.x - 0.5)).abs() < 0.03,
            "{} {}",
            along.x,
            ends[0].point.x
        );
        let length = ends[0]
            .path
            .windows(2)
            .map(|w| (w[1] - w[0]).norm())
            .sum::<f32>();
        assert!(
            (length - ends[0].length).abs() < 1e-3
                && (ends[0].along(9.0) - ends[0].path.last().unwrap()).norm() == 0.0
        );
    }

    #[test]
    fn degenerate_bodies_have_no_ends() {
        let (mut cloud, cells) = figure();
        assert!(extremities(&cloud, &[], &P3::origin(), &most(4)).is_empty());
        assert!(extremities(&cloud, &cells, &P3::origin(), &most(0)).is_empty());
        assert!(
            extremities(&cloud, &cells[..1], &P3::origin(), &most(4)).is_empty(),
            "a single cell"
        );
        cloud.depth.fill(0.0);
        assert!(
            extremities(&cloud, &cells, &P3::origin(), &most(4)).is_empty(),
            "no reading"
        );
    }

    fn most(most: usize) -> ExtremitySettings {
        ExtremitySettings {
            most,
            ..ExtremitySettings::default()
        }
    }
}
