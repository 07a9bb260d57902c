//! Ends of the body: cells that are farthest from the torso along the surface (Plagemann et al. 2010, accumulative
//! geodesic extrema).

use crate::math::P3;
use crate::spatial::OrganisedCloud;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// One end: a hand, a foot, the head, or the elbow of an arm whose hand lies on the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Extremity {
    /// Camera frame, metres.
    pub point: P3,
    /// Way along the surface to what was found before it (the torso, or an earlier end's way), metres.
    pub length: f32,
    /// Points along that way, from the end on, camera frame, metres.
    pub path: Vec<P3>,
}

impl Extremity {
    /// The point of the way that lies `length` metres from the end along it; the last one if the way is shorter.
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

/// Cells are neighbours up to this many rows and columns apart: fingers and sleeves leave gaps of one cell.
const NEIGHBOURS: i32 = 2;
/// Neighbours farther apart than this (metres), and [`JUMP_SLOPE`] of their distance, lie on different limbs.
const JUMP: f32 = 0.06;
/// See [`JUMP`]; the cells themselves grow with the distance.
const JUMP_SLOPE: f32 = 0.015;
/// What is nearer than this (metres) to what was found before is no end of its own.
const SHORTEST: f32 = 0.2;

/// A cell on the front of the search, nearest first.
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

/// Up to `most` ends of the body whose refined cells are `cells`, the farthest first, seen from the cell nearest to
/// `torso` (camera frame, metres). What is cut off from the torso has no end.
pub fn extremities(
    cloud: &OrganisedCloud,
    cells: &[u32],
    torso: &P3,
    most: usize,
) -> Vec<Extremity> {
    let columns = cloud.size().0;
    let point = |c: u32| cloud.points[c as usize];
    let off = |c: u32| (point(c) - torso).norm_squared();
    let usable = |c: &u32| cloud.depth[*c as usize] > 0.0;
    let Some(source) = cells
        .iter()
        .copied()
        .filter(usable)
        .min_by(|a, b| off(*a).total_cmp(&off(*b)))
    else {
        return Vec::new();
    };
    let mut distance = vec![f32::NAN; cloud.depth.len()];
    let mut before = vec![u32::MAX; cloud.depth.len()];
    for &c in cells.iter().filter(|c| usable(c)) {
        distance[c as usize] = f32::INFINITY;
    }
    let mut front = BinaryHeap::new();
    distance[source as usize] = 0.0;
    front.push(Reverse(Front(0.0, source)));
    let mut out: Vec<Extremity> = Vec::new();
    loop {
        while let Some(Reverse(Front(d, c))) = front.pop() {
            if d > distance[c as usize] {
                continue;
            }
            let (u, v, p) = (
                (c as usize % columns) as i32,
                (c as usize / columns) as i32,
                point(c),
            );
            let reach = JUMP + JUMP_SLOPE * p.z;
            for dv in -NEIGHBOURS..=NEIGHBOURS {
                for du in -NEIGHBOURS..=NEIGHBOURS {
                    // Cells that are not the person have no distance at all, and no comparison with it holds.
                    let Some(k) = cloud.cell(u + du, v + dv) else {
                        continue;
                    };
                    let step = (cloud.points[k] - p).norm();
                    if step < reach && d + step < distance[k] {
                        distance[k] = d + step;
                        before[k] = c;
                        front.push(Reverse(Front(d + step, k as u32)));
                    }
                }
            }
        }
        let reached = |c: &u32| distance[*c as usize].is_finite();
        let farthest = cells.iter().copied().filter(reached).max_by(|a, b| {
            distance[*a as usize]
                .total_cmp(&distance[*b as usize])
                .then(b.cmp(a))
        });
        let Some(end) = farthest.filter(|e| distance[*e as usize] >= SHORTEST && out.len() < most)
        else {
            return out;
        };
        let length = distance[end as usize];
        // The way to this end counts as found: what is next to it is no other end.
        let mut path = Vec::new();
        let mut at = end;
        while at != u32::MAX {
            path.push(point(at));
            let next = before[at as usize];
            before[at as usize] = u32::MAX;
            if distance[at as usize] > 0.0 {
                distance[at as usize] = 0.0;
                front.push(Reverse(Front(0.0, at)));
            }
            at = next;
        }
        out.push(Extremity {
            point: point(end),
            length,
            path,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{DepthImage, Intrinsics};

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
    fn the_ends_of_a_figure_come_farthest_first() {
        let (cloud, cells) = figure();
        let ends = extremities(&cloud, &cells, &P3::new(0.0, 0.0, 2.0), 8);
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
            "what stands up: {others:?}"
        );
        assert!(
            ends.iter().all(|e| e.point.z > 1.9),
            "what lies before the trunk is not joined to it"
        );
        // The long arm is straight: half a metre from its end lies half a metre towards the trunk.
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
    fn nothing_has_no_ends() {
        let (mut cloud, cells) = figure();
        assert!(extremities(&cloud, &[], &P3::origin(), 4).is_empty());
        assert!(extremities(&cloud, &cells, &P3::origin(), 0).is_empty());
        assert!(
            extremities(&cloud, &cells[..1], &P3::origin(), 4).is_empty(),
            "a single cell"
        );
        cloud.depth.fill(0.0);
        assert!(
            extremities(&cloud, &cells, &P3::origin(), 4).is_empty(),
            "no reading"
        );
    }
}
