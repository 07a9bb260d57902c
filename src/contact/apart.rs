//! Room between parts of the body that press on each other, for cloth that lies between them.
//!
//! An upper arm against the chest, thighs of someone who stands: flesh gives way, a skinned surface does not, it lies in
//! itself. Two layers of cloth have no place there, and each kept off its own part they pass through each other and tear
//! at what hangs on them. So cloth meets skin that was moved back, half-way on either side, where nobody sees it.

use super::across::Across;
use super::{Part, SurfaceFrame, SurfaceModel};
use crate::math::V3;
use crate::mesh::smoothing::mean;
use crate::par::Par;
use serde::{Deserialize, Serialize};

/// What is known about how near the parts are: how far each vertex goes out of the other part, metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Apart(Across<V3>);

/// No skin is moved back further than this, metres: deeper, and the surface does not know any more what is outside.
const MOST: f32 = 0.035;
/// Skin beside it goes at most so much further than it must, metres: cloth on it lies as far off, and so not deeper.
const BESIDE: f32 = 0.005;
/// Rounds of averaging over neighbours, so that the skin beside has no step.
const ROUNDS: usize = 3;

impl Apart {
    /// Moves skin of `frame` back where less than `room` metres are left between parts, and leaves its normals empty.
    /// `pressing`: the part that presses on each vertex, 0 where that shall not count. Says how many vertices moved.
    pub fn make_room(
        &mut self,
        par: Par,
        model: &SurfaceModel,
        pressing: &[Part],
        frame: &mut SurfaceFrame,
        room: f32,
    ) -> usize {
        // Few of them are wanted.
        frame.normals.clear();
        let still = &*frame;
        self.0.look(
            par,
            model,
            pressing,
            still,
            room,
            |v, near, hit| match hit {
                Ok(c) if !c.rim && pressing[near as usize] != 0 && c.signed < room => {
                    let facing = c.normal.dot(&model.normal(still, v as u32)) < 0.0;
                    if facing {
                        c.normal * (0.5 * (room - c.signed)).min(MOST)
                    } else {
                        V3::zeros()
                    }
                }
                _ => V3::zeros(),
            },
        );
        let goes = |v: &u32| self.0.seen[*v as usize].found != V3::zeros();
        let must: Vec<u32> = (0..frame.vertices.len() as u32).filter(goes).collect();
        for (v, way) in self.eased(model, &must) {
            frame.vertices[v as usize] += way;
        }
        must.len()
    }

    /// Ways of the vertices that must go and of those around them.
    fn eased(&self, model: &SurfaceModel, must: &[u32]) -> Vec<(u32, V3)> {
        let mut near = vec![false; self.0.seen.len()];
        let mut all = must.to_vec();
        all.iter().for_each(|v| near[*v as usize] = true);
        let mut last = 0;
        for _ in 0..ROUNDS {
            let ring = last..all.len();
            last = all.len();
            for k in ring {
                for &w in model.neighbours(all[k]) {
                    if !std::mem::replace(&mut near[w as usize], true) {
                        all.push(w);
                    }
                }
            }
        }
        let mut ways: Vec<V3> = self.0.seen.iter().map(|s| s.found).collect();
        let mut next = vec![V3::zeros(); all.len()];
        for _ in 0..ROUNDS {
            for (to, &v) in next.iter_mut().zip(&all) {
                let around = model.neighbours(v);
                let around = around.iter().map(|w| &ways[*w as usize]);
                let Some(mean) = mean(std::iter::once(&ways[v as usize]).chain(around)) else {
                    continue;
                };
                // What must go goes all its way, and takes what is beside it along a little.
                let own = self.0.seen[v as usize].found;
                let (most, far) = (own.norm() + BESIDE, mean.norm());
                *to = if far <= own.norm() {
                    own
                } else {
                    mean * (most / far).min(1.0)
                };
            }
            all.iter()
                .zip(&next)
                .for_each(|(v, way)| ways[*v as usize] = *way);
        }
        all.into_iter().map(|v| (v, ways[v as usize])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::surface::tests::two_spheres;
    use crate::math::P3;

    /// Two spheres of radius 1, their centres `d` apart.
    fn two(d: f32) -> (SurfaceModel, SurfaceFrame, Vec<Part>, usize) {
        let (model, frame, n) = two_spheres(4, 1.0, [0.0, d], [1, 2]);
        let pressing = (0..2 * n).map(|i| if i < n { 2 } else { 1 }).collect();
        (model, frame, pressing, n)
    }

    #[test]
    fn between_two_spheres_that_press_on_each_other_there_is_room_and_elsewhere_nothing_moves() {
        const ROOM: f32 = 0.013;
        // In each other by 1 cm, and just apart.
        for d in [1.99, 2.005] {
            let (model, mut frame, pressing, n) = two(d);
            let before = frame.vertices.clone();
            let count = Apart::default().make_room(Par::Seq, &model, &pressing, &mut frame, ROOM);
            assert!(count > 0 && count < n / 4, "{count}");
            // The poles lie opposite of each other, so each goes half of what is lacking.
            let (low, high) = (frame.vertices[0].x, frame.vertices[n + 1].x);
            assert!(
                (high - low - ROOM).abs() < 1e-3,
                "{} m between the poles",
                high - low
            );
            for (i, (a, b)) in before.iter().zip(&frame.vertices).enumerate() {
                let other = P3::new(if i < n { d } else { 0.0 }, 0.0, 0.0);
                let way = (a - b).norm();
                assert!(way <= MOST + 1e-6);
                // Three rounds of averaging reach three edges (6 cm each) further.
                assert!(
                    way < 1e-6 || (a - other).norm() < 1.0 + 0.2,
                    "vertex {i} moved by {way} m"
                );
            }
        }
        let (model, mut frame, pressing, _) = two(2.1);
        let before = frame.vertices.clone();
        assert_eq!(
            Apart::default().make_room(Par::Seq, &model, &pressing, &mut frame, ROOM),
            0
        );
        assert_eq!(frame.vertices, before);
    }

    #[test]
    fn what_was_known_before_gives_the_same_as_knowing_nothing() {
        let mut known = Apart::default();
        for d in [2.1, 2.0, 1.97, 2.004, 2.2] {
            let (model, mut frame, pressing, _) = two(d);
            let mut anew = SurfaceFrame {
                vertices: frame.vertices.clone(),
                normals: Vec::new(),
            };
            known.make_room(Par::Seq, &model, &pressing, &mut frame, 0.013);
            Apart::default().make_room(Par::Rayon, &model, &pressing, &mut anew, 0.013);
            let far = frame
                .vertices
                .iter()
                .zip(&anew.vertices)
                .map(|(a, b)| (a - b).norm())
                .fold(0.0, f32::max);
            assert!(far < 1e-6, "{d}: {far} m");
        }
    }

    #[test]
    fn parts_that_do_not_press_are_left_alone() {
        let (model, mut frame, mut pressing, n) = two(1.99);
        pressing[n..].fill(0);
        let before = frame.vertices.clone();
        assert_eq!(
            Apart::default().make_room(Par::Seq, &model, &pressing, &mut frame, 0.013),
            0
        );
        assert_eq!(frame.vertices, before);
    }
}
