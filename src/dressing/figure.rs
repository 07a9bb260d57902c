//! Cross-sections of a body in the canonical pose, for placing panels around it.

use crate::body::measure::Measurements;
use crate::body::parts::vertex_masks;
use crate::body::{BoneTransforms, RestBody, Template, skin};
use crate::garment::Region;
use crate::math::P3;
use crate::mesh::Face;
use crate::par::Par;

/// Distance between two cross-sections, metres.
const STEP: f32 = 0.01;

/// Between thighs that touch trousers go up this share of the way to the crotch. All the way up they never came to rest there,
/// not at all a heavy man's hung 9 cm too low, on the floor.
const UP: f32 = 0.5;

/// One horizontal cross-section: its bounding box and the girth of its convex hull (what a tape measures), metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slice {
    pub(super) x: [f32; 2],
    pub(super) z: [f32; 2],
    pub(super) girth: f32,
}

/// Cross-sections from the lowest to the highest point of some parts of a body.
#[derive(Clone, Debug, Default)]
pub(super) struct Slices {
    bottom: f32,
    slices: Vec<Option<Slice>>,
}

impl Slices {
    /// Cuts the faces whose three corners belong to `mask`.
    pub(super) fn cut(vertices: &[P3], faces: &[Face], parts: &[u8], mask: Region) -> Self {
        let keep = |f: &&Face| f.iter().all(|v| parts[*v as usize] & mask.0 != 0);
        let (lo, hi) =
            faces
                .iter()
                .filter(keep)
                .flatten()
                .fold((f32::MAX, f32::MIN), |(lo, hi), v| {
                    let y = vertices[*v as usize].y;
                    (lo.min(y), hi.max(y))
                });
        if lo > hi {
            return Self::default();
        }
        let n = ((hi - lo) / STEP) as usize + 1;
        let mut points: Vec<Vec<[f32; 2]>> = vec![Vec::new(); n];
        for f in faces.iter().filter(keep) {
            for k in 0..3 {
                let (a, b) = (&vertices[f[k] as usize], &vertices[f[(k + 1) % 3] as usize]);
                let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
                let first = ((a.y - lo) / STEP).ceil() as usize;
                for (s, slot) in points.iter_mut().enumerate().skip(first) {
                    let y = lo + s as f32 * STEP;
                    if y > b.y {
                        break;
                    }
                    let t = if b.y > a.y {
                        (y - a.y) / (b.y - a.y)
                    } else {
                        0.0
                    };
                    slot.push([a.x + (b.x - a.x) * t, a.z + (b.z - a.z) * t]);
                }
            }
        }
        let slices = points
            .into_iter()
            .map(|p| {
                let hull = convex_hull(p);
                let first = *hull.first()?;
                let (x, z) = hull
                    .iter()
                    .fold(([first[0]; 2], [first[1]; 2]), |(x, z), q| {
                        (
                            [x[0].min(q[0]), x[1].max(q[0])],
                            [z[0].min(q[1]), z[1].max(q[1])],
                        )
                    });
                let girth = (0..hull.len())
                    .map(|i| {
                        let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
                        (a[0] - b[0]).hypot(a[1] - b[1])
                    })
                    .sum();
                Some(Slice { x, z, girth })
            })
            .collect();
        Self { bottom: lo, slices }
    }
    /// The cross-section nearest to a height; beyond the ends the last one.
    pub(super) fn at(&self, y: f32) -> Slice {
        let last = self.slices.len().saturating_sub(1);
        let i = (((y - self.bottom) / STEP).round().max(0.0) as usize).min(last);
        let found = self.slices.get(i).copied().flatten();
        found
            .or_else(|| self.slices.iter().flatten().copied().next())
            .unwrap_or_default()
    }
    /// Height between two bounds where `key` of the cross-section is smallest.
    pub(super) fn lowest(&self, from: f32, to: f32, key: impl Fn(&Slice) -> f32) -> f32 {
        let n = ((to - from) / STEP).max(0.0) as usize;
        (0..=n)
            .map(|i| from + i as f32 * STEP)
            .min_by(|a, b| key(&self.at(*a)).total_cmp(&key(&self.at(*b))))
            .unwrap_or(from)
    }
}

/// Andrew's monotone chain.
fn convex_hull(mut p: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
    p.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    p.dedup();
    if p.len() < 3 {
        return p;
    }
    let cross = |o: [f32; 2], a: [f32; 2], b: [f32; 2]| {
        (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
    };
    let chain = |points: &mut dyn Iterator<Item = [f32; 2]>| {
        let mut h: Vec<[f32; 2]> = Vec::new();
        for q in points {
            while h.len() >= 2 && cross(h[h.len() - 2], h[h.len() - 1], q) <= 0.0 {
                h.pop();
            }
            h.push(q);
        }
        h.pop();
        h
    };
    let mut hull = chain(&mut p.iter().copied());
    hull.extend(chain(&mut p.iter().rev().copied()));
    hull
}

/// Heights where a body is measured, metres in the canonical pose.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Levels {
    pub(super) waist: f32,
    pub(super) hip: f32,
    pub(super) crotch: f32,
    /// How high trousers go between the legs: higher than `crotch` where the thighs touch.
    pub(super) fork: f32,
}

/// A body in the canonical pose with its cross-sections.
pub(super) struct Figure {
    pub(super) vertices: Vec<P3>,
    pub(super) joints: Vec<nalgebra::Point3<f64>>,
    pub(super) trunk: Slices,
    pub(super) lower: Slices,
    pub(super) legs: [Slices; 2],
    pub(super) parts: Vec<u8>,
    pub(super) levels: Levels,
}

impl Figure {
    pub(super) fn new(
        template: &Template,
        rest: &RestBody,
        measures: Option<&Measurements>,
    ) -> Self {
        let pose = super::canonical::canonical_pose(template, rest);
        let mut bones = BoneTransforms::default();
        pose.bones(template.skeleton(), rest, &mut bones);
        let mut vertices = Vec::new();
        skin(
            Par::Rayon,
            &rest.vertices,
            template.weights(),
            &bones,
            &mut vertices,
        );
        let parts = vertex_masks(template);
        let faces = template.mesh().faces();
        let lower_mask = Region::TRUNK.with(Region::LEFT_LEG).with(Region::RIGHT_LEG);
        let trunk = Slices::cut(&vertices, faces, &parts, Region::TRUNK);
        let lower = Slices::cut(&vertices, faces, &parts, lower_mask);
        let legs =
            [Region::LEFT_LEG, Region::RIGHT_LEG].map(|m| Slices::cut(&vertices, faces, &parts, m));
        let joint = |names: &[&str]| {
            names
                .iter()
                .find_map(|n| template.skeleton().index(n))
                .map(|j| bones.joints[j].y as f32)
        };
        let (lo, hi) = vertices.iter().fold((f32::MAX, f32::MIN), |(lo, hi), p| {
            (lo.min(p.y), hi.max(p.y))
        });
        let stature = hi - lo;
        let pelvis = joint(&["left_hip", "pelvis"]).unwrap_or(lo + 0.52 * stature);
        let shoulder = joint(&["left_shoulder", "neck"]).unwrap_or(lo + 0.8 * stature);
        // The crotch: the lowest point on the centre line, legs apart.
        let crotch = vertices
            .iter()
            .zip(&parts)
            .filter(|(p, q)| {
                p.x.abs() < 0.012 && *q & lower_mask.0 != 0 && p.y > lo + 0.3 * stature
            })
            .map(|(p, _)| p.y)
            .fold(f32::MAX, f32::min);
        let crotch = if crotch < hi { crotch } else { pelvis - 0.08 };
        let trunk_length = shoulder - crotch;
        let hip = lower.lowest(crotch + 0.02, crotch + 0.32 * trunk_length, |s| -s.girth);
        let waist = lower.lowest(
            crotch + 0.30 * trunk_length,
            crotch + 0.62 * trunk_length,
            |s| s.girth,
        );
        // Legs turn about the hips: the crotch stays where it is.
        let low = rest.vertices.iter().map(|p| p.y).fold(f32::MAX, f32::min);
        let fork = measures.map_or(crotch, |m| {
            crotch + UP * (low + m.inseam as f32 - crotch).max(0.0)
        });
        let levels = Levels {
            waist,
            hip,
            crotch,
            fork,
        };
        Self {
            vertices,
            joints: bones.joints,
            trunk,
            lower,
            legs,
            parts,
            levels,
        }
    }
}
