//! Truth of visibility: the drawn garments against the noise-free surface of the person.

use super::border::Seen;
use super::film::{DrawnScene, WornFilm};
use nalgebra::Point3;
use tryon_body::parts::BodySegment;
use tryon_body::{Template, embedded};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::raster::{Cull, VisibilityBuffer};

/// Longest distance of cloth from skin that it covers, along the normal (m): a flared skirt.
const REACH: f32 = 0.5;

/// Distance from covered skin within which skin touches the edge of the cloth, and its greatest depth before the cloth
/// there: the tracked body is right to millimetres (m).
const BESIDE: f32 = 0.03;
const TOUCHES: f32 = 0.02;

/// Skin under and at the edges of garments, by vertex of the embedded body.
pub(super) struct CoveredSkin(Vec<SkinPlace>);

/// Place of skin against garments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SkinPlace {
    /// Under one: it is never before one.
    Covered,
    /// Next to covered skin, at a neckline or the end of a sleeve.
    Edge,
    Bare,
}

impl CoveredSkin {
    /// Skin from which a ray along the normal leaves a garment from its inner side, on the body that the cloth met.
    pub(super) fn of(scene: &DrawnScene) -> Self {
        let template = embedded::template();
        let (vertices, faces) = scene.joined();
        let normals = template.normals(&scene.body);
        let rays = scene.body.iter().zip(&normals);
        let is_covered = |(i, (p, n)): (usize, (&P3, &V3))| {
            is_dressable(&template, i) && leaves_cloth(&vertices, &faces, p, n)
        };
        let covered: Vec<bool> = rays.enumerate().map(is_covered).collect();
        let is_beside = |p: &P3| {
            let mut others = scene.body.iter().zip(&covered);
            others.any(|(q, c)| *c && (p - q).norm_squared() < BESIDE * BESIDE)
        };
        let place = |(i, p): (usize, &P3)| match () {
            () if covered[i] => SkinPlace::Covered,
            () if is_beside(p) => SkinPlace::Edge,
            () => SkinPlace::Bare,
        };
        Self(scene.body.iter().enumerate().map(place).collect())
    }

    /// Depth before the cloth from which a face is before it, metres.
    fn gap(&self, face: &Face) -> f32 {
        let places = face.map(|v| self.0[v as usize]);
        let is_most = |place| places.iter().filter(|p| **p == place).count() >= 2;
        match () {
            () if is_most(SkinPlace::Covered) => f32::INFINITY,
            () if is_most(SkinPlace::Bare) => 0.0,
            () => TOUCHES,
        }
    }
}

/// Head, hands and feet are under no garment of the judge.
fn is_dressable(template: &Template, vertex: usize) -> bool {
    use BodySegment::{Fingers, Foot, Hand, Head, Toes};
    let segment = template
        .parts()
        .segment(template.weights().dominant(vertex));
    ![Head, Hand, Fingers, Foot, Toes].contains(&segment)
}

/// The nearest cloth along a unit ray is met from its inner side.
fn leaves_cloth(vertices: &[P3], faces: &[Face], from: &P3, ray: &V3) -> bool {
    let mut nearest = (REACH, false);
    for f in faces {
        let [a, b, c] = f.map(|v| vertices[v as usize]);
        // No edge is longer.
        if (a - from).norm() > nearest.0 + 0.1 {
            continue;
        }
        if let Some((t, is_inner)) = crossing(from, ray, [a, b, c]).filter(|(t, _)| *t < nearest.0)
        {
            nearest = (t, is_inner);
        }
    }
    nearest.1
}

/// Distance along a ray to a triangle, and its inner side is met (Möller and Trumbore 1997).
fn crossing(from: &P3, ray: &V3, [a, b, c]: [Point3<f32>; 3]) -> Option<(f32, bool)> {
    let (e, f) = (b - a, c - a);
    let p = ray.cross(&f);
    let det = e.dot(&p);
    if det.abs() < 1e-12 {
        return None;
    }
    let s = (from - a) / det;
    let u = s.dot(&p);
    let q = s.cross(&e);
    let v = ray.dot(&q);
    let t = f.dot(&q);
    let is_hit = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0;
    // The normal e × f points along the ray: det = −ray · (e × f).
    is_hit.then_some((t, det < 0.0))
}

/// Surface seen at each pixel if the picture were right: garment or person, and `Outside` beside garments.
pub(super) fn truth(
    film: &WornFilm,
    scene: &DrawnScene,
    covered: &CoveredSkin,
    person: &[P3],
) -> Vec<Seen> {
    let (vertices, faces) = scene.joined();
    let cloth = film.rasterise(&vertices, &faces, Cull::None);
    let cloth_fronts = film.rasterise(&vertices, &faces, Cull::Back);
    let template = embedded::template();
    let body_faces = template.mesh().faces();
    let body = film.rasterise(person, body_faces, Cull::Back);
    let at = |i: usize| {
        if cloth.face[i] == VisibilityBuffer::NONE {
            return Seen::Outside;
        }
        let face = body.face[i];
        if face == VisibilityBuffer::NONE || body.depth[i] >= cloth.depth[i] {
            return Seen::Garment;
        }
        // The body is tracked to some millimetres: its covered skin may be before a garment's outer side.
        let is_outer = cloth_fronts.face[i] == cloth.face[i];
        let gap = covered.gap(&body_faces[face as usize]);
        if is_outer && cloth.depth[i] - body.depth[i] <= gap {
            Seen::Garment
        } else {
            Seen::Person
        }
    };
    (0..cloth.face.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_leaves_cloth_that_faces_away_and_enters_cloth_that_faces_it() {
        let sheet = [[-0.05, -0.05, 0.3], [0.05, -0.05, 0.3], [0.0, 0.05, 0.3]].map(P3::from);
        let from = P3::origin();
        let leaves = |face: Face, ray: V3| leaves_cloth(&sheet, &[face], &from, &ray);
        assert!(leaves([0, 1, 2], V3::z()), "its normal is +z");
        assert!(!leaves([0, 2, 1], V3::z()));
        assert!(!leaves([0, 1, 2], -V3::z()), "behind");
        assert!(!leaves([0, 1, 2], V3::x()));
    }
}
