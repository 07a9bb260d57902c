//! A sheet by implicit Euler or BDF2, with positions projected out of solids.

use super::quasi_newton::{Hold, QuasiNewton, hold_unit};
use crate::live::integrators::{
    Environment, Method, RunConfig, SheetStart, Solver, SolverReport, check_finite,
};
use crate::live::{ClothError, Sheet};
use tryon_geometry::linear::SymbolicFactor;
use tryon_geometry::math::V3d;

/// Stiffness of pins in units of the matrix diagonal: exact to a thousandth of a step's motion. Larger ruins the condition.
const PIN_STIFFNESS: f64 = 1e3;
/// Stiffness of contacts in units of the matrix diagonal. Larger stops sliding; smaller penetrates between iterations.
const CONTACT_STIFFNESS: f64 = 2.0;
/// Substeps a frame when none are asked for.
const DEFAULT_SUBSTEPS: usize = 8;

/// Positions (m) and velocities (m/s).
type Kinematics = (Vec<V3d>, Vec<V3d>);

/// A sheet by a prefactorised quasi-Newton iteration.
pub(in crate::live::integrators) struct ImplicitSolver<'a> {
    sheet: &'a Sheet,
    config: RunConfig,
    substeps: usize,
    rate: f64,
    iteration: QuasiNewton,
    /// Typical stiffness of each vertex (N/m).
    unit: Vec<f64>,
    x: Vec<V3d>,
    v: Vec<V3d>,
    /// One substep earlier, for BDF2.
    earlier: Option<Kinematics>,
}

/// Implicit Euler step that a substep is equivalent to.
struct EulerStep {
    h: f64,
    /// Positions (m) and velocities (m/s) that it starts from.
    from: Kinematics,
    /// Positions under inertia and gravity alone (m).
    inertial: Vec<V3d>,
}

impl<'a> ImplicitSolver<'a> {
    pub(in crate::live::integrators) fn new(
        start: SheetStart<'a>,
        config: &RunConfig,
        rate: f64,
    ) -> Result<Self, ClothError> {
        let sheet = start.sheet;
        let substeps = match config.substeps {
            0 => DEFAULT_SUBSTEPS,
            given => given,
        };
        let symbolic = SymbolicFactor::new(sheet.pattern.clone())?;
        let h = 1.0 / (rate * substeps as f64);
        Ok(Self {
            sheet,
            config: *config,
            substeps,
            rate,
            iteration: QuasiNewton::new(symbolic),
            unit: hold_unit(sheet, h),
            x: start.positions.iter().map(|p| p.coords.cast()).collect(),
            v: vec![V3d::zeros(); start.positions.len()],
            earlier: None,
        })
    }
    /// BDF2: 3x − 4x₋₁ + x₋₂ = 2h v, and the same for v, is an implicit Euler step of 2h/3 from an extrapolation.
    fn euler_step(&self, h: f64, gravity: &V3d) -> EulerStep {
        let extrapolate = |now: &[V3d], before: &[V3d]| {
            let all = now.iter().zip(before);
            all.map(|(x, x0)| (x * 4.0 - x0) / 3.0).collect()
        };
        let second_order = self.config.method == Method::QuasiNewtonBdf2;
        let (h, from): (f64, Kinematics) = match &self.earlier {
            Some((x0, v0)) if second_order => (
                h * 2.0 / 3.0,
                (extrapolate(&self.x, x0), extrapolate(&self.v, v0)),
            ),
            _ => (h, (self.x.clone(), self.v.clone())),
        };
        let inertial = |(x, v): (&V3d, &V3d)| x + v * h + gravity * (h * h);
        EulerStep {
            inertial: from.0.iter().zip(&from.1).map(inertial).collect(),
            h,
            from,
        }
    }
    /// One substep of `h` that ends at `t`.
    fn substep(&mut self, environment: &Environment<'_>, t: f64, h: f64) -> Result<(), ClothError> {
        let sweeps = environment.sweeps(t, h);
        let step = self.euler_step(h, &environment.gravity);
        let before = std::mem::replace(&mut self.x, step.inertial.clone());
        let inertial = &step.inertial;
        let outside = |i: usize, x| environment.project(&sweeps, &before[i], &inertial[i], x);
        let pins: Vec<(usize, V3d)> = environment.pin_targets(t).collect();
        let mut stiffness = vec![0.0; self.x.len()];
        for (i, k) in stiffness.iter_mut().enumerate() {
            if environment.touches(&sweeps, &inertial[i]) {
                *k = CONTACT_STIFFNESS * self.unit[i];
            }
        }
        for (i, _) in &pins {
            stiffness[*i] = PIN_STIFFNESS * self.unit[*i];
        }
        self.iteration.prepare(self.sheet, step.h, &stiffness)?;
        let mut holds = Vec::with_capacity(self.x.len());
        for _ in 0..self.config.iterations.max(1) {
            holds.clear();
            holds.extend(stiffness.iter().enumerate().map(|(i, k)| Hold {
                target: if *k > 0.0 {
                    outside(i, self.x[i])
                } else {
                    self.x[i]
                },
                stiffness: *k,
            }));
            for (i, target) in &pins {
                holds[*i].target = *target;
            }
            self.iteration
                .iterate(self.sheet, inertial, &holds, &mut self.x);
        }
        check_finite(self.x.iter().map(|p| [p.x, p.y, p.z]))?;
        for (i, x) in self.x.iter_mut().enumerate() {
            *x = outside(i, *x);
        }
        for (i, target) in pins {
            self.x[i] = target;
        }
        let all = self.x.iter().zip(&step.from.0);
        let velocity = all.map(|(x, from)| (x - from) / step.h).collect();
        let old = std::mem::replace(&mut self.v, velocity);
        self.earlier = Some((before, old));
        Ok(())
    }
}

impl Solver for ImplicitSolver<'_> {
    fn advance(&mut self, environment: &Environment<'_>, index: usize) -> Result<f64, ClothError> {
        let h = 1.0 / (self.rate * self.substeps as f64);
        for s in 0..self.substeps {
            let t = ((index - 1) * self.substeps + s + 1) as f64 * h;
            self.substep(environment, t, h)?;
        }
        Ok(index as f64 / self.rate)
    }
    fn state(&self) -> (Vec<V3d>, Vec<V3d>) {
        (self.x.clone(), self.v.clone())
    }
    fn report(&self) -> SolverReport {
        SolverReport {
            substeps: self.substeps,
            iterations: self.config.iterations.max(1),
            factorisations: self.iteration.factorisations,
            ..SolverReport::default()
        }
    }
}
