//! The paper's integrator: springs along edges and across hinges, one linearised implicit Euler step (Baraff and Witkin
//! 1998, eq. 6).

use crate::live::ClothError;
use crate::live::integrators::single_patch::{
    SinglePatchSolver, VelocityUpdate, local_numbers, whole_sheet,
};
use crate::live::integrators::{Environment, RunConfig, SheetStart};
use crate::live::solver::explicit::edge_stiffness::triangle_springs;
use crate::live::solver::explicit::{PatchModel, PatchState, Pin};
use nalgebra::Matrix3;
use std::collections::BTreeMap;
use tryon_geometry::linear::{BlockJacobi, CgAccuracy, StopCriterion, conjugate_gradient};
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Substeps a frame when none are asked for.
const DEFAULT_SUBSTEPS: usize = 8;
/// End of the linear solve. A larger residual is visibly soft, a smaller one changes nothing visible; only the finest
/// meshes reach the number of iterations.
const STOP: StopCriterion = StopCriterion {
    accuracy: CgAccuracy::Residual(1e-3),
    iterations: 60,
};

/// Spring between two vertices in local numbers.
#[derive(Clone, Copy, Debug)]
struct Spring {
    ends: [usize; 2],
    /// Length at rest (m).
    rest: f64,
    /// N/m.
    stiffness: f64,
}

/// Springs along edges and between the opposite corners of hinges.
pub(in crate::live::integrators) struct Springs {
    springs: Vec<Spring>,
    mass: Vec<f64>,
    gravity: V3d,
    h: f64,
}

/// Mass-spring solver of a sheet, at `rate` frames a second.
pub(in crate::live::integrators) fn solver(
    start: SheetStart<'_>,
    environment: &Environment<'_>,
    config: &RunConfig,
    rate: f64,
) -> Result<SinglePatchSolver<Springs>, ClothError> {
    let substeps = match config.substeps {
        0 => DEFAULT_SUBSTEPS,
        given => given,
    };
    let model = whole_sheet(start, true, 1)?;
    let mass = |v: &u32| start.sheet.mass[*v as usize];
    let springs = Springs {
        springs: springs(start, &local_numbers(&model)),
        mass: model.vertices.iter().map(mass).collect(),
        gravity: environment.gravity,
        h: 1.0 / rate / substeps as f64,
    };
    let steps = (substeps, rate);
    Ok(SinglePatchSolver::new(
        start,
        environment,
        model,
        springs,
        steps,
    ))
}

fn springs(start: SheetStart<'_>, local: &[u32]) -> Vec<Spring> {
    let sheet = start.sheet;
    let mut stiffness = BTreeMap::<[u32; 2], f64>::new();
    for t in triangle_springs(sheet) {
        for i in 0..3 {
            let (a, b) = (t.v[(i + 1) % 3], t.v[(i + 2) % 3]);
            *stiffness.entry([a.min(b), a.max(b)]).or_default() += t.stiffness[(i, i)];
        }
    }
    let at = |v: u32| local[v as usize] as usize;
    let along = sheet.edges.iter().map(|(v, rest)| {
        let key = [v[0].min(v[1]), v[0].max(v[1])];
        Spring {
            ends: v.map(at),
            rest: *rest,
            stiffness: stiffness.get(&key).copied().unwrap_or(0.0),
        }
    });
    let across = sheet.hinges.iter().map(|h| {
        let ends = [h.v[2], h.v[3]];
        let [a, b] = ends.map(|v| start.positions[v as usize]);
        Spring {
            ends: ends.map(at),
            rest: f64::from((a - b).norm()),
            stiffness: h.w,
        }
    });
    along.chain(across).collect()
}

/// (M − h²K)Δv = h(f + hKv) of the springs, pinned vertices aside.
struct System {
    right: Vec<V3d>,
    /// Diagonal blocks of the matrix.
    diagonal: Vec<Matrix3<f64>>,
    /// Off-diagonal blocks h²K and their vertices.
    blocks: Vec<([usize; 2], Matrix3<f64>)>,
}

impl Springs {
    fn system(&self, x: &[V3d], v: &[V3d]) -> System {
        let h = self.h;
        let mut system = System {
            right: self.mass.iter().map(|m| self.gravity * (m * h)).collect(),
            diagonal: self.mass.iter().map(|m| Matrix3::identity() * *m).collect(),
            blocks: Vec::with_capacity(self.springs.len()),
        };
        for s in &self.springs {
            let [a, b] = s.ends;
            let d = x[b] - x[a];
            let l = d.norm().max(f64::MIN_POSITIVE);
            let u = d / l;
            let outer = u * u.transpose();
            // Across a compressed spring the true stiffness is negative and is left out.
            let j =
                (outer + (Matrix3::identity() - outer) * (1.0 - s.rest / l).max(0.0)) * s.stiffness;
            let pull = u * (s.stiffness * (l - s.rest) * h) + j * (v[b] - v[a]) * (h * h);
            system.right[a] += pull;
            system.right[b] -= pull;
            system.diagonal[a] += j * (h * h);
            system.diagonal[b] += j * (h * h);
            system.blocks.push(([a, b], j * (h * h)));
        }
        system
    }
}

impl VelocityUpdate for Springs {
    fn update(&mut self, _: &PatchModel, state: &mut PatchState, pins: &[Pin], _: usize) {
        let n = self.mass.len();
        let x: Vec<V3d> = (0..n).map(|i| state.position(i).to_f64()).collect();
        let v: Vec<V3d> = state.velocity.iter().map(|v| v.to_f64()).collect();
        let mut system = self.system(&x, &v);
        let mut held = vec![false; n];
        for pin in pins {
            held[pin.vertex as usize] = true;
            system.right[pin.vertex as usize] = V3d::zeros();
        }
        let inverse = |b: &Matrix3<f64>| b.try_inverse().unwrap_or_else(Matrix3::identity);
        let mut inverse = BlockJacobi::from_inverse(system.diagonal.iter().map(inverse).collect());
        let mut change = vec![V3d::zeros(); n];
        let product = |p: &[V3d], out: &mut [V3d]| {
            for i in 0..n {
                out[i] = p[i] * self.mass[i];
            }
            for ([a, b], j) in &system.blocks {
                let f = j * (p[*b] - p[*a]);
                out[*a] -= f;
                out[*b] += f;
            }
            for i in (0..n).filter(|i| held[*i]) {
                out[i] = p[i] * self.mass[i];
            }
        };
        conjugate_gradient(
            product,
            &mut inverse,
            &system.right,
            &mut change,
            (Par::Seq, STOP),
        );
        for i in 0..n {
            state.velocity[i] = (v[i] + change[i]).into();
        }
    }
}
