//! Solvers that are kept to be compared with: XPBD with small steps, and the paper's implicit mass-spring step.

use super::run::{Method, RunConfig, RunReport, deepest};
use super::small::{RECOVERY, look, v3d, v4};
use super::{Scene, SceneError};
use crate::cloth::ClothError;
use crate::cloth::solver::explicit::edge_stiffness::triangle_springs;
use crate::cloth::solver::explicit::{
    PatchModel, PatchState, Pin, StableSheet, StepSpec, Substep, V4,
};
use crate::linear::conjugate_gradient;
use crate::math::{P3, V3d};
use nalgebra::{Matrix3, Point3, Vector3};
use std::ops::ControlFlow;
use std::time::Instant;

/// Steps a frame when none are asked for.
const USUAL_SUBSTEPS: [usize; 2] = [40, 8];
/// XPBD: steps from one evaluation of bending to the next.
const BEND_EVERY: usize = 4;
/// Relative residual and most products of the linear solve.
const SOLVE: (f64, usize) = (1e-3, 60);

pub(super) fn run(
    scene: &Scene,
    config: &RunConfig,
    mut frame: impl FnMut(usize, &[P3]) -> ControlFlow<()>,
) -> Result<RunReport, SceneError> {
    let springs = config.method == Method::MassSpring;
    let n = scene.start.len();
    let dt = 1.0 / scene.rate;
    let steps = if config.substeps == 0 {
        USUAL_SUBSTEPS[usize::from(springs)]
    } else {
        config.substeps
    };
    let h = dt / steps as f64;
    let bend_every = if config.every[0] == 0 {
        BEND_EVERY
    } else {
        config.every[0]
    };
    // A plan for a step so short that nothing is softened: both are stable at any step.
    let fit = StepSpec {
        h: 1e-9,
        lookahead: 0.0,
        springs_only: springs,
        bending_interval: bend_every,
        filter_degree: 0,
    };
    let plan = StableSheet::new(&scene.sheet, &fit);
    let fabrics = plan.compile_patches(1, 0, 0);
    let Some(f) = fabrics.first() else {
        return Err(ClothError::Count {
            what: "vertices",
            got: 0,
            expected: 1,
        }
        .into());
    };
    let mut solver = if springs {
        Solver::Springs(Springs::new(scene, f))
    } else {
        Solver::Xpbd(blocks(scene, f, h))
    };
    let pins: Vec<(u32, u32)> = {
        let local = f.vertices.iter().enumerate();
        local
            .filter(|(_, v)| scene.pins.contains(v))
            .map(|(i, v)| (i as u32, *v))
            .collect()
    };
    let local: Vec<V3d> = scene
        .start
        .iter()
        .map(|p| {
            let p: V3d = p.coords.cast();
            scene.pinned_to.map_or(p, |c| {
                (scene.colliders[c].placement(0.0).inverse() * Point3::from(p)).coords
            })
        })
        .collect();
    let mut weight: Vec<f32> = f
        .vertices
        .iter()
        .map(|v| (1.0 / scene.sheet.mass[*v as usize]) as f32)
        .collect();
    pins.iter().for_each(|(i, _)| weight[*i as usize] = 0.0);
    let mut m = PatchState::default();
    let mut x: Vec<V4> = f
        .vertices
        .iter()
        .map(|v| v4(&scene.start[*v as usize].coords.cast()))
        .collect();
    let mut velocity = vec![V4::default(); n];
    let (mut planes, mut ties, mut aim) = (Vec::new(), Vec::<Pin>::new(), Vec::new());
    let mut clear = Vec::new();
    let gravity = v4(&scene.gravity);
    let hf = h as f32;
    let mut flow = frame(0, &scene.start);
    let (mut finished, mut times, mut penetration) = (1, Vec::new(), 0.0f64);
    for index in 1..scene.frames() {
        if flow.is_break() {
            break;
        }
        let started = Instant::now();
        m.reset(x.iter().copied(), velocity.iter().copied());
        for s in 0..steps {
            let t = (index - 1) as f64 * dt + s as f64 * h;
            look(scene, config.offset, &m, t, h, &mut planes, &mut clear);
            ties.clear();
            for &(i, p) in &pins {
                let at = |t: f64| {
                    scene.pinned_to.map_or(local[p as usize], |c| {
                        (scene.colliders[c].placement(t) * Point3::from(local[p as usize])).coords
                    })
                };
                ties.push(Pin {
                    vertex: i,
                    target: v4(&at(t)),
                    velocity: v4(&((at(t + h) - at(t)) / h)),
                    stiffness: 1.0,
                });
            }
            match &mut solver {
                Solver::Xpbd(blocks) => {
                    if s % bend_every == 0 {
                        m.update_bending(f, hf * bend_every as f32 * 0.5, 0);
                    }
                    m.integrate_external(f, hf, gravity);
                    m.apply_pins(&ties, 0.0, hf);
                    aim.clear();
                    aim.extend((0..n).map(|i| m.position(i) + m.velocity[i].scale(hf)));
                    for b in blocks.iter() {
                        project(b, &weight, &mut aim);
                    }
                    for i in 0..n {
                        m.velocity[i] = (aim[i] - m.position(i)).scale(1.0 / hf);
                    }
                }
                Solver::Springs(springs) => springs.step(&mut m, &ties, h, &scene.gravity),
            }
            m.resolve_contacts(&planes, 0.0, hf, RECOVERY);
            m.apply_pins(&ties, 0.0, hf);
            m.integrate_positions(
                f,
                &Substep {
                    h: hf,
                    ..Substep::default()
                },
                f32::INFINITY,
            );
        }
        for i in 0..n {
            x[i] = m.position(i);
        }
        velocity.clone_from(&m.velocity);
        times.push(started.elapsed().as_secs_f64() * 1e3);
        if let Some(index) = x.iter().position(|p| !p.0.iter().all(|c| c.is_finite())) {
            return Err(ClothError::NotFinite {
                what: "cloth vertex",
                index,
            }
            .into());
        }
        let ordered = in_order(f, &x);
        penetration = deepest(scene, index as f64 * dt, &ordered).max(penetration);
        let shown: Vec<P3> = ordered.iter().map(|p| P3::from(p.cast::<f32>())).collect();
        flow = frame(index, &shown);
        finished += 1;
    }
    let report = RunReport::of(scene, times, &in_order(f, &x), &in_order(f, &velocity));
    Ok(RunReport {
        frames: finished,
        substeps: steps,
        iterations: 1,
        penetration,
        softened: 1.0,
        ..report
    })
}

fn in_order(f: &PatchModel, x: &[V4]) -> Vec<V3d> {
    let mut out = vec![V3d::zeros(); x.len()];
    f.vertices
        .iter()
        .zip(x)
        .for_each(|(v, p)| out[*v as usize] = v3d(*p));
    out
}

enum Solver {
    Xpbd(Vec<Block>),
    Springs(Springs),
}

/// A triangle for XPBD: lengths of its edges and their compliance over h² (the inverse of their stiffness).
struct Block {
    v: [u32; 3],
    rest: [f32; 3],
    compliance: Matrix3<f32>,
}

fn blocks(scene: &Scene, f: &PatchModel, h: f64) -> Vec<Block> {
    let mut local = vec![0u32; scene.start.len()];
    f.vertices
        .iter()
        .enumerate()
        .for_each(|(i, v)| local[*v as usize] = i as u32);
    triangle_springs(&scene.sheet)
        .into_iter()
        .filter_map(|s| {
            let (v, rest) = (s.v, s.rest);
            let compliance = (s.stiffness.try_inverse()? / (h * h)).cast();
            Some(Block {
                v: v.map(|v| local[v as usize]),
                rest: rest.map(|l| l as f32),
                compliance,
            })
        })
        .collect()
}

/// Macklin et al. 2016, eq. 18, for the three edges of a triangle together; λ starts at zero in each small step.
#[inline]
fn project(b: &Block, weight: &[f32], x: &mut [V4]) {
    let v = b.v.map(|v| v as usize);
    let w = v.map(|v| weight[v]);
    let mut along = [V4::default(); 3];
    let mut c = Vector3::zeros();
    for k in 0..3 {
        let d = x[v[(k + 2) % 3]] - x[v[(k + 1) % 3]];
        let l = d.dot(d).sqrt().max(f32::MIN_POSITIVE);
        along[k] = d.scale(1.0 / l);
        c[k] = l - b.rest[k];
    }
    let mut a = b.compliance;
    for k in 0..3 {
        a[(k, k)] += w[(k + 1) % 3] + w[(k + 2) % 3];
        // Edges k and j = k + 1 meet in corner k + 2, the first one's end and the second one's start.
        let j = (k + 1) % 3;
        let shared = -w[(k + 2) % 3] * along[k].dot(along[j]);
        a[(k, j)] += shared;
        a[(j, k)] += shared;
    }
    let Some(inverse) = a.try_inverse() else {
        return;
    };
    let l = -(inverse * c);
    for k in 0..3 {
        let (p, q) = ((k + 1) % 3, (k + 2) % 3);
        x[v[p]] = x[v[p]] - along[k].scale(l[k] * w[p]);
        x[v[q]] = x[v[q]] + along[k].scale(l[k] * w[q]);
    }
}

/// Springs along edges and between the far corners of hinges, in local numbers: ends, length, stiffness.
struct Springs {
    springs: Vec<([usize; 2], f64, f64)>,
    mass: Vec<f64>,
}

impl Springs {
    fn new(scene: &Scene, f: &PatchModel) -> Self {
        let sheet = &scene.sheet;
        let mut local = vec![0usize; scene.start.len()];
        f.vertices
            .iter()
            .enumerate()
            .for_each(|(i, v)| local[*v as usize] = i);
        let mut stiff = std::collections::BTreeMap::<[u32; 2], f64>::new();
        for s in triangle_springs(sheet) {
            let (v, k) = (s.v, s.stiffness);
            for i in 0..3 {
                let (a, b) = (v[(i + 1) % 3], v[(i + 2) % 3]);
                *stiff.entry([a.min(b), a.max(b)]).or_default() += k[(i, i)];
            }
        }
        let at = |v: u32| local[v as usize];
        let mut springs: Vec<_> = sheet
            .edges
            .iter()
            .map(|(v, l)| {
                let k = stiff
                    .get(&[v[0].min(v[1]), v[0].max(v[1])])
                    .copied()
                    .unwrap_or(0.0);
                ([at(v[0]), at(v[1])], *l, k)
            })
            .collect();
        springs.extend(sheet.hinges.iter().map(|h| {
            let (a, b) = (h.v[2], h.v[3]);
            let l = (scene.start[a as usize] - scene.start[b as usize]).norm();
            ([at(a), at(b)], f64::from(l), h.w)
        }));
        Self {
            springs,
            mass: f.vertices.iter().map(|v| sheet.mass[*v as usize]).collect(),
        }
    }

    /// (M − h²K)Δv = h(f + hKv) (Baraff and Witkin 1998, eq. 6) by conjugate gradients.
    fn step(&self, m: &mut PatchState, ties: &[Pin], h: f64, gravity: &V3d) {
        let n = self.mass.len();
        let x: Vec<V3d> = (0..n).map(|i| v3d(m.position(i))).collect();
        let v: Vec<V3d> = m.velocity.iter().map(|v| v3d(*v)).collect();
        let mut held = vec![false; n];
        ties.iter().for_each(|t| held[t.vertex as usize] = true);
        let mut right: Vec<V3d> = (0..n).map(|i| gravity * (self.mass[i] * h)).collect();
        let mut blocks: Vec<Matrix3<f64>> =
            self.mass.iter().map(|m| Matrix3::identity() * *m).collect();
        let mut terms = Vec::with_capacity(self.springs.len());
        for ([a, b], rest, k) in &self.springs {
            let d = x[*b] - x[*a];
            let l = d.norm().max(f64::MIN_POSITIVE);
            let u = d / l;
            let outer = u * u.transpose();
            // Across a spring under pressure the true stiffness is negative and is left out.
            let j = (outer + (Matrix3::identity() - outer) * (1.0 - rest / l).max(0.0)) * *k;
            let pull = u * (k * (l - rest) * h) + j * (v[*b] - v[*a]) * (h * h);
            right[*a] += pull;
            right[*b] -= pull;
            blocks[*a] += j * (h * h);
            blocks[*b] += j * (h * h);
            terms.push((*a, *b, j * (h * h)));
        }
        for t in ties {
            right[t.vertex as usize] = V3d::zeros();
        }
        let inverse: Vec<Matrix3<f64>> = blocks
            .iter()
            .map(|b| b.try_inverse().unwrap_or_else(Matrix3::identity))
            .collect();
        let mut change = vec![V3d::zeros(); n];
        conjugate_gradient(
            |p, out| {
                for i in 0..n {
                    out[i] = p[i] * self.mass[i];
                }
                for (a, b, j) in &terms {
                    let f = j * (p[*b] - p[*a]);
                    out[*a] -= f;
                    out[*b] += f;
                }
                for i in 0..n {
                    if held[i] {
                        out[i] = p[i] * self.mass[i];
                    }
                }
            },
            &inverse,
            &right,
            &mut change,
            SOLVE.0,
            SOLVE.1,
        );
        for i in 0..n {
            m.velocity[i] = v4(&(v[i] + change[i]));
        }
    }
}
