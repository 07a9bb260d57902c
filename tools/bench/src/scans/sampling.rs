//! Visible points of a surface, uniform by area.

use super::surface::SceneSurface;
use super::view::ViewRing;
use rand::Rng;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::face_normal;
use tryon_geometry::par::{self, Par};

/// Rounds after which a surface counts as hidden.
const ROUNDS: usize = 24;

/// Visible point of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceSample {
    pub(super) face: u32,
    /// Barycentric weights in the face.
    pub(super) weights: [f32; 3],
    pub(super) point: P3,
    /// Unit normal on the side of the camera.
    pub(super) normal: V3,
    pub(super) label: u8,
    /// Direction to the camera.
    pub(super) toward: V3,
}

/// Draws `count` visible points from the candidate faces; fewer from a surface that is nearly hidden.
pub(super) fn sample(
    surface: &SceneSurface,
    ring: &ViewRing,
    candidates: &[bool],
    count: usize,
    rng: &mut impl Rng,
) -> Vec<SurfaceSample> {
    let (mut ids, mut sums, mut total) = (Vec::new(), Vec::new(), 0.0f64);
    for (id, face) in (0u32..).zip(&surface.faces) {
        if candidates[id as usize] {
            total += f64::from(face_normal(&surface.vertices, face).norm());
            ids.push(id);
            sums.push(total);
        }
    }
    let mut out: Vec<SurfaceSample> = Vec::with_capacity(count);
    for _ in 0..ROUNDS {
        if out.len() == count || ids.is_empty() {
            break;
        }
        let missing = count - out.len();
        let tries = ((missing as f64 * surface.settings.oversampling) as usize).max(64);
        let places: Vec<(u32, [f32; 3])> = (0..tries)
            .map(|_| {
                let at = rng.random_range(0.0..total);
                let k = sums.partition_point(|s| *s <= at).min(ids.len() - 1);
                (ids[k], weights(rng.random(), rng.random()))
            })
            .collect();
        let mut seen = Vec::new();
        par::map_into(Par::Rayon, tries, 512, &mut seen, |i| {
            let (face, weights) = places[i];
            visible(surface, ring, face, weights)
        });
        out.extend(seen.into_iter().flatten().take(missing));
    }
    out
}

/// Sample at a place of a face; `None` if no camera sees it.
fn visible(
    surface: &SceneSurface,
    ring: &ViewRing,
    id: u32,
    weights: [f32; 3],
) -> Option<SurfaceSample> {
    let face = &surface.faces[id as usize];
    let label = surface.labels[face[0] as usize];
    let normal = SceneSurface::blend(&surface.normals, face, weights).try_normalize(0.0)?;
    let drawn = SceneSurface::place(&surface.drawn, face, weights);
    let (view, cosine) = ring.best(&drawn, &normal, label)?;
    let point = SceneSurface::place(&surface.vertices, face, weights);
    Some(SurfaceSample {
        face: id,
        weights,
        point,
        normal: normal * cosine.signum(),
        label,
        toward: (view.eye - point).normalize(),
    })
}

/// Barycentric weights, uniform in a triangle, from two uniform numbers.
fn weights(a: f32, b: f32) -> [f32; 3] {
    let root = a.sqrt();
    [1.0 - root, root * (1.0 - b), root * b]
}
