//! Points of many poses in one: each point moves with the surface that it lies on.

use super::moving_parts::MovingParts;
use crate::scan::BodyScan;
use nalgebra::{Isometry3, Matrix4, Vector3};
use std::collections::BTreeMap;
use tryon_body::{BoneTransforms, PosedSkin, SkinWeights, Template};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::Bvh;

/// Farthest that a point of the subject lies off the surface, metres.
const FARTHEST: f32 = 0.06;
/// Smallest cosine between the normals of point and surface.
const NORMALS: f32 = 0.3;
/// Weight above which a point of several frames is kept: two grazing readings or half a frontal one.
const LEAST_WEIGHT: f32 = 0.3;

/// Point in the pose of the reference.
#[derive(Clone, Copy, Debug)]
pub(super) struct FusedPoint {
    pub(super) point: P3,
    pub(super) normal: V3,
    color: Option<[u8; 3]>,
    /// Square of the cosine between normal and ray.
    pub(super) weight: f32,
    /// Two parts that move it most, and the share of the first.
    parts: [usize; 2],
    share: f32,
}

impl FusedPoint {
    /// Parts that move the point, with their shares.
    pub(super) fn parts(&self) -> impl Iterator<Item = (usize, f64)> {
        let share = f64::from(self.share);
        let all = [(self.parts[0], share), (self.parts[1], 1.0 - share)];
        all.into_iter().filter(|(_, s)| *s > 0.0)
    }

    /// Moves the point by the blended motions of its parts.
    pub(super) fn blend(&mut self, motions: &[Isometry3<f64>]) {
        let (p, n) = (self.point.cast::<f64>(), self.normal.cast::<f64>());
        let (mut at, mut along) = (Vector3::zeros(), Vector3::zeros());
        for (part, share) in self.parts() {
            at += (motions[part] * p).coords * share;
            along += (motions[part] * n) * share;
        }
        self.point = P3::from(at.cast::<f32>());
        self.normal = along.cast::<f32>().normalize();
    }
}

/// Two parts with the largest skin weights at a place of a face, and the share of the first.
fn largest_parts(
    weights: &SkinWeights,
    parts: &MovingParts,
    at: (&Face, [f32; 3]),
) -> ([usize; 2], f32) {
    let mut shares: BTreeMap<usize, f32> = BTreeMap::new();
    for (v, corner) in at.0.iter().zip(at.1) {
        let v = *v as usize;
        for (bone, w) in weights.joints[v].iter().zip(weights.weights[v]) {
            *shares.entry(parts.of(usize::from(*bone))).or_default() += w * corner;
        }
    }
    let mut all: Vec<(usize, f32)> = shares.into_iter().collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    let first = all.first().copied().unwrap_or((0, 1.0));
    let second = all.get(1).copied().unwrap_or((first.0, 0.0));
    (
        [first.0, second.0],
        first.1 / (first.1 + second.1).max(f32::MIN_POSITIVE),
    )
}

/// Pose in which points were seen, or to which they go.
pub(super) struct PosedSurface<'a> {
    /// Vertices, world, metres, shape `[vertices]`.
    pub(super) vertices: &'a [P3],
    pub(super) bones: &'a BoneTransforms,
}

/// Takes points from one pose to another; `eye` is where they were seen from, world, metres.
pub(super) fn reposed(
    (template, parts): (&Template, &MovingParts),
    (points, eye): (&BodyScan, &P3),
    from: &PosedSurface<'_>,
    to: &BoneTransforms,
) -> Vec<FusedPoint> {
    let bvh = Bvh::new(template.mesh().faces(), from.vertices);
    let weights = template.weights();
    let skins = [from.bones, to].map(|bones| PosedSkin::blended(weights, bones));
    let mut out = Vec::new();
    par::map_into(Par::Rayon, points.points.len(), 256, &mut out, |i| {
        let (p, n) = (&points.points[i], points.normals[i]);
        let found = bvh.closest(from.vertices, p)?;
        let own = bvh.unit_normal(from.vertices, found.face)?;
        if found.distance > FARTHEST || !points.normal(i).agrees(&own, NORMALS) {
            return None;
        }
        let face = bvh.faces()[found.face as usize];
        let blend = |skin: &PosedSkin<'_>| -> Matrix4<f64> {
            let corners = face.iter().zip(found.weights);
            corners
                .map(|(v, w)| skin.transform(*v as usize) * f64::from(w))
                .sum()
        };
        let motion = blend(&skins[1]) * PosedSkin::inverse(&blend(&skins[0]))?;
        let (parts, share) = largest_parts(weights, parts, (&face, found.weights));
        let cosine = n.dot(&(eye - p).normalize());
        Some(FusedPoint {
            point: motion.transform_point(&p.cast()).cast(),
            normal: motion.transform_vector(&n.cast()).cast::<f32>().normalize(),
            color: points.colors.get(i).copied(),
            weight: cosine * cosine,
            parts,
            share,
        })
    });
    out.into_iter().flatten().collect()
}

/// Sums over the points of one cell that face one way.
#[derive(Clone, Copy, Debug, Default)]
struct CellSum {
    point: V3,
    normal: V3,
    weight: f32,
    /// Colour of the most frontal point, and its weight.
    color: Option<[u8; 3]>,
    best: f32,
}

/// Mean of the points in each cell of `cell` metres, apart by the octant of their normals, as a scan. Colours are those of the
/// most frontal reading: means would blur prints and hems. Of several frames, cells with few readings are left out.
pub(super) fn merged<'a>(
    points: impl Iterator<Item = &'a FusedPoint>,
    cell: f32,
    frames: usize,
) -> BodyScan {
    let mut cells: BTreeMap<[i32; 4], CellSum> = BTreeMap::new();
    for p in points {
        let [x, y, z] = [p.point.x, p.point.y, p.point.z].map(|c| (c / cell).floor() as i32);
        let octant = (0..3).map(|k| i32::from(p.normal[k] > 0.0) << k).sum();
        let sum = cells.entry([x, y, z, octant]).or_default();
        sum.point += p.point.coords * p.weight;
        sum.normal += p.normal * p.weight;
        sum.weight += p.weight;
        if p.weight > sum.best {
            (sum.best, sum.color) = (p.weight, p.color);
        }
    }
    let mut out = BodyScan {
        oriented: true,
        ..BodyScan::default()
    };
    let is_colored = cells.values().all(|s| s.color.is_some());
    let least = if frames > 1 { LEAST_WEIGHT } else { 0.0 };
    for sum in cells.values().filter(|s| s.weight > least) {
        let Some(normal) = sum.normal.try_normalize(f32::MIN_POSITIVE) else {
            continue;
        };
        out.point_of_row.push(out.points.len() as u32);
        out.points.push(P3::from(sum.point / sum.weight));
        out.normals.push(normal);
        out.colors.extend(sum.color.filter(|_| is_colored));
    }
    out
}
