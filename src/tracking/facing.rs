//! Facing of the torso from the classes of its cells.

use super::part_classes::{PartKind, kind_of};
use crate::body::parts::BodySide;
use crate::math::{P3, V3};
use crate::segment::part_forest::ClassMap;
use crate::spatial::OrganisedCloud;

/// Distance from the skin of the torso to its axis, metres.
const HALF_DEPTH: f32 = 0.12;
/// Least number of cells of the torso.
const LEAST_CELLS: usize = 12;

/// Direction in which the torso faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing {
    /// Turn of the torso about `up` from facing the camera, to the subject's left, radians, within ±π.
    pub yaw: f64,
    /// Unit direction of the torso's front, level, camera frame.
    pub front: V3,
    /// Middle of the torso, camera frame, metres.
    pub middle: P3,
    /// Agreement of the cells, 0 to 1.
    pub confidence: f32,
}

/// Share of a cell's classes that belong to the left half of the torso, and to the right half.
fn halves(shares: &[f32]) -> [f32; 2] {
    use PartKind::*;
    let mut out = [0.0; 2];
    for (class, share) in shares.iter().enumerate() {
        match kind_of(class as u8) {
            Some((Shoulder | Chest | Belly | Hip, side)) => {
                out[usize::from(side == BodySide::Right)] += share;
            }
            _ => {}
        }
    }
    out
}

/// Level direction from the right to the left half of the torso, about its axis behind the readings; the front is a quarter
/// turn from it. `map` has one distribution a cell. `None` without a torso.
pub fn facing(cloud: &OrganisedCloud, cells: &[u32], map: &ClassMap, up: &V3) -> Option<Facing> {
    let torso: Vec<(P3, [f32; 2])> = cells
        .iter()
        .enumerate()
        .map(|(i, &c)| (cloud.centre(c as usize), halves(map.shares(i))))
        .filter(|(_, [l, r])| l + r > 0.5)
        .map(|(p, halves)| (p, halves.map(|h| h * p.z * p.z)))
        .collect();
    if torso.len() < LEAST_CELLS {
        return None;
    }
    let total: f32 = torso.iter().map(|(_, [l, r])| l + r).sum();
    let sum = |s: V3, (p, [l, r]): &(P3, [f32; 2])| s + p.coords * (l + r);
    let skin = torso.iter().fold(V3::zeros(), sum) / total;
    let middle = P3::from(skin + skin.normalize() * HALF_DEPTH);
    let level = |v: V3| v - up * up.dot(&v);
    let (mut left, mut spread) = (V3::zeros(), 0.0);
    for (p, [l, r]) in &torso {
        let arm = level(p - middle);
        left += arm * (l - r);
        spread += arm.norm() * (l + r);
    }
    let toward_left = left.try_normalize(f32::MIN_POSITIVE)?;
    let front = toward_left.cross(up);
    let to_camera = level(-skin).try_normalize(f32::MIN_POSITIVE)?;
    let side = up.cross(&to_camera);
    Some(Facing {
        yaw: f64::from(front.dot(&side)).atan2(f64::from(front.dot(&to_camera))),
        front,
        middle,
        confidence: (left.norm() / spread.max(f32::MIN_POSITIVE)).min(1.0),
    })
}
