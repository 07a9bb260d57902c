//! Sheets and a laboratory for tests of the explicit solver.

use super::halo::HaloExchange;
use super::{
    ContactPlane, PatchModel, PatchState, Pin, Recovery, StableSheet, StepSpec, Substep, V4,
    VertexPlanes,
};
use crate::live::Sheet;
use crate::settings::SolverSettings;
use tryon_garment::{Bending, IsotropicSolid, Material};
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;

/// Recovery at 1 m/s.
pub(super) const RECOVERY: Recovery = Recovery {
    share: 0.2,
    speed: 1.0,
};

/// Longest stable step of a sheet at the usual lookahead (s).
pub(super) fn stable_step(sheet: &Sheet, filter_degree: usize) -> f64 {
    StableSheet::stable_steps(sheet, 0.25, &SolverSettings::default())(filter_degree)
}

/// An isotropic sheet without air drag: 0.18 kg/m², 1000 N/m, Poisson 0.25.
pub(super) fn cotton(bending: f64) -> Material {
    let solid = IsotropicSolid {
        young: 1000.0 / 3e-4,
        poisson: 0.25,
        density: 0.18 / 3e-4,
    };
    let mut m = Material::isotropic("test", solid, 3e-4, "test");
    (m.bending, m.damping) = (Bending::uniform(bending), 0.0);
    m
}

/// Positions, faces and flat corners of a sheet.
pub(super) type Mesh = (Vec<V3d>, Vec<Face>, Vec<[[f64; 2]; 3]>);

/// `nx` × `ny` cells of `dx` × `dy` metres in the x–z plane.
pub(super) fn grid(nx: usize, ny: usize, dx: f64, dy: f64) -> Mesh {
    let at = |i: usize, j: usize| (j * (nx + 1) + i) as u32;
    let flat = |v: u32| {
        [
            (v as usize % (nx + 1)) as f64 * dx,
            (v as usize / (nx + 1)) as f64 * dy,
        ]
    };
    let mut faces = Vec::new();
    for j in 0..ny {
        for i in 0..nx {
            // Diagonals alternate, so that no direction is favoured.
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend(if (i + j) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
    }
    let rest = faces.iter().map(|f| f.map(flat)).collect();
    let x = (0..((nx + 1) * (ny + 1)) as u32)
        .map(|v| V3d::new(flat(v)[0], 0.0, flat(v)[1]))
        .collect();
    (x, faces, rest)
}

pub(super) fn sheet(faces: &[Face], rest: &[[[f64; 2]; 3]], n: usize, m: &Material) -> Sheet {
    Sheet::new(n, faces, rest, m, None).expect("a sheet")
}

/// Out-of-plane waves of 6 mm.
pub(super) fn crumpled(x: &[V3d]) -> Vec<V3d> {
    let wave = |p: &V3d| 0.006 * (p.x * 190.0).sin() * (p.z * 170.0).cos();
    x.iter().map(|p| p + V3d::new(0.0, wave(p), 0.0)).collect()
}

/// Largest distance between two arrays of vertices (m).
pub(super) fn distance(a: &[V3d], b: &[V3d]) -> f64 {
    let all = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    all.fold(0.0, f64::max)
}

/// A sheet in patches, run by substeps.
pub(super) struct Lab {
    pub(super) bending_interval: usize,
    pub(super) sheet: Sheet,
    pub(super) stable: StableSheet,
    pub(super) models: Vec<PatchModel>,
    pub(super) states: Vec<PatchState>,
    pub(super) h: f64,
    pub(super) gravity: V4,
}

impl Lab {
    pub(super) fn new(sheet: Sheet, x: &[V3d], h: f64, patches: usize) -> Self {
        Self::with_filter(sheet, x, h, patches, 2)
    }
    pub(super) fn with_filter(
        sheet: Sheet,
        x: &[V3d],
        h: f64,
        patches: usize,
        filter_degree: usize,
    ) -> Self {
        let bending_interval = StableSheet::bending_interval(&sheet, h, &SolverSettings::default());
        let spec = StepSpec {
            h,
            lookahead: 0.25,
            bending_interval,
            filter_degree,
        };
        let stable = StableSheet::new(&sheet, &spec, &SolverSettings::default());
        let models = stable.compile_patches(patches, 8 * (1 + filter_degree) + 8, 0);
        let mut lab = Self {
            bending_interval,
            sheet,
            stable,
            models,
            states: Vec::new(),
            h,
            gravity: V4::new(0.0, -9.81, 0.0),
        };
        lab.place(x, &vec![V3d::zeros(); x.len()]);
        lab
    }
    pub(super) fn place(&mut self, x: &[V3d], v: &[V3d]) {
        self.states
            .resize_with(self.models.len(), PatchState::default);
        for (m, f) in self.states.iter_mut().zip(&self.models) {
            let all = || f.vertices.iter().map(|i| *i as usize);
            m.reset(all().map(|i| x[i].into()), all().map(|i| v[i].into()));
        }
    }
    fn gather(&self, of: impl Fn(&PatchState, usize) -> V4) -> Vec<V3d> {
        let mut out = vec![V3d::zeros(); self.sheet.mass.len()];
        for (f, m) in self.models.iter().zip(&self.states) {
            for i in 0..f.owned {
                out[f.vertices[i] as usize] = of(m, i).to_f64();
            }
        }
        out
    }
    pub(super) fn positions(&self) -> Vec<V3d> {
        self.gather(PatchState::position)
    }
    pub(super) fn velocities(&self) -> Vec<V3d> {
        self.gather(|m, i| m.velocity[i])
    }
    /// `n` substeps with some vertices held where they are.
    pub(super) fn run(&mut self, n: usize, held: &[u32]) {
        self.run_on(n, held, &[]);
    }
    /// The same on planes, whose vertices are those of the one patch.
    pub(super) fn run_on(&mut self, n: usize, held: &[u32], planes: &[ContactPlane]) {
        let states = self.models.iter().zip(&self.states);
        let pins: Vec<Vec<Pin>> = states.map(|(f, m)| hold(f, m, held)).collect();
        let mut done = 0;
        while done < n {
            let block = 8.min(n - done);
            for (k, pins) in pins.iter().enumerate() {
                self.run_block(k, block, pins, planes);
            }
            let halo = HaloExchange::new(self.models.len());
            for (p, (f, m)) in self.models.iter().zip(&self.states).enumerate() {
                halo.publish(0, p, f, m);
            }
            for (f, m) in self.models.iter().zip(&mut self.states) {
                halo.receive(0, f, m);
            }
            done += block;
        }
    }
    fn run_block(&mut self, patch: usize, block: usize, pins: &[Pin], planes: &[ContactPlane]) {
        let (f, m, h) = (&self.models[patch], &mut self.states[patch], self.h as f32);
        let step = Substep {
            h,
            t: 0.0,
            lookahead: 0.25,
            gravity: self.gravity,
            rings: usize::MAX,
        };
        let planes = VertexPlanes::new(&[], planes);
        for s in 0..block {
            if s % self.bending_interval == 0 {
                let kept = self.bending_interval.min(block - s) as f32;
                m.update_bending(f, h * kept * 0.5, usize::MAX);
            }
            m.integrate_velocities(f, &step, &planes, pins);
            m.resolve_contacts(&planes, [0.0, h], [RECOVERY; 2]);
            m.apply_pins(pins, 0.0, h);
            m.integrate_positions(f, &step, f32::INFINITY);
        }
    }
    /// Elastic, kinetic and potential energy (J).
    pub(super) fn energy(&self) -> f64 {
        let (y, v) = (self.positions(), self.velocities());
        let g = -f64::from(self.gravity.0[1]);
        let of = |i: usize| self.sheet.mass[i] * (0.5 * v[i].norm_squared() + g * y[i].y);
        self.sheet.energy(&y) + (0..y.len()).map(of).sum::<f64>()
    }
}

/// Rigid pins that hold vertices of the sheet where they are.
pub(super) fn hold(f: &PatchModel, m: &PatchState, held: &[u32]) -> Vec<Pin> {
    let all = f.vertices.iter().enumerate();
    all.filter(|(_, v)| held.contains(v))
        .map(|(i, _)| Pin {
            vertex: i as u32,
            target: m.position(i),
            velocity: V4::default(),
            stiffness: 1.0,
        })
        .collect()
}
