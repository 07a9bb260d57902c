//! Scripted motion of pins and obstacle.

use super::model::PinTarget;
use tryon_geometry::math::V3d;

/// Targets at the end of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameTargets<'a> {
    /// Pinned vertices.
    pub pins: &'a [PinTarget],
    /// Obstacle vertices (m); empty keeps the obstacle where it is.
    pub obstacle: &'a [V3d],
}

/// Scripted motion over a frame.
pub(super) struct FrameScript<'a> {
    pub(super) targets: &'a FrameTargets<'a>,
    /// Pinned vertices and obstacle targets at the start (m).
    pub(super) pins: Vec<V3d>,
    pub(super) obstacle: Vec<V3d>,
}

/// Targets at the end of a step.
pub(super) struct StepTargets {
    pub(super) pins: Vec<PinTarget>,
    pub(super) obstacle: Vec<V3d>,
}

impl FrameScript<'_> {
    /// Targets at a share of the frame.
    pub(super) fn at(&self, share: f64) -> StepTargets {
        let pins = self.targets.pins.iter().zip(&self.pins);
        StepTargets {
            pins: pins
                .map(|(p, from)| PinTarget {
                    target: from.lerp(&p.target, share),
                    ..*p
                })
                .collect(),
            obstacle: if self.targets.obstacle.len() == self.obstacle.len() {
                let all = self.obstacle.iter().zip(self.targets.obstacle);
                all.map(|(from, to)| from.lerp(to, share)).collect()
            } else {
                self.obstacle.clone()
            },
        }
    }
}
