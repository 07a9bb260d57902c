//! Cross-sections of a body in the canonical pose, for placing panels around it.

use super::settings::SectionSettings;
use std::ops::Range;
use tryon_body::measure::Measurements;
use tryon_body::parts::vertex_masks;
use tryon_body::{BoneTransforms, RestBody, Template};
use tryon_garment::Region;
use tryon_geometry::math::{P3, P3d};
use tryon_geometry::mesh::Face;

/// One horizontal cross-section: its bounding box and the girth of its convex hull (as a tape measures it), metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct CrossSection {
    pub(super) x: [f32; 2],
    pub(super) z: [f32; 2],
    pub(super) girth: f32,
}

impl CrossSection {
    /// Of points in a horizontal plane (x, z); `None` without points.
    fn of(points: Vec<[f32; 2]>) -> Option<Self> {
        let hull = convex_hull(points);
        let first = *hull.first()?;
        let grow = |r: [f32; 2], q: f32| [r[0].min(q), r[1].max(q)];
        let (x, z) = hull
            .iter()
            .fold(([first[0]; 2], [first[1]; 2]), |(x, z), q| {
                (grow(x, q[0]), grow(z, q[1]))
            });
        let side = |i: usize| {
            let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        let girth = (0..hull.len()).map(side).sum();
        Some(Self { x, z, girth })
    }
}

/// Cross-sections from the lowest to the highest point of some parts of a body.
#[derive(Clone, Debug)]
pub(super) struct SectionStack {
    /// Distance between two of them, metres.
    spacing: f32,
    bottom: f32,
    sections: Vec<Option<CrossSection>>,
}

impl SectionStack {
    /// Cuts the faces whose three corners belong to `mask` every `spacing` metres; `parts` per vertex.
    pub(super) fn cut(
        vertices: &[P3],
        faces: &[Face],
        parts: &[u8],
        mask: Region,
        spacing: f32,
    ) -> Self {
        let keep = |f: &&Face| f.iter().all(|v| parts[*v as usize] & mask.0 != 0);
        let (lo, hi) = height_range(
            faces
                .iter()
                .filter(keep)
                .flatten()
                .map(|v| &vertices[*v as usize]),
        );
        if lo > hi {
            return Self {
                spacing,
                bottom: 0.0,
                sections: Vec::new(),
            };
        }
        let n = ((hi - lo) / spacing) as usize + 1;
        let mut points: Vec<Vec<[f32; 2]>> = vec![Vec::new(); n];
        for f in faces.iter().filter(keep) {
            for k in 0..3 {
                let (a, b) = (&vertices[f[k] as usize], &vertices[f[(k + 1) % 3] as usize]);
                let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
                let first = ((a.y - lo) / spacing).ceil() as usize;
                for (s, slot) in points.iter_mut().enumerate().skip(first) {
                    let y = lo + s as f32 * spacing;
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
        let sections = points.into_iter().map(CrossSection::of).collect();
        Self {
            spacing,
            bottom: lo,
            sections,
        }
    }
    /// Cross-section nearest to height `y` (m); beyond the ends the last one.
    pub(super) fn at(&self, y: f32) -> CrossSection {
        let last = self.sections.len().saturating_sub(1);
        let i = (((y - self.bottom) / self.spacing).round().max(0.0) as usize).min(last);
        let found = self.sections.get(i).copied().flatten();
        found
            .or_else(|| self.sections.iter().flatten().copied().next())
            .unwrap_or_default()
    }
    /// True for a height between the lowest and the highest cross-section, metres.
    pub(super) fn covers(&self, y: f32) -> bool {
        let height = self.sections.len().saturating_sub(1) as f32 * self.spacing;
        !self.sections.is_empty() && (self.bottom..=self.bottom + height).contains(&y)
    }
    /// Height in `range` (m) at which `key` of the cross-section is smallest.
    pub(super) fn argmin(&self, range: Range<f32>, key: impl Fn(&CrossSection) -> f32) -> f32 {
        let n = ((range.end - range.start) / self.spacing).max(0.0) as usize;
        (0..=n)
            .map(|i| range.start + i as f32 * self.spacing)
            .min_by(|a, b| key(&self.at(*a)).total_cmp(&key(&self.at(*b))))
            .unwrap_or(range.start)
    }
}

/// Lowest and highest y of some points; from above to below without points.
fn height_range<'a>(points: impl Iterator<Item = &'a P3>) -> (f32, f32) {
    points.fold((f32::MAX, f32::MIN), |(lo, hi), p| {
        (lo.min(p.y), hi.max(p.y))
    })
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

/// Heights at which a body is measured, metres in the canonical pose.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BodyHeights {
    pub(super) waist: f32,
    pub(super) hip: f32,
    pub(super) crotch: f32,
    /// Fork of trousers: above `crotch` where the thighs touch.
    pub(super) fork: f32,
}

/// A body in the canonical pose with its cross-sections.
pub(super) struct BodySections {
    pub(super) vertices: Vec<P3>,
    pub(super) joints: Vec<P3d>,
    pub(super) trunk: SectionStack,
    /// Trunk and legs.
    pub(super) lower: SectionStack,
    /// `[left, right]`.
    pub(super) legs: [SectionStack; 2],
    pub(super) parts: Vec<u8>,
    pub(super) heights: BodyHeights,
}

impl BodySections {
    /// Poses the body and cuts it; `measures` give the inseam, without them trousers end at the crotch.
    pub(super) fn new(
        template: &Template,
        rest: &RestBody,
        measures: Option<&Measurements>,
        settings: &SectionSettings,
    ) -> Self {
        let pose = super::canonical::canonical_pose(template, rest, &settings.canonical);
        let mut bones = BoneTransforms::default();
        let mut vertices = Vec::new();
        template.skin_pose(rest, &pose, &mut bones, &mut vertices);
        let parts = vertex_masks(template);
        let faces = template.mesh().faces();
        let spacing = settings.spacing;
        let cut = |mask| SectionStack::cut(&vertices, faces, &parts, mask, spacing);
        let mut out = Self {
            trunk: cut(Region::TRUNK),
            lower: cut(Region::TRUNK.with(Region::LEFT_LEG).with(Region::RIGHT_LEG)),
            legs: [Region::LEFT_LEG, Region::RIGHT_LEG].map(cut),
            heights: BodyHeights::default(),
            joints: bones.joints,
            parts,
            vertices,
        };
        // Legs turn about the hips: the crotch keeps its height.
        let (floor, _) = height_range(rest.vertices.iter());
        let inseam = measures.map(|m| floor + m.inseam as f32);
        out.heights = out.measure_heights(template, inseam, settings);
        out
    }
    /// `inseam`: height at which the thighs part, metres.
    fn measure_heights(
        &self,
        template: &Template,
        inseam: Option<f32>,
        settings: &SectionSettings,
    ) -> BodyHeights {
        let (lo, hi) = height_range(self.vertices.iter());
        let stature = hi - lo;
        let joint_height = |names: [&str; 2], share: f32| {
            let found = names.iter().find_map(|n| template.skeleton().index(n));
            found.map_or(lo + share * stature, |j| self.joints[j].y as f32)
        };
        let pelvis = joint_height(["left_hip", "pelvis"], settings.joint_heights[0]);
        let shoulder = joint_height(["left_shoulder", "neck"], settings.joint_heights[1]);
        // The lowest skin on the centre line, legs apart.
        let lower = Region::TRUNK.with(Region::LEFT_LEG).with(Region::RIGHT_LEG);
        let lowest = self
            .vertices
            .iter()
            .zip(&self.parts)
            .filter(|(p, part)| {
                p.x.abs() < settings.crotch_strip
                    && *part & lower.0 != 0
                    && p.y > lo + settings.lowest_crotch * stature
            })
            .map(|(p, _)| p.y)
            .fold(f32::MAX, f32::min);
        let crotch = if lowest < hi {
            lowest
        } else {
            pelvis - settings.crotch_drop
        };
        let trunk = shoulder - crotch;
        let above = |share: f32| crotch + share * trunk;
        let ([low, high], [from, to]) = (settings.hip_range, settings.waist_range);
        BodyHeights {
            hip: self.lower.argmin(crotch + low..above(high), |s| -s.girth),
            waist: self.lower.argmin(above(from)..above(to), |s| s.girth),
            crotch,
            fork: inseam.map_or(crotch, |y| {
                crotch + settings.fork_rise * (y - crotch).max(0.0)
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    /// An upright open tube of elliptic section, 0.3 m high.
    fn tube(a: f32, b: f32) -> (Vec<P3>, Vec<Face>) {
        let (n, rows) = (256u32, 31u32);
        let vertices = (0..n * rows)
            .map(|k| {
                let t = TAU * (k % n) as f32 / n as f32;
                P3::new(a * t.cos(), 0.01 * (k / n) as f32, b * t.sin())
            })
            .collect();
        let at = |i: u32, j: u32| j * n + i % n;
        let faces = (0..n * (rows - 1))
            .flat_map(|k| {
                let (i, j) = (k % n, k / n);
                [
                    [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                    [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                ]
            })
            .collect();
        (vertices, faces)
    }

    #[test]
    fn sections_of_a_cylinder_have_its_girth_and_box() {
        let (vertices, faces) = tube(0.1, 0.1);
        let parts = vec![Region::TRUNK.0; vertices.len()];
        let stack = SectionStack::cut(&vertices, &faces, &parts, Region::TRUNK, 0.01);
        for y in [0.0, 0.155, 0.3] {
            let s = stack.at(y);
            assert!((s.girth - TAU * 0.1).abs() < 2e-4, "{s:?}");
            assert!((s.x[0] + 0.1).abs() < 1e-5 && (s.z[1] - 0.1).abs() < 1e-5);
        }
        assert_eq!(stack.at(-9.0), stack.at(0.0), "beyond an end: the last one");
    }

    #[test]
    fn parts_that_a_body_lacks_have_an_empty_section() {
        let (vertices, faces) = tube(0.1, 0.1);
        let parts = vec![Region::TRUNK.0; vertices.len()];
        let none = SectionStack::cut(&vertices, &faces, &parts, Region::LEFT_LEG, 0.01);
        assert_eq!(none.at(0.1), CrossSection::default());
        assert_eq!(CrossSection::of(Vec::new()), None);
    }
}
