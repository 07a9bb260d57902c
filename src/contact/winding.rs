//! Inside test of a closed surface that may intersect itself: winding number by ray crossings, faces sorted by height.

use crate::math::P3;
use crate::mesh::Face;
use crate::spatial::ray_crossing;

/// Height of the bands that faces are sorted into, metres: about two edges of a body.
const BAND: f32 = 0.02;
/// More bands than this (20 m) are not made.
const MOST_BANDS: usize = 1000;

/// A surface as it stands now, its faces sorted by height.
#[derive(Debug)]
pub(super) struct Winding<'a> {
    vertices: &'a [P3],
    faces: &'a [Face],
    low: f32,
    /// Start of each band in `of`, shape `[bands + 1]`.
    first: Vec<u32>,
    of: Vec<u32>,
}

impl<'a> Winding<'a> {
    /// Sorts the faces; outward means counter-clockwise.
    pub(super) fn new(vertices: &'a [P3], faces: &'a [Face]) -> Self {
        let (low, high) = vertices
            .iter()
            .fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p.y), h.max(p.y)));
        let bands = (((high - low).max(0.0) / BAND) as usize + 1).min(MOST_BANDS);
        let span = |f: &Face| {
            let y = f.map(|v| vertices[v as usize].y);
            let band = |y: f32| (((y - low) / BAND) as usize).min(bands - 1);
            band(y[0].min(y[1]).min(y[2]))..=band(y[0].max(y[1]).max(y[2]))
        };
        let mut first = vec![0u32; bands + 1];
        faces.iter().flat_map(span).for_each(|b| first[b + 1] += 1);
        (0..bands).for_each(|b| first[b + 1] += first[b]);
        let (mut next, mut of) = (first.clone(), vec![0; first[bands] as usize]);
        for (i, f) in faces.iter().enumerate() {
            for b in span(f) {
                of[next[b] as usize] = i as u32;
                next[b] += 1;
            }
        }
        Self {
            vertices,
            faces,
            low,
            first,
            of,
        }
    }
    /// The surface goes around the point at least once.
    pub(super) fn holds(&self, p: &P3) -> bool {
        let band = (p.y - self.low) / BAND;
        if !(band >= 0.0 && (band as usize) < self.first.len() - 1) {
            return false;
        }
        let [from, to] = [0, 1].map(|k| self.first[band as usize + k] as usize);
        self.of[from..to]
            .iter()
            .map(|f| {
                ray_crossing(
                    p,
                    self.faces[*f as usize].map(|v| self.vertices[v as usize]),
                )
            })
            .sum::<i32>()
            > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::surface::tests::sphere;

    #[test]
    fn a_sphere_holds_what_is_nearer_to_its_middle_than_its_faces() {
        let mesh = sphere(3);
        let w = Winding::new(mesh.vertices(), mesh.faces());
        // The faces of a subdivided octahedron lie between 0.97 and 1 from the middle.
        let mut seen = [0; 2];
        for i in 0..4000u32 {
            let at = |k: u32| {
                (i.wrapping_mul(2_654_435_761 - 17_386 * k) >> 12 & 0xfff) as f32 / 2048.0 - 1.0
            };
            let p = P3::new(at(1) * 1.3, at(2) * 1.3, at(3) * 1.3);
            let r = p.coords.norm();
            if !(0.96..=1.0).contains(&r) {
                assert_eq!(w.holds(&p), r < 0.96, "{p}");
                seen[usize::from(r < 0.96)] += 1;
            }
        }
        assert!(seen.iter().all(|n| *n > 300), "{seen:?}");
        // Rays through corners and along edges cross once.
        assert!(
            mesh.vertices()
                .iter()
                .all(|v| w.holds(&P3::from(v.coords * 0.5)) && !w.holds(&P3::from(v.coords * 1.5)))
        );
    }

    #[test]
    fn nothing_is_inside_an_empty_mesh() {
        assert!(!Winding::new(&[], &[]).holds(&P3::origin()));
    }
}
