//! A sheet by XPBD, on the edges and bending of the explicit solver.

use crate::live::ClothError;
use crate::live::integrators::single_patch::{
    SinglePatchSolver, VelocityUpdate, local_numbers, whole_sheet,
};
use crate::live::integrators::{Environment, RunConfig, SheetStart};
use crate::live::solver::explicit::edge_stiffness::triangle_springs;
use crate::live::solver::explicit::{PatchModel, PatchState, Pin, V4};
use crate::live::solver::xpbd::TriangleConstraint;

/// Substeps a frame when none are asked for.
const DEFAULT_SUBSTEPS: usize = 40;
/// Substeps between two evaluations of bending when none are asked for.
const DEFAULT_BENDING_INTERVAL: usize = 4;

/// One pass over the triangles a substep.
pub(in crate::live::integrators) struct TrianglePass {
    constraints: Vec<TriangleConstraint>,
    /// Inverse masses, 0 where pinned [1/kg].
    weight: Vec<f32>,
    predicted: Vec<V4>,
    bending_interval: usize,
    gravity: V4,
    h: f32,
}

/// XPBD solver of a sheet, at `rate` frames a second.
pub(in crate::live::integrators) fn solver(
    start: SheetStart<'_>,
    environment: &Environment<'_>,
    config: &RunConfig,
    rate: f64,
) -> Result<SinglePatchSolver<TrianglePass>, ClothError> {
    let or = |given: usize, usual| if given == 0 { usual } else { given };
    let substeps = or(config.substeps, DEFAULT_SUBSTEPS);
    let bending_interval = or(config.bending_interval, DEFAULT_BENDING_INTERVAL);
    let model = whole_sheet(start, false, bending_interval)?;
    let h = 1.0 / rate / substeps as f64;
    let local = local_numbers(&model);
    let constraint = |s: crate::live::solver::explicit::edge_stiffness::TriangleSprings| {
        Some(TriangleConstraint {
            v: s.v.map(|v| local[v as usize]),
            rest: s.rest.map(|l| l as f32),
            compliance: (s.stiffness.try_inverse()? / (h * h)).cast(),
        })
    };
    let springs = triangle_springs(start.sheet).into_iter();
    let inverse = |v: &u32| (1.0 / start.sheet.mass[*v as usize]) as f32;
    let mut weight: Vec<f32> = model.vertices.iter().map(inverse).collect();
    for (i, _) in environment.pins_among(&model.vertices) {
        weight[i as usize] = 0.0;
    }
    let pass = TrianglePass {
        constraints: springs.filter_map(constraint).collect(),
        weight,
        predicted: Vec::new(),
        bending_interval,
        gravity: environment.gravity.into(),
        h: h as f32,
    };
    let steps = (substeps, rate);
    Ok(SinglePatchSolver::new(
        start,
        environment,
        model,
        pass,
        steps,
    ))
}

impl VelocityUpdate for TrianglePass {
    fn update(&mut self, model: &PatchModel, state: &mut PatchState, pins: &[Pin], s: usize) {
        let h = self.h;
        if s.is_multiple_of(self.bending_interval) {
            state.update_bending(model, h * self.bending_interval as f32 * 0.5, 0);
        }
        state.integrate_external(model, h, self.gravity);
        state.apply_pins(pins, 0.0, h);
        let n = model.vertices.len();
        self.predicted.clear();
        self.predicted
            .extend((0..n).map(|i| state.position(i) + state.velocity[i].scale(h)));
        for c in &self.constraints {
            c.project(&self.weight, &mut self.predicted);
        }
        for i in 0..n {
            state.velocity[i] = (self.predicted[i] - state.position(i)).scale(1.0 / h);
        }
    }
}
