//! Time loop of the solvers that update the velocities of a whole sheet at once, before contact.

use super::explicit::{RECOVERY_SPEED, SolidContacts, moving_pins};
use super::{Environment, SheetStart, Solver, SolverReport, check_finite};
use crate::live::ClothError;
use crate::live::solver::explicit::{
    ContactPlane, PatchModel, PatchState, Pin, StableSheet, StepSpec, Substep, V4,
};
use tryon_geometry::math::V3d;

/// Step so short that nothing is softened (s): the update is stable at any step.
const UNSOFTENED_STEP: f64 = 1e-9;

/// Update of the velocities in one substep.
pub(super) trait VelocityUpdate {
    /// Replaces velocities by those after a substep under inner forces and gravity; `pins` hold.
    fn update(&mut self, model: &PatchModel, state: &mut PatchState, pins: &[Pin], s: usize);
}

/// A sheet in one patch.
pub(super) struct SinglePatchSolver<U> {
    model: PatchModel,
    state: PatchState,
    update: U,
    pinned: Vec<(u32, V3d)>,
    pins: Vec<Pin>,
    solids: SolidContacts,
    planes: Vec<ContactPlane>,
    substeps: usize,
    rate: f64,
}

/// The whole sheet as one patch, in local numbers.
pub(super) fn whole_sheet(
    start: SheetStart<'_>,
    springs_only: bool,
    bending_interval: usize,
) -> Result<PatchModel, ClothError> {
    let spec = StepSpec {
        h: UNSOFTENED_STEP,
        lookahead: 0.0,
        springs_only,
        bending_interval,
        filter_degree: 0,
    };
    let patches = StableSheet::new(start.sheet, &spec).compile_patches(1, 0, 0);
    patches.into_iter().next().ok_or(ClothError::Count {
        what: "vertices",
        got: 0,
        expected: 1,
    })
}

/// Local number of each vertex of the sheet.
pub(super) fn local_numbers(model: &PatchModel) -> Vec<u32> {
    let mut local = vec![0; model.vertices.len()];
    for (i, v) in (0u32..).zip(&model.vertices) {
        local[*v as usize] = i;
    }
    local
}

impl<U: VelocityUpdate> SinglePatchSolver<U> {
    pub(super) fn new(
        start: SheetStart<'_>,
        environment: &Environment<'_>,
        model: PatchModel,
        update: U,
        (substeps, rate): (usize, f64),
    ) -> Self {
        let mut state = PatchState::default();
        let position = |v: &u32| start.positions[*v as usize];
        let positions = model.vertices.iter().map(position);
        state.reset(
            positions.map(|p| V4::new(p.x, p.y, p.z)),
            model.vertices.iter().map(|_| V4::default()),
        );
        Self {
            pinned: environment.pins_among(&model.vertices),
            pins: Vec::new(),
            solids: SolidContacts::default(),
            planes: Vec::new(),
            model,
            state,
            update,
            substeps,
            rate,
        }
    }
}

impl<U: VelocityUpdate> Solver for SinglePatchSolver<U> {
    fn advance(&mut self, environment: &Environment<'_>, index: usize) -> Result<f64, ClothError> {
        let dt = 1.0 / self.rate;
        let h = dt / self.substeps as f64;
        let step = Substep {
            h: h as f32,
            ..Substep::default()
        };
        let x: Vec<V4> = (0..self.model.vertices.len())
            .map(|i| self.state.position(i))
            .collect();
        let velocity = std::mem::take(&mut self.state.velocity);
        self.state.reset(x.into_iter(), velocity.into_iter());
        for s in 0..self.substeps {
            let t = (index - 1) as f64 * dt + s as f64 * h;
            self.solids
                .find(environment, &self.state, (t, h), &mut self.planes);
            moving_pins(environment, &self.pinned, (t, h), &mut self.pins);
            self.update
                .update(&self.model, &mut self.state, &self.pins, s);
            self.state
                .resolve_contacts(&self.planes, 0.0, step.h, RECOVERY_SPEED);
            self.state.apply_pins(&self.pins, 0.0, step.h);
            self.state
                .integrate_positions(&self.model, &step, f32::INFINITY);
        }
        let (x, _) = self.state();
        check_finite(x.iter().map(|p| [p.x, p.y, p.z]))?;
        Ok(index as f64 * dt)
    }
    fn state(&self) -> (Vec<V3d>, Vec<V3d>) {
        let n = self.model.vertices.len();
        let (mut x, mut v) = (vec![V3d::zeros(); n], vec![V3d::zeros(); n]);
        for (i, vertex) in self.model.vertices.iter().enumerate() {
            x[*vertex as usize] = self.state.position(i).to_f64();
            v[*vertex as usize] = self.state.velocity[i].to_f64();
        }
        (x, v)
    }
    fn report(&self) -> SolverReport {
        SolverReport {
            substeps: self.substeps,
            iterations: 1,
            softened: 1.0,
            ..SolverReport::default()
        }
    }
}
