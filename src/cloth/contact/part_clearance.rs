//! Separation of body parts that press on each other, so that cloth fits between them.
//!
//! Flesh of an upper arm at the chest, or of thighs, deforms; skinned surfaces penetrate each other instead. Vertices with
//! less than the required clearance move apart, half of what is missing on either side.

use super::proximity_cache::{PartQuery, ProximityCache};
use super::{Part, SurfaceFrame, SurfaceModel};
use crate::settings::{CollisionConfig, PartClearanceSettings};
use serde::{Deserialize, Serialize};
use tryon_geometry::math::V3;
use tryon_geometry::mesh::smoothing::mean;

/// Separating displacement of each vertex and the queries behind it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct PartClearance(ProximityCache<V3>);

impl PartClearance {
    /// Displaces vertices with less than the clearance to another part, and empties the normals of `frame`.
    /// `pressing`: the part that presses on each vertex, 0 for none. Returns the number of separated vertices.
    pub(super) fn apply(
        &mut self,
        config: &CollisionConfig,
        model: &SurfaceModel,
        pressing: &[Part],
        frame: &mut SurfaceFrame,
    ) -> usize {
        let (clearance, most) = (config.clearance, config.parts.max_displacement);
        // Few normals are needed: each is computed on demand.
        frame.normals.clear();
        let still = &*frame;
        let query = PartQuery {
            surface: model,
            frame: still,
            others: pressing,
            reach: clearance,
        };
        self.0.update(config.par, &query, |v, near, hit| match hit {
            Ok(c)
                if !c.on_part_boundary
                    && pressing[near as usize] != 0
                    && c.signed_distance < clearance
                    && c.normal.dot(&model.normal(still, v as u32)) < 0.0 =>
            {
                c.normal * (0.5 * (clearance - c.signed_distance)).min(most)
            }
            _ => V3::zeros(),
        });
        let moves = |v: &u32| self.0.entries[*v as usize].result != V3::zeros();
        let separated: Vec<u32> = (0..frame.vertices.len() as u32).filter(moves).collect();
        for (v, displacement) in self.smoothed(&config.parts, model, &separated) {
            frame.vertices[v as usize] += displacement;
        }
        separated.len()
    }

    /// Displacements of the separated vertices, which keep their own, and of the rings around them.
    fn smoothed(
        &self,
        settings: &PartClearanceSettings,
        model: &SurfaceModel,
        separated: &[u32],
    ) -> Vec<(u32, V3)> {
        let mut is_near = vec![false; self.0.entries.len()];
        let mut near = separated.to_vec();
        near.iter().for_each(|v| is_near[*v as usize] = true);
        let mut last = 0;
        for _ in 0..settings.smoothing {
            let ring = last..near.len();
            last = near.len();
            for k in ring {
                for &w in model.neighbours(near[k]) {
                    if !std::mem::replace(&mut is_near[w as usize], true) {
                        near.push(w);
                    }
                }
            }
        }
        let mut all: Vec<V3> = self.0.entries.iter().map(|e| e.result).collect();
        let mut next = vec![V3::zeros(); near.len()];
        for _ in 0..settings.smoothing {
            for (to, &v) in next.iter_mut().zip(&near) {
                let around = model.neighbours(v).iter().map(|w| &all[*w as usize]);
                let Some(mean) = mean(std::iter::once(&all[v as usize]).chain(around)) else {
                    continue;
                };
                let own = self.0.entries[v as usize].result;
                let (most, length) = (own.norm() + settings.max_extra, mean.norm());
                *to = if length <= own.norm() {
                    own
                } else {
                    mean * (most / length).min(1.0)
                };
            }
            near.iter()
                .zip(&next)
                .for_each(|(v, d)| all[*v as usize] = *d);
        }
        near.into_iter().map(|v| (v, all[v as usize])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_shapes::two_spheres;
    use super::*;
    use tryon_geometry::math::P3;
    use tryon_geometry::par::Par;

    fn config(par: Par) -> CollisionConfig {
        CollisionConfig {
            par,
            ..CollisionConfig::default()
        }
    }

    /// Two spheres of radius 1, their centres `d` apart.
    fn two(d: f32) -> (SurfaceModel, SurfaceFrame, Vec<Part>, usize) {
        let (model, frame, n) = two_spheres(4, 1.0, [0.0, d], [1, 2]);
        let pressing = (0..2 * n).map(|i| if i < n { 2 } else { 1 }).collect();
        (model, frame, pressing, n)
    }

    #[test]
    fn pressing_spheres_get_the_clearance_and_nothing_else_moves() {
        // Penetrating by 1 cm, and just apart.
        for d in [1.99, 2.005] {
            let (model, mut frame, pressing, n) = two(d);
            let before = frame.vertices.clone();
            let mut parts = PartClearance::default();
            let count = parts.apply(&config(Par::Seq), &model, &pressing, &mut frame);
            assert!(count > 0 && count < n / 4, "{count}");
            // The poles face each other: each moves by half of what is missing.
            let gap = frame.vertices[n + 1].x - frame.vertices[0].x;
            assert!((gap - 0.013).abs() < 1e-3, "{gap} m between the poles");
            for (i, (a, b)) in before.iter().zip(&frame.vertices).enumerate() {
                let other = P3::new(if i < n { d } else { 0.0 }, 0.0, 0.0);
                let moved = (a - b).norm();
                assert!(moved <= 0.035 + 1e-6);
                // Three smoothing iterations reach three edges (6 cm each) further.
                assert!(
                    moved < 1e-6 || (a - other).norm() < 1.0 + 0.2,
                    "{i}: {moved} m"
                );
            }
        }
        let (model, mut frame, pressing, _) = two(2.1);
        let before = frame.vertices.clone();
        let mut parts = PartClearance::default();
        assert_eq!(
            parts.apply(&config(Par::Seq), &model, &pressing, &mut frame),
            0
        );
        assert_eq!(frame.vertices, before);
    }

    #[test]
    fn incremental_clearance_agrees_with_clearance_from_scratch() {
        let mut incremental = PartClearance::default();
        for d in [2.1, 2.0, 1.97, 2.004, 2.2] {
            let (model, mut frame, pressing, _) = two(d);
            let mut anew = SurfaceFrame::without_normals(frame.vertices.clone());
            incremental.apply(&config(Par::Seq), &model, &pressing, &mut frame);
            PartClearance::default().apply(&config(Par::Rayon), &model, &pressing, &mut anew);
            let pairs = frame.vertices.iter().zip(&anew.vertices);
            let off = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
            assert!(off < 1e-6, "{d}: {off} m");
        }
    }

    #[test]
    fn parts_that_do_not_press_stay() {
        let (model, mut frame, mut pressing, n) = two(1.99);
        pressing[n..].fill(0);
        let before = frame.vertices.clone();
        let mut parts = PartClearance::default();
        assert_eq!(
            parts.apply(&config(Par::Seq), &model, &pressing, &mut frame),
            0
        );
        assert_eq!(frame.vertices, before);
    }
}
