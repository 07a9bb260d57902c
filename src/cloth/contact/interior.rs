//! Skin inside another part of the body: a closed armpit, thighs that press on each other.
//!
//! Such skin supports no cloth. Its contact planes contradict those of the part around it, and a sleeve held by both
//! tears off within a second.

use super::proximity_cache::{PartQuery, ProximityCache};
use super::{ClosestPoint, Part, SurfaceFrame, SurfaceModel};
use crate::settings::CollisionConfig;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;
use tryon_geometry::par;
use tryon_geometry::spatial::Bvh;

/// Mask of the vertices inside another part, and the queries behind it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interior {
    sides: ProximityCache<SurfaceSide>,
    inside: Vec<bool>,
}

/// Side of another part's surface on which a vertex lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
enum SurfaceSide {
    #[default]
    Outside,
    Inside,
    /// Behind the nearest skin of the other part: inside if the winding number confirms it.
    Suspect,
    /// The nearest point is where the two parts join.
    Unknown,
}

/// Inside test for a closed surface that may pass through itself, by ray parity with sign.
struct InsideTest<'a> {
    bvh: &'a Bvh,
    vertices: &'a [P3],
}

impl InsideTest<'_> {
    /// The surface winds around the point at least once.
    fn contains(&self, p: &P3) -> bool {
        self.bvh.winding_number(self.vertices, p) > 0
    }
}

impl Interior {
    /// Updates the mask where it may have changed. `opposite`: the part that each vertex may penetrate, 0 for none.
    /// `bvh` holds the faces of `model`.
    pub(super) fn update(
        &mut self,
        config: &CollisionConfig,
        model: &SurfaceModel,
        opposite: &[Part],
        frame: &SurfaceFrame,
        bvh: &mut Bvh,
    ) {
        self.inside.resize(frame.vertices.len(), false);
        let query = PartQuery {
            surface: model,
            frame,
            others: opposite,
            reach: 0.0,
        };
        self.sides.update(config.par, &query, |v, near, hit| {
            classify(&query, v, near, hit)
        });
        self.confirm(config, model, frame, bvh);
    }

    /// Confirms suspects by their winding number and grows the mask into skin of unknown side.
    ///
    /// The nearest point alone is not enough: where an arm ends, its nearest skin faces away from the shoulder blade.
    fn confirm(
        &mut self,
        config: &CollisionConfig,
        model: &SurfaceModel,
        frame: &SurfaceFrame,
        bvh: &mut Bvh,
    ) {
        let entries = &mut self.sides.entries;
        self.inside
            .iter_mut()
            .zip(entries.iter())
            .for_each(|(i, e)| *i = e.result == SurfaceSide::Inside);
        let suspects = entries.iter().any(|e| e.result == SurfaceSide::Suspect);
        if !suspects && !self.inside.contains(&true) {
            return;
        }
        bvh.refit(&frame.vertices);
        let body = InsideTest {
            bvh,
            vertices: &frame.vertices,
        };
        let off = config.off_skin;
        let is_inside = |v: usize| body.contains(&(frame.vertices[v] + frame.normals[v] * off));
        par::for_chunks(config.par, entries, 256, |start, chunk| {
            for (k, e) in chunk.iter_mut().enumerate() {
                if e.result == SurfaceSide::Suspect {
                    let inside = is_inside(start + k);
                    e.result = if inside {
                        SurfaceSide::Inside
                    } else {
                        SurfaceSide::Outside
                    };
                }
            }
        });
        let mut ring: Vec<u32> = (0..entries.len() as u32)
            .filter(|v| entries[*v as usize].result == SurfaceSide::Inside)
            .collect();
        ring.iter().for_each(|v| self.inside[*v as usize] = true);
        let mut tested = self.inside.clone();
        for _ in 0..config.interior_rings {
            let mut next = Vec::new();
            for &w in ring.iter().flat_map(|v| model.neighbours(*v)) {
                let v = w as usize;
                if entries[v].result == SurfaceSide::Unknown
                    && !std::mem::replace(&mut tested[v], true)
                    && is_inside(v)
                {
                    self.inside[v] = true;
                    next.push(w);
                }
            }
            ring = next;
        }
    }

    /// A triangle of the skin supports no cloth: most of its corners are inside another part.
    pub fn covers(&self, corners: [u32; 3]) -> bool {
        let is_inside = |v: &&u32| self.inside.get(**v as usize).copied().unwrap_or(false);
        corners.iter().filter(is_inside).count() > 1
    }

    /// Vertices inside another part.
    pub fn count(&self) -> usize {
        self.inside.iter().filter(|b| **b).count()
    }
}

/// Side of a vertex by the nearest skin of the other part.
fn classify(
    query: &PartQuery<'_>,
    v: usize,
    near: u32,
    hit: &Result<ClosestPoint, f32>,
) -> SurfaceSide {
    let behind = |yes: bool| {
        if yes {
            SurfaceSide::Suspect
        } else {
            SurfaceSide::Outside
        }
    };
    match hit {
        // Far from the other part's skin: outside or deep inside, unless the part ends there.
        Err(_) => {
            let mut around = query.surface.neighbours(near).iter();
            if around.any(|w| query.surface.part(*w) & query.others[v] == 0) {
                return SurfaceSide::Unknown;
            }
            let (x, n) = (&query.frame.vertices, near as usize);
            behind((x[v] - x[n]).dot(&query.frame.normals[n]) < 0.0)
        }
        Ok(c) if c.on_part_boundary => SurfaceSide::Unknown,
        Ok(c) => behind(c.signed_distance < 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_shapes::{sphere, surface, two_spheres};
    use super::*;
    use tryon_geometry::math::V3;
    use tryon_geometry::par::Par;

    fn config() -> CollisionConfig {
        CollisionConfig {
            par: Par::Seq,
            ..CollisionConfig::default()
        }
    }

    #[test]
    fn two_halves_of_one_sphere_are_not_inside_each_other() {
        // Both parts end where they join: the side of the nearest skin is meaningless there.
        let mesh = sphere(4);
        let half = |p: &P3| if p.x < 0.0 { 1 } else { 2 };
        let parts: Vec<Part> = mesh.vertices().iter().map(half).collect();
        let opposite: Vec<Part> = parts.iter().map(|p| 3 - p).collect();
        let (model, frame) = surface(&mesh, parts);
        let mut interior = Interior::default();
        let mut bvh = Bvh::new(model.faces(), &frame.vertices);
        interior.update(&config(), &model, &opposite, &frame, &mut bvh);
        assert_eq!(interior.count(), 0);
    }

    #[test]
    fn mask_of_two_spheres_is_their_intersection_at_any_distance() {
        let (model, start, n) = two_spheres(3, 1.0, [0.0, 3.0], [1, 2]);
        let opposite: Vec<Part> = (0..2 * n).map(|i| if i < n { 2 } else { 1 }).collect();
        let mut bvh = Bvh::new(model.faces(), &start.vertices);
        let mut interior = Interior::default();
        // Apart, into each other, out again, with one state.
        for d in [3.0, 2.2, 1.7, 1.3, 1.9, 2.2, 3.0] {
            let mut frame = SurfaceFrame::without_normals(start.vertices.clone());
            let second = frame.vertices[n..].iter_mut();
            second.for_each(|p| *p += V3::x() * (d - 3.0));
            model.update_normals(Par::Seq, &mut frame);
            interior.update(&config(), &model, &opposite, &frame, &mut bvh);
            let mut undecided = 0;
            for (i, p) in frame.vertices.iter().enumerate() {
                let other = P3::new(if i < n { d } else { 0.0 }, 0.0, 0.0);
                let depth = 1.0 - (p - other).norm();
                // A facet lies up to 8 mm inside its sphere.
                if depth.abs() < 0.02 {
                    undecided += 1;
                } else {
                    assert_eq!(interior.inside[i], depth > 0.0, "{d}: {i}, {depth} m deep");
                }
            }
            assert!(undecided < n / 5);
            assert_eq!(interior.count() == 0, d > 2.0, "distance {d}");
        }
        assert!(
            !interior.covers([0, 1, u32::MAX]),
            "apart, and a missing corner"
        );
    }
}
