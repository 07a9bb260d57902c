//! Implicit multistep integrators in their variational form: a step minimises inertia plus energy.
//!
//! With `a = (1+ω)²/(1+2ω)`, `b = ω²/(1+2ω)`, `γ = (1+ω)/(1+2ω)` and the ratio `ω` of this step to the last one, the
//! second-order backward difference (BDF2) of a variable step reads `x − a xₙ + b xₙ₋₁ = γ h v`. `ω = 0` is implicit Euler.

use crate::settings::TimeScheme;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{P3, V3d};

/// Positions and velocities at one time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MotionState {
    /// Positions (m).
    pub x: Vec<V3d>,
    /// Velocities (m/s).
    pub v: Vec<V3d>,
}

/// State of an integration: the present and what a two-step method remembers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OfflineState {
    /// Time (s).
    pub time: f64,
    /// Present.
    pub now: MotionState,
    /// One step earlier with the length of that step (s); `None` after a start or a restart.
    pub earlier: Option<(MotionState, f64)>,
    /// Obstacle vertices where they are, and their scripted targets (m); empty without an obstacle.
    pub obstacle: [Vec<V3d>; 2],
}

impl OfflineState {
    /// Positions in single precision (m).
    pub fn positions(&self) -> Vec<P3> {
        points(&self.now.x)
    }

    /// Vertices of the cloth, then those of the obstacle where they are (m).
    pub(super) fn unknowns(&self) -> Vec<V3d> {
        let all = self.now.x.iter().chain(&self.obstacle[0]);
        all.copied().collect()
    }

    /// Obstacle vertices in single precision (m).
    pub fn obstacle_positions(&self) -> Vec<P3> {
        points(&self.obstacle[0])
    }
}

fn points(x: &[V3d]) -> Vec<P3> {
    x.iter().map(|p| P3::from(p.cast::<f32>())).collect()
}

/// Coefficients of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StepCoefficients {
    now: f64,
    earlier: f64,
    /// γ h (s).
    pub(super) span: f64,
    /// Ratio to the last step; 0 for implicit Euler.
    ratio: f64,
}

impl StepCoefficients {
    pub(super) fn new(scheme: TimeScheme, state: &OfflineState, h: f64) -> Self {
        let ratio = match (scheme, &state.earlier) {
            (TimeScheme::Bdf2, Some((_, before))) if *before > 0.0 => h / before,
            _ => 0.0,
        };
        let divisor = 1.0 + 2.0 * ratio;
        Self {
            now: (1.0 + ratio).powi(2) / divisor,
            earlier: ratio * ratio / divisor,
            span: h * (1.0 + ratio) / divisor,
            ratio,
        }
    }

    /// `a now − b earlier`.
    fn history(
        &self,
        state: &OfflineState,
        vertex: usize,
        of: impl Fn(&MotionState) -> &[V3d],
    ) -> V3d {
        let now = of(&state.now)[vertex] * self.now;
        match &state.earlier {
            Some((earlier, _)) if self.ratio > 0.0 => now - of(earlier)[vertex] * self.earlier,
            _ => now,
        }
    }

    /// Position that a vertex without forces reaches (m).
    pub(super) fn inertial_position(&self, state: &OfflineState, vertex: usize) -> V3d {
        self.history(state, vertex, |s| &s.x) + self.history(state, vertex, |s| &s.v) * self.span
    }

    /// Velocity of a vertex that has reached `x` (m/s).
    pub(super) fn velocity(&self, state: &OfflineState, vertex: usize, x: &V3d) -> V3d {
        (x - self.history(state, vertex, |s| &s.x)) / self.span
    }

    /// Share of the distance between prediction and solution that is the solution's error: ½ for implicit Euler; 2/9 of
    /// (2/9 + 5/12) for BDF2 of an even step.
    pub(super) fn error_share(&self) -> f64 {
        if self.ratio > 0.0 { 0.35 } else { 0.5 }
    }

    /// Explicit prediction of the same order, for a start of the iteration and the error estimate (m).
    pub(super) fn prediction(&self, state: &OfflineState, vertex: usize, h: f64) -> V3d {
        let (x, v) = (state.now.x[vertex], state.now.v[vertex]);
        match &state.earlier {
            Some((earlier, _)) if self.ratio > 0.0 => {
                let change = (v - earlier.v[vertex]) * (0.5 * self.ratio);
                x + (v + change) * h
            }
            _ => x + v * h,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x'' = −x from (1, 0): error at t = 1 by steps of alternating length.
    fn oscillator_error(scheme: TimeScheme, steps: usize) -> f64 {
        let one = |x, v| MotionState {
            x: vec![V3d::new(x, 0.0, 0.0)],
            v: vec![V3d::new(v, 0.0, 0.0)],
        };
        let mut state = OfflineState {
            now: one(1.0, 0.0),
            ..OfflineState::default()
        };
        let mut lengths = [0.8 / steps as f64, 1.2 / steps as f64].repeat(steps / 2);
        lengths.truncate(steps);
        for h in lengths {
            let c = StepCoefficients::new(scheme, &state, h);
            let y = c.inertial_position(&state, 0);
            let x = y / (1.0 + c.span * c.span);
            let v = c.velocity(&state, 0, &x);
            let last = std::mem::replace(&mut state.now, one(x.x, v.x));
            state.earlier = Some((last, h));
            state.time += h;
        }
        (state.now.x[0].x - state.time.cos()).abs()
    }

    #[test]
    fn orders_are_one_and_two_at_uneven_steps() {
        let order = |scheme| (oscillator_error(scheme, 200) / oscillator_error(scheme, 400)).log2();
        assert!((order(TimeScheme::ImplicitEuler) - 1.0).abs() < 0.1);
        assert!(
            (order(TimeScheme::Bdf2) - 2.0).abs() < 0.2,
            "{}",
            order(TimeScheme::Bdf2)
        );
    }
}
