//! A sheet by explicit substeps.

use super::self_collision::{FoldContacts, SelfCollision};
use super::solid_contacts::{RECOVERY_SPEED, SolidContacts, moving_pins};
use crate::live::ClothError;
use crate::live::integrators::{
    Environment, RunConfig, SheetStart, Solver, SolverReport, check_finite,
};
use crate::live::solver::explicit::PatchModel;
use crate::live::solver::explicit::V4;
use crate::live::solver::explicit::run_substeps;
use crate::live::solver::explicit::{ContactPlane, Pin};
use crate::live::solver::explicit::{PatchState, Substep};
use crate::live::solver::explicit::{StableSheet, StepSpec};
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Largest recovery speed of cloth in cloth, where a solid may be in the way (m/s).
const CLOTH_RECOVERY_SPEED: f32 = 0.3;
/// Stable step above which a sheet needs no mass filter (s). Larger filters coarse sheets visibly; smaller spends time on
/// invisible waves.
const UNFILTERED_STEP: f64 = 1.0 / 4200.0;

/// A sheet in patches.
pub(in super::super) struct ExplicitSolver {
    stable: StableSheet,
    models: Vec<PatchModel>,
    patches: Vec<SheetPatch>,
    self_collision: Option<SelfCollision>,
    schedule: SubstepSchedule,
    rate: f64,
    x: Vec<V4>,
    velocity: Vec<V4>,
    fold_contacts: usize,
}

/// Lengths and intervals of substeps.
struct SubstepSchedule {
    substeps: usize,
    h: f64,
    bending_interval: usize,
    contact_interval: usize,
    filter_degree: usize,
    lookahead: f64,
    gravity: V4,
}

/// Substeps between two queries for other folds.
#[derive(Clone, Copy)]
struct SubstepRange {
    /// Begin of the frame (s).
    frame_begin: f64,
    /// First substep, since the frame began.
    first: usize,
    count: usize,
}

/// State and constraints of one patch.
#[derive(Default)]
struct SheetPatch {
    state: PatchState,
    pinned: Vec<(u32, V3d)>,
    pins: Vec<Pin>,
    solids: SolidContacts,
    folds: FoldContacts,
    /// Planes of solids, then of folds.
    planes: Vec<ContactPlane>,
    solid_planes: usize,
}

impl ExplicitSolver {
    pub(in super::super) fn new(
        start: SheetStart<'_>,
        environment: &Environment<'_>,
        config: &RunConfig,
        rate: f64,
    ) -> Result<Self, ClothError> {
        let schedule = SubstepSchedule::new(start, environment, config, 1.0 / rate);
        let spec = StepSpec {
            h: schedule.h,
            lookahead: config.lookahead,
            springs_only: false,
            bending_interval: schedule.bending_interval,
            filter_degree: schedule.filter_degree,
        };
        let stable = StableSheet::new(start.sheet, &spec);
        // A substep spreads information by one ring and one more for each filter degree; bending adds one. Exchanging
        // halos after every substep costs less than more ghosts.
        let rings = 1 + schedule.filter_degree + 1;
        let models = stable.compile_patches(config.patches, rings, 0);
        let patch = |f: &PatchModel| SheetPatch {
            pinned: environment.pins_among(&f.vertices),
            ..SheetPatch::default()
        };
        let interval = schedule.contact_interval;
        Ok(Self {
            patches: models.iter().map(patch).collect(),
            self_collision: config
                .self_collision
                .then(|| SelfCollision::new(start, config, interval, schedule.h))
                .transpose()?,
            stable,
            models,
            schedule,
            rate,
            x: start
                .positions
                .iter()
                .map(|p| V4::new(p.x, p.y, p.z))
                .collect(),
            velocity: vec![V4::default(); start.positions.len()],
            fold_contacts: 0,
        })
    }
    fn run(&mut self, par: Par, environment: &Environment<'_>, range: SubstepRange) {
        let (models, schedule) = (&self.models, &self.schedule);
        let (x, velocity) = (&self.x, &self.velocity);
        let self_collision = self.self_collision.as_ref();
        let patches = &mut self.patches;
        run_substeps(par, models, patches, range.count, |s, k, p| {
            let f = &models[k];
            if s == 0 {
                let all = || f.vertices.iter().map(|v| *v as usize);
                p.state
                    .reset(all().map(|v| x[v]), all().map(|v| velocity[v]));
                if let Some(folds) = self_collision {
                    folds.find(f, &p.pinned, &mut p.folds);
                }
            }
            if s % schedule.contact_interval == 0 {
                p.find_constraints(schedule, environment, range, s);
            }
            p.substep(f, schedule, s, range.count);
        });
        for (p, f) in self.patches.iter().zip(&self.models) {
            for (i, v) in f.vertices[..f.owned].iter().enumerate() {
                self.x[*v as usize] = p.state.position(i);
                self.velocity[*v as usize] = p.state.velocity[i];
            }
        }
        if let Some(f) = &mut self.self_collision {
            f.planes = self.patches.iter().map(|p| p.folds.planes.len()).sum();
        }
        let touching = self.patches.iter().map(|p| p.folds.touching).sum();
        self.fold_contacts = self.fold_contacts.max(touching);
    }
}

impl SubstepSchedule {
    fn new(
        start: SheetStart<'_>,
        environment: &Environment<'_>,
        config: &RunConfig,
        dt: f64,
    ) -> Self {
        let (sheet, lookahead) = (start.sheet, config.lookahead);
        let given = |degree| (degree, StableSheet::stable_step(sheet, lookahead, degree));
        let (filter_degree, step) = match config.filter_degree {
            Some(degree) => given(degree),
            // Filtered accelerations move vertices that other folds have stopped: folds under pressure diverge.
            None if config.self_collision => given(0),
            None => StableSheet::choose_filter(sheet, lookahead, UNFILTERED_STEP),
        };
        let substeps = match config.substeps {
            0 => (dt / step).ceil() as usize,
            given => given,
        };
        let h = dt / substeps as f64;
        let bending_interval = match config.bending_interval {
            0 => StableSheet::bending_interval(sheet, h),
            given => given,
        };
        // Contact queries coincide with evaluations of bending.
        let evaluations = config.contact_interval.max(1).div_ceil(bending_interval);
        Self {
            substeps,
            h,
            bending_interval,
            contact_interval: bending_interval * evaluations,
            filter_degree,
            lookahead,
            gravity: environment.gravity.into(),
        }
    }
}

impl AsMut<PatchState> for SheetPatch {
    fn as_mut(&mut self) -> &mut PatchState {
        &mut self.state
    }
}

impl SheetPatch {
    /// Finds planes and pins at substep `s` of a range.
    fn find_constraints(
        &mut self,
        schedule: &SubstepSchedule,
        environment: &Environment<'_>,
        range: SubstepRange,
        s: usize,
    ) {
        let span = schedule.contact_interval.min(range.count - s) as f64 * schedule.h;
        let now = range.frame_begin + (range.first + s) as f64 * schedule.h;
        self.solids
            .find(environment, &self.state, (now, span), &mut self.planes);
        self.solid_planes = self.planes.len();
        let since = s as f32 * schedule.h as f32;
        self.state
            .find_reachable(&self.folds.planes, since, span as f32, &mut self.planes);
        // Planes of folds date from substep 0, times from now.
        for p in &mut self.planes[self.solid_planes..] {
            p.offset += p.normal.dot(p.velocity) * since;
        }
        moving_pins(environment, &self.pinned, (now, span), &mut self.pins);
    }
    fn substep(&mut self, f: &PatchModel, schedule: &SubstepSchedule, s: usize, count: usize) {
        let h = schedule.h as f32;
        if s.is_multiple_of(schedule.bending_interval) {
            let kept = schedule.bending_interval.min(count - s) as f32;
            self.state
                .update_bending(f, h * kept * 0.5, schedule.filter_degree);
        }
        let t = (s % schedule.contact_interval) as f32 * h;
        let step = Substep {
            h,
            t,
            lookahead: schedule.lookahead as f32,
            gravity: schedule.gravity,
            rings: 0,
        };
        self.state
            .integrate_velocities(f, &step, &self.planes, &self.pins);
        // Solids after folds: the last constraint wins.
        let (solids, folds) = self.planes.split_at(self.solid_planes);
        self.state
            .resolve_contacts(folds, t, h, CLOTH_RECOVERY_SPEED);
        self.state.resolve_contacts(solids, t, h, RECOVERY_SPEED);
        self.state.apply_pins(&self.pins, t, h);
        self.state.integrate_positions(f, &step, f32::INFINITY);
    }
}

impl Solver for ExplicitSolver {
    fn advance(&mut self, environment: &Environment<'_>, index: usize) -> Result<f64, ClothError> {
        let dt = 1.0 / self.rate;
        let par = if self.models.len() > 1 {
            Par::Rayon
        } else {
            Par::Seq
        };
        let substeps = self.schedule.substeps;
        let mut done = 0;
        while done < substeps {
            let folds = self.self_collision.as_mut();
            let next = folds.map_or(substeps, |f| f.update(par, &self.x, &self.velocity));
            let range = SubstepRange {
                frame_begin: (index - 1) as f64 * dt,
                first: done,
                count: next.min(substeps - done),
            };
            self.run(par, environment, range);
            done += range.count;
        }
        check_finite(self.x.iter().map(|p| p.0.map(f64::from)))?;
        Ok(index as f64 * dt)
    }
    fn state(&self) -> (Vec<V3d>, Vec<V3d>) {
        let f64s = |all: &[V4]| all.iter().map(|v| v.to_f64()).collect();
        (f64s(&self.x), f64s(&self.velocity))
    }
    fn report(&self) -> SolverReport {
        SolverReport {
            substeps: self.schedule.substeps,
            iterations: 1,
            softened: self.stable.kept_stiffness,
            soft_elements: self.stable.soft_elements,
            fold_contacts: self.fold_contacts,
            fold_searches_skipped: self.patches.iter().map(|p| p.folds.skipped).sum(),
            ..SolverReport::default()
        }
    }
}
