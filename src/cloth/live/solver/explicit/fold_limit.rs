//! Unilateral distance constraints across edges: no fold is sharper than the triangles can resolve.
//!
//! The moment of quadratic bending goes with the sine of a hinge's angle, so a hinge folded flat resists no more and may
//! pass through its neighbours. A minimal distance of the two corners across each edge spreads a fold over several edges.

use super::elements::Diagonal;
use super::patch_model::PatchModel;
use super::patch_state::{Exemptions, PatchState};
use super::vec4::V4;
use crate::settings::FoldSettings;

/// Minimal distance of two vertices that may be violated soon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoldLimit {
    ends: [u32; 2],
    /// Minimal distance (m).
    least: f32,
    /// Share of the relative motion that each vertex takes, by inverse mass.
    share: [f32; 2],
}

/// Condition under which a fold limit is active.
#[derive(Clone, Copy, Debug)]
pub struct FoldActivation<'a> {
    /// Minimal over flat distance of a pair; 0: no limits.
    pub ratio: f32,
    /// Time until the next search for active limits (s).
    pub span: f32,
    /// Vertices without limits.
    pub except: Exemptions<'a>,
    /// Settings.
    pub settings: &'a FoldSettings,
}

/// Shortest distance that has a direction (m).
const SHORTEST: f32 = 1e-6;

impl FoldLimit {
    /// Limits that may become active until the next search: pairs that may come nearer than `ratio` times their flat
    /// distance.
    pub fn find_active(
        f: &PatchModel,
        state: &PatchState,
        activation: &FoldActivation<'_>,
        out: &mut Vec<Self>,
    ) {
        out.clear();
        if activation.ratio > 0.0 {
            let active = |d| Self::if_active(d, f, state, activation);
            out.extend(f.diagonals.iter().filter_map(active));
        }
    }
    #[inline]
    fn if_active(
        diagonal: &Diagonal,
        f: &PatchModel,
        state: &PatchState,
        activation: &FoldActivation<'_>,
    ) -> Option<Self> {
        let FoldActivation {
            ratio,
            span,
            except,
            settings,
        } = *activation;
        let Diagonal { ends, flat } = *diagonal;
        let [a, b] = ends.map(|v| v as usize);
        let d = state.position(b) - state.position(a);
        let square = d.dot(d);
        // Most pairs are near rest: no root for them.
        if square >= flat * flat || except.unlimited[a] || except.unlimited[b] {
            return None;
        }
        let (length, least) = (
            square.sqrt().max(SHORTEST),
            (ratio * flat).min(settings.widest),
        );
        let opening = d.dot(state.velocity[b] - state.velocity[a]) / length;
        let weight = [a, b].map(|v| {
            if except.fixed[v] {
                0.0
            } else {
                f.inverse_mass[v]
            }
        });
        let both = weight[0] + weight[1];
        let active = both > 0.0 && length - least < span * (settings.speed_gain - opening);
        active.then(|| Self {
            ends,
            least,
            share: weight.map(|w| w / both),
        })
    }
    /// Removes closing velocities that would violate the limits by the end of a substep of `h`, and recovers violated
    /// ones. Impulses are equal and opposite: linear and angular momentum stay.
    pub fn apply(limits: &[Self], state: &mut PatchState, h: f32, settings: &FoldSettings) {
        let (share, most) = (settings.recovered, settings.recovery_speed * h);
        for s in limits {
            let [a, b] = s.ends.map(|v| v as usize);
            let d = state.position(b) - state.position(a);
            let length = d.dot(d).sqrt();
            if !(length > SHORTEST) {
                continue;
            }
            let normal: V4 = d.scale(1.0 / length);
            let gap = length - s.least;
            let push = -gap.max(0.0) / h - normal.dot(state.velocity[b] - state.velocity[a]);
            if push > 0.0 {
                state.velocity[a] = state.velocity[a] - normal.scale(push * s.share[0]);
                state.velocity[b] = state.velocity[b] + normal.scale(push * s.share[1]);
            }
            if gap < 0.0 {
                let opening = (-gap * share).min(most);
                state.displacement[a] = state.displacement[a] - normal.scale(opening * s.share[0]);
                state.displacement[b] = state.displacement[b] + normal.scale(opening * s.share[1]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_sheets::{cotton, grid, sheet};
    use super::super::{StableSheet, StepSpec, Substep};
    use super::*;
    use crate::settings::SolverSettings;
    use tryon_geometry::math::V3d;

    const H: f32 = 2e-4;
    const RATIO: f32 = 0.6;
    const STEPS: usize = 500;
    const SEARCH_EVERY: usize = 40;
    const MIDDLE: f64 = 0.12;

    /// Two halves of a strip that close at 1.2 m/s.
    struct Clapping {
        model: PatchModel,
        state: PatchState,
        /// Position of the patch's vertices in the flat strip (m).
        flat: Vec<V3d>,
    }

    impl Clapping {
        fn new() -> Self {
            let (x, faces, rest) = grid(20, 2, 0.012, 0.012);
            let s = sheet(&faces, &rest, x.len(), &cotton(1e-6));
            let spec = StepSpec {
                h: f64::from(H),
                lookahead: 0.25,
                bending_interval: 3,
                filter_degree: 0,
            };
            let model = StableSheet::new(&s, &spec, &SolverSettings::default())
                .compile_patches(1, 0, 0)
                .remove(0);
            let flat: Vec<V3d> = model.vertices.iter().map(|v| x[*v as usize]).collect();
            let mut this = Self {
                model,
                state: PatchState::default(),
                flat,
            };
            // A shallow roof whose eaves come down and together.
            let position =
                |p: &V3d| V4::new(p.x as f32, -0.3 * (p.x - MIDDLE).abs() as f32, p.z as f32);
            let velocity = |p: &V3d| {
                let d = p.x - MIDDLE;
                V4::new((-10.0 * d) as f32, (-10.0 * d.abs()) as f32, 0.0)
            };
            let (x, v) = (
                this.flat.iter().map(position),
                this.flat.iter().map(velocity),
            );
            this.state.reset(x, v);
            this
        }
        /// Linear [kg m/s] and angular [kg m²/s] momentum, and the sum of all vertices' momenta.
        fn momentum(&self) -> (V3d, V3d, f64) {
            (0..self.flat.len()).fold((V3d::zeros(), V3d::zeros(), 0.0), |sum, i| {
                let p = self.state.velocity[i].to_f64() / f64::from(self.model.inverse_mass[i]);
                let moment = self.state.position(i).to_f64().cross(&p);
                (sum.0 + p, sum.1 + moment, sum.2 + p.norm())
            })
        }
        /// Least diagonal over its flat length.
        fn sharpest(&self) -> f64 {
            let ratio = |d: &Diagonal| {
                let [a, b] = d.ends.map(|v| self.state.position(v as usize).to_f64());
                (a - b).norm() / f64::from(d.flat)
            };
            self.model
                .diagonals
                .iter()
                .map(ratio)
                .fold(f64::INFINITY, f64::min)
        }
        fn step(&mut self, limits: &[FoldLimit], held: Option<usize>, bend: bool) {
            let step = Substep {
                h: H,
                lookahead: 0.25,
                rings: usize::MAX,
                ..Substep::default()
            };
            if bend {
                self.state.update_bending(&self.model, 1.5 * H, usize::MAX);
            }
            self.state
                .integrate_velocities(&self.model, &step, &[], &[]);
            FoldLimit::apply(limits, &mut self.state, H, &FoldSettings::default());
            if let Some(i) = held {
                self.state.velocity[i] = V4::default();
            }
            self.state
                .integrate_positions(&self.model, &step, f32::INFINITY);
        }
        /// Sharpest fold within 0.1 s.
        fn run(&mut self, ratio: f32, held: Option<usize>) -> f64 {
            let n = self.flat.len();
            let fixed: Vec<bool> = (0..n).map(|i| Some(i) == held).collect();
            let activation = FoldActivation {
                ratio,
                span: SEARCH_EVERY as f32 * H,
                except: Exemptions {
                    fixed: &fixed,
                    unlimited: &vec![false; n],
                },
                settings: &FoldSettings::default(),
            };
            let (mut limits, mut sharpest) = (Vec::new(), f64::INFINITY);
            for k in 0..STEPS {
                if k % SEARCH_EVERY == 0 {
                    FoldLimit::find_active(&self.model, &self.state, &activation, &mut limits);
                }
                self.step(&limits, held, k % 3 == 0);
                sharpest = sharpest.min(self.sharpest());
            }
            sharpest
        }
    }

    #[test]
    fn limits_bound_the_sharpest_fold_and_conserve_momentum() {
        let free = Clapping::new().run(0.0, None);
        assert!(free < 0.1, "folds flat without limits: {free}");
        // One pass a substep leaves a small violation.
        let mut limited = Clapping::new();
        let before = limited.momentum();
        let sharpest = limited.run(RATIO, None);
        assert!(sharpest > f64::from(RATIO) - 0.15, "{sharpest}");
        let after = limited.momentum();
        let linear = (after.0 - before.0).norm() / before.2;
        let angular = (after.1 - before.1).norm() / (0.1 * before.2);
        assert!(linear < 1e-4 && angular < 1e-4, "{linear:e} {angular:e}");
        let mut held = Clapping::new();
        let vertex = held
            .model
            .vertices
            .iter()
            .position(|v| *v == 31)
            .expect("in the strip");
        let sharpest = held.run(RATIO, Some(vertex));
        assert!(sharpest > f64::from(RATIO) - 0.15, "{sharpest}");
        assert_eq!(held.state.displacement[vertex], V4::default(), "held");
    }

    #[test]
    fn coincident_corners_stay_finite() {
        let mut state = PatchState::default();
        state.reset(
            [V4::default(); 2].into_iter(),
            [V4::default(); 2].into_iter(),
        );
        let limit = FoldLimit {
            ends: [0, 1],
            least: 0.01,
            share: [0.5; 2],
        };
        FoldLimit::apply(&[limit], &mut state, 1e-3, &FoldSettings::default());
        let zero = |v: &V4| *v == V4::default();
        assert!(state.velocity.iter().chain(&state.displacement).all(zero));
    }
}
