//! Measure of being worn: the share of the way around the body that cloth goes, where it crosses planes across the body's parts.

use std::collections::BTreeMap;
use std::f32::consts::TAU;
use tryon_body::Template;
use tryon_body::parts::BodyPart;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;

/// Directions around a part that count apart.
const SECTORS: usize = 24;
/// Distance between the planes across a part, metres.
const SPACING: f32 = 0.05;
/// Distance of the last planes from the origin of the body, metres: as far as skin is searched.
const FARTHEST: f32 = 10.0;
/// Depth below the skin from which cloth is around nothing, metres: bodies that are guessed under their clothes are 2 cm off.
const DEEP: f32 = 0.03;

/// Cloth over a body. Shapes `[vertices]`, but of the faces.
pub(super) struct ClothOverSkin<'a> {
    pub(super) faces: &'a [Face],
    /// Metres.
    pub(super) x: &'a [P3],
    /// Parts of the body below.
    pub(super) over: &'a [u8],
    /// Height over the skin, metres; negative inside.
    pub(super) height: &'a [f32],
}

/// Share of the way around the parts of the body that cloth goes, 0 to 1, mean over the lengths of its sections: a closed tube
/// has 1, a sheet at most ½ whatever its size, and one that lies across the body none. `parts` are those of the body's vertices.
pub(super) fn wrap(template: &Template, parts: &[u8], cloth: &ClothOverSkin<'_>) -> f64 {
    let sections = BodyPart::ALL.iter().flat_map(|part| {
        let axes = PartAxes::new(template, *part);
        axes.map_or_else(Vec::new, |axes| {
            axes.sections(template.mesh().vertices(), parts, cloth)
        })
    });
    let (sum, length) = sections.fold((0.0, 0.0), |(sum, length), s| {
        (sum + s.length * s.share(), length + s.length)
    });
    sum / length.max(f64::MIN_POSITIVE)
}

/// Section of cloth by a plane.
#[derive(Default)]
struct ClothSection {
    /// Metres.
    length: f64,
    is_covered: [bool; SECTORS],
}

impl ClothSection {
    /// Share of the way around.
    fn share(&self) -> f64 {
        self.is_covered.iter().filter(|b| **b).count() as f64 / SECTORS as f64
    }
    /// Adds a line between two points at turns around the part, 0 to 1.
    fn add(&mut self, length: f32, [from, to]: [f32; 2]) {
        self.length += f64::from(length);
        let way = (to - from) - (to - from).round();
        let steps = (way.abs() * 2.0 * SECTORS as f32).ceil() as usize;
        for k in 0..=steps {
            let turn = (from + way * k as f32 / steps.max(1) as f32).rem_euclid(1.0);
            self.is_covered[((turn * SECTORS as f32) as usize).min(SECTORS - 1)] = true;
        }
    }
}

/// Directions of a part of the body at rest: along it, and two across.
struct PartAxes {
    mask: u8,
    along: V3,
    across: [V3; 2],
}

impl PartAxes {
    /// `None` for a limb that the skeleton lacks.
    fn new(template: &Template, part: BodyPart) -> Option<Self> {
        let along = match part {
            BodyPart::Trunk => V3::y(),
            _ => {
                let limb = template.parts().limb(part)?;
                let at = |joint: usize| template.skeleton().joints()[joint].rest.cast::<f32>();
                (at(limb.end) - at(limb.root)).try_normalize(1e-6)?
            }
        };
        let across = along.cross(&V3::x()).try_normalize(0.1);
        let across = across.unwrap_or_else(|| along.cross(&V3::z()).normalize());
        Some(Self {
            mask: part.mask(),
            along,
            across: [across, along.cross(&across)],
        })
    }
    /// Place along the part, in planes.
    fn level(&self, p: &P3) -> f32 {
        p.coords.dot(&self.along) / SPACING
    }
    /// Turn around a point of the axis, 0 to 1.
    fn turn(&self, p: &P3, middle: &P3) -> f32 {
        let [x, y] = self.across.map(|a| (p - middle).dot(&a));
        y.atan2(x) / TAU + 0.5
    }
    /// Middle of the skin near each plane.
    fn middles(&self, skin: &[P3], parts: &[u8]) -> BTreeMap<i32, P3> {
        let mut sums: BTreeMap<i32, (V3, f32)> = BTreeMap::new();
        let own = skin.iter().zip(parts).filter(|p| *p.1 & self.mask != 0);
        for (p, _) in own {
            let sum = sums.entry(self.level(p).round() as i32).or_default();
            *sum = (sum.0 + p.coords, sum.1 + 1.0);
        }
        let mean = |(level, (sum, count)): (i32, (V3, f32))| (level, P3::from(sum / count));
        sums.into_iter().map(mean).collect()
    }
    /// Sections of the cloth over the part.
    fn sections(&self, skin: &[P3], parts: &[u8], cloth: &ClothOverSkin<'_>) -> Vec<ClothSection> {
        let middles = self.middles(skin, parts);
        let mut out: BTreeMap<i32, ClothSection> = BTreeMap::new();
        let is_own = |f: &&Face| {
            let of = |v: &u32| cloth.over[*v as usize] & self.mask != 0;
            f.iter().any(of) && f.iter().any(|v| cloth.height[*v as usize] > -DEEP)
        };
        for f in cloth.faces.iter().filter(is_own) {
            for (level, [a, b]) in self.cuts(f.map(|v| cloth.x[v as usize])) {
                let section = out.entry(level).or_default();
                match middles.get(&level) {
                    Some(m) => section.add((b - a).norm(), [self.turn(&a, m), self.turn(&b, m)]),
                    // Past the end of the part there is nothing to go around.
                    None => section.length += f64::from((b - a).norm()),
                }
            }
        }
        out.into_values().collect()
    }
    /// Lines in which a triangle crosses the planes.
    fn cuts(&self, corners: [P3; 3]) -> Vec<(i32, [P3; 2])> {
        let levels = corners.map(|p| self.level(&p));
        let [low, high] = levels
            .iter()
            .fold([f32::MAX, f32::MIN], |[l, h], v| [l.min(*v), h.max(*v)]);
        let cut = |level: i32| {
            let at = level as f32;
            let mut ends = [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(|(i, j)| {
                let is_crossed = (levels[i] < at) != (levels[j] < at);
                let share = (at - levels[i]) / (levels[j] - levels[i]);
                is_crossed.then(|| corners[i] + (corners[j] - corners[i]) * share)
            });
            Some((level, [ends.next()?, ends.next()?]))
        };
        // A triangle that leaves the scene has no end of planes.
        let last = FARTHEST / SPACING;
        let [low, high] = [low.ceil(), high.floor()].map(|level| level.clamp(-last, last) as i32);
        (low..=high).filter_map(cut).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_body::parts::vertex_masks;

    /// Faces of the skin whose corners are covered, as cloth at a height over it, metres.
    fn share(is_covered: impl Fn(&P3) -> bool, height: f32) -> f64 {
        let t = embedded::template();
        let parts = vertex_masks(&t);
        let x = t.mesh().vertices();
        let is_cloth = |f: &&Face| f.iter().all(|v| is_covered(&x[*v as usize]));
        let faces: Vec<Face> = t.mesh().faces().iter().filter(is_cloth).copied().collect();
        let cloth = ClothOverSkin {
            faces: &faces,
            x,
            over: &parts,
            height: &vec![height; x.len()],
        };
        wrap(&t, &parts, &cloth)
    }

    #[test]
    fn a_vest_goes_around_and_its_front_less_than_half() {
        let is_trunk = |p: &P3| (1.0..1.25).contains(&p.y) && p.x.abs() < 0.25;
        assert!(share(is_trunk, 0.01) > 0.9);
        let front = share(|p| is_trunk(p) && p.z > 0.02, 0.01);
        assert!((0.2..0.55).contains(&front), "{front}");
        let sleeve = share(|p| p.x > 0.3 && p.y > 1.0, 0.01);
        assert!(sleeve > 0.9, "{sleeve}");
        assert_eq!(share(|_| false, 0.01), 0.0);
        assert_eq!(share(is_trunk, -0.05), 0.0, "inside");
    }

    #[test]
    fn a_triangle_that_leaves_the_scene_is_cut_by_the_planes_of_the_scene_alone() {
        let t = embedded::template();
        let trunk = PartAxes::new(&t, BodyPart::Trunk).expect("a trunk");
        let far = P3::new(0.0, 1e9, 0.0);
        let lines = trunk.cuts([P3::origin(), P3::new(0.1, 0.0, 0.0), far]);
        assert_eq!(lines.len() as f32, FARTHEST / SPACING);
    }

    /// A square that the body passes through like a ring through a finger, but without a hole.
    #[test]
    fn a_sheet_across_the_body_goes_around_nothing() {
        let t = embedded::template();
        let parts = vertex_masks(&t);
        for tilt in [0.0, 0.08] {
            let corner = |[x, z]: [f32; 2]| P3::new(x, 1.12 + tilt * x, z);
            let x = [[-0.4, -0.4], [0.4, -0.4], [0.4, 0.4], [-0.4, 0.4]].map(corner);
            let cloth = ClothOverSkin {
                faces: &[[0, 1, 2], [0, 2, 3]],
                x: &x,
                over: &[BodyPart::Trunk.mask(); 4],
                height: &[0.3; 4],
            };
            let share = wrap(&t, &parts, &cloth);
            assert!(share < 0.55, "{tilt}: {share}");
        }
    }
}
