//! Points of many poses in one: each point moves with the surface that it lies on.

use super::moving_parts::MovingParts;
use crate::align::PosedSurface;
use crate::scan::BodyScan;
use crate::settings::FusedCloudSettings;
use nalgebra::{Isometry3, Matrix4, Vector3};
use std::collections::BTreeMap;
use tryon_body::{BoneTransforms, PosedSkin, SkinWeights, Template};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::Bvh;

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
    face: &Face,
    corners: [f32; 3],
) -> ([usize; 2], f32) {
    let mut shares: BTreeMap<usize, f32> = BTreeMap::new();
    for (v, corner) in face.iter().zip(corners) {
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

/// Pose to which the points of all frames are taken.
pub(super) struct Reference<'a> {
    pub(super) template: &'a Template,
    pub(super) parts: &'a MovingParts,
    pub(super) bones: &'a BoneTransforms,
    /// Place of the camera, world, metres.
    pub(super) eye: P3,
    pub(super) settings: &'a FusedCloudSettings,
}

impl Reference<'_> {
    /// Takes points, world, metres, from the pose in which they were seen.
    pub(super) fn reposed(&self, points: &BodyScan, from: &PosedSurface) -> Vec<FusedPoint> {
        let bvh = Bvh::new(self.template.mesh().faces(), &from.vertices);
        let weights = self.template.weights();
        let skins = [&from.bones, self.bones].map(|bones| PosedSkin::blended(weights, bones));
        let mut out = Vec::new();
        par::map_into(Par::Rayon, points.points.len(), 256, &mut out, |i| {
            let (p, n) = (&points.points[i], points.normals[i]);
            let found = bvh.closest(&from.vertices, p)?;
            let own = bvh.unit_normal(&from.vertices, found.face)?;
            let is_far = found.distance > self.settings.farthest;
            if is_far || !points.agrees(i, &own, self.settings.normals) {
                return None;
            }
            let face = bvh.faces()[found.face as usize];
            let blend = |skin: &PosedSkin<'_>| -> Matrix4<f64> {
                let corners = face.iter().zip(found.weights);
                let blend = |(v, w): (&u32, f32)| skin.transform(*v as usize) * f64::from(w);
                corners.map(blend).sum()
            };
            let motion = blend(&skins[1]) * PosedSkin::inverse(&blend(&skins[0]))?;
            let (parts, share) = largest_parts(weights, self.parts, &face, found.weights);
            let cosine = n.dot(&(self.eye - p).normalize());
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
/// most frontal reading: means would blur prints and hems. Cells of no more than the least weight are left out.
pub(super) fn merged<'a>(
    points: impl Iterator<Item = &'a FusedPoint>,
    cell: f32,
    least: f32,
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
