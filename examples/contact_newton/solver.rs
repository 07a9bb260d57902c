//! Implicit Euler by Newton's method, conjugate gradients with diagonal blocks, and a line search filtered by CCD.

use crate::barriers::ContactEnergy;
use crate::scene::{Scene, free_share};
use nalgebra::{Matrix3, SVector};
use tryon::cloth::contact::{ActivePair, ContactElement};
use tryon::geometry::math::V3d;

/// Newton steps below this end a time step (m).
const CONVERGED: f64 = 1e-5;
/// Longest Newton step (m): candidates are searched for once an iteration.
const LONGEST: f64 = 4e-3;
/// Newton iterations after which a time step is given up.
const MOST: usize = 200;
/// Squared residual of CG over that of zero, and its iterations at most.
const RESIDUAL: f64 = 1e-8;
const MOST_LINEAR: usize = 2000;
const GRAVITY: f64 = 9.81;

/// Work so far.
pub(crate) struct Report {
    pub(crate) newton: usize,
    /// Most Newton iterations of a step.
    pub(crate) most: usize,
    /// Iterations of CG.
    pub(crate) linear: usize,
    /// Least distance beyond the thickness after a step (m).
    pub(crate) gap: f64,
}

pub(crate) struct Simulation<'a> {
    scene: &'a Scene,
    contact: ContactEnergy,
    step: f64,
    x: Vec<V3d>,
    velocity: Vec<V3d>,
    pub(crate) report: Report,
}

impl<'a> Simulation<'a> {
    pub(crate) fn new(scene: &'a Scene, contact: ContactEnergy, step: f64) -> Self {
        Self {
            scene,
            contact,
            step,
            x: scene.rest.clone(),
            velocity: vec![V3d::zeros(); scene.cloth],
            report: Report {
                newton: 0,
                most: 0,
                linear: 0,
                gap: f64::INFINITY,
            },
        }
    }
    pub(crate) fn step(&mut self) {
        let start = self.x.clone();
        let fall = V3d::y() * (GRAVITY * self.step);
        let moved = |(x, v): (&V3d, &V3d)| x + (v - fall) * self.step;
        let free: Vec<V3d> = start.iter().zip(&self.velocity).map(moved).collect();
        let mut iterations = 1;
        while !self.iterate(&free) && iterations < MOST {
            iterations += 1;
        }
        self.report.newton += iterations;
        self.report.most = self.report.most.max(iterations);
        for (i, v) in self.velocity.iter_mut().enumerate() {
            *v = (self.x[i] - start[i]) / self.step;
        }
        let reach = self.contact.barrier.reach();
        for active in self.scene.candidates(&self.x, reach) {
            let separation = active.pair.separation(&active.pair.corners(&self.x));
            let gap = separation.squared.sqrt() - self.contact.barrier.thickness;
            self.report.gap = self.report.gap.min(gap);
        }
    }
    /// One Newton iteration; true when its step was below the tolerance.
    fn iterate(&mut self, free: &[V3d]) -> bool {
        let reach = self.contact.barrier.reach() + 2.0 * LONGEST;
        let pairs = self.scene.candidates(&self.x, reach);
        let system = self.assemble(free, &pairs);
        let (direction, iterations) = system.solve(self.scene);
        self.report.linear += iterations;
        let longest = direction.iter().fold(0.0, |m: f64, d| m.max(d.norm()));
        if longest < CONVERGED {
            return true;
        }

        let mut motion = direction.clone();
        motion.resize(self.x.len(), V3d::zeros());
        let thickness = self.contact.barrier.thickness;
        let mut share = (LONGEST / longest).min(1.0);
        for active in &pairs {
            share = free_share(&active.pair, &self.x, &motion, thickness, share);
        }
        let before = self.value(&self.x, free, &pairs);
        let slope = dot(&system.gradient, &direction);
        loop {
            let moved = |(x, d): (&V3d, &V3d)| x + d * share;
            let candidate: Vec<V3d> = self.x.iter().zip(&motion).map(moved).collect();
            let falls = self.value(&candidate, free, &pairs) <= before + 1e-4 * share * slope;
            if falls || share < 1e-8 || -slope * share < 1e-12 * before {
                self.x = candidate;
                return false;
            }
            share *= 0.5;
        }
    }
    fn inertia(&self) -> f64 {
        self.scene.vertex_mass / (self.step * self.step)
    }
    fn value(&self, x: &[V3d], free: &[V3d], pairs: &[ActivePair]) -> f64 {
        let moved = x.iter().zip(free).map(|(x, f)| (x - f).norm_squared());
        let mut value = 0.5 * self.inertia() * moved.take(self.scene.cloth).sum::<f64>();
        for s in &self.scene.springs {
            let stretch = (x[s.ends[0]] - x[s.ends[1]]).norm() - s.rest;
            value += 0.5 * s.stiffness * stretch * stretch;
        }
        let contact = |a: &ActivePair| self.contact.value(a, &a.pair.corners(x));
        value + pairs.iter().map(contact).sum::<f64>()
    }
    fn assemble(&self, free: &[V3d], pairs: &[ActivePair]) -> System {
        let (n, inertia) = (self.scene.cloth, self.inertia());
        let mut system = System {
            inertia,
            gradient: (0..n).map(|i| (self.x[i] - free[i]) * inertia).collect(),
            diagonal: vec![Matrix3::identity() * inertia; n],
            springs: Vec::new(),
            contacts: Vec::new(),
        };
        for s in &self.scene.springs {
            let [a, b] = s.ends;
            let d = self.x[a] - self.x[b];
            let (length, u) = (d.norm(), d.normalize());
            let force = u * (s.stiffness * (length - s.rest));
            let along = u * u.transpose();
            let across = (1.0 - s.rest / length).max(0.0);
            let block = (along + (Matrix3::identity() - along) * across) * s.stiffness;
            system.gradient[a] += force;
            system.gradient[b] -= force;
            system.diagonal[a] += block;
            system.diagonal[b] += block;
            system.springs.push(block);
        }
        let reach = self.contact.barrier.reach();
        for active in pairs {
            let corners = active.pair.corners(&self.x);
            if active.pair.separation(&corners).squared < reach * reach {
                system.add(ContactElement {
                    vertices: active.pair.stencil(),
                    energy: self.contact.energy(active, &corners),
                });
            }
        }
        system
    }
}

/// Newton's system: element matrices, and the diagonal blocks of their sum.
struct System {
    inertia: f64,
    gradient: Vec<V3d>,
    diagonal: Vec<Matrix3<f64>>,
    springs: Vec<Matrix3<f64>>,
    contacts: Vec<ContactElement>,
}

fn dot(a: &[V3d], b: &[V3d]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

impl System {
    fn add(&mut self, element: ContactElement) {
        for (k, v) in element.vertices.map(|v| v as usize).into_iter().enumerate() {
            if v < self.gradient.len() {
                self.gradient[v] += element.energy.gradient.fixed_rows::<3>(3 * k);
                self.diagonal[v] += element.energy.hessian.fixed_view::<3, 3>(3 * k, 3 * k);
            }
        }
        self.contacts.push(element);
    }
    fn times(&self, p: &[V3d], scene: &Scene) -> Vec<V3d> {
        let mut q: Vec<V3d> = p.iter().map(|p| p * self.inertia).collect();
        for (s, block) in scene.springs.iter().zip(&self.springs) {
            let force = block * (p[s.ends[0]] - p[s.ends[1]]);
            q[s.ends[0]] += force;
            q[s.ends[1]] -= force;
        }
        for element in &self.contacts {
            let vertices = element.vertices.map(|v| v as usize);
            let own = |v: usize| p.get(v).copied().unwrap_or_else(V3d::zeros);
            let stacked = SVector::<f64, 12>::from_fn(|i, _| own(vertices[i / 3])[i % 3]);
            let force = element.energy.hessian * stacked;
            for (k, v) in vertices.into_iter().enumerate() {
                if let Some(to) = q.get_mut(v) {
                    *to += force.fixed_rows::<3>(3 * k);
                }
            }
        }
        q
    }
    /// Newton's direction and the iterations of CG.
    fn solve(&self, scene: &Scene) -> (Vec<V3d>, usize) {
        let invert = |d: &Matrix3<f64>| d.try_inverse().unwrap_or_else(Matrix3::identity);
        let inverse: Vec<Matrix3<f64>> = self.diagonal.iter().map(invert).collect();
        let precondition =
            |r: &[V3d]| -> Vec<V3d> { r.iter().zip(&inverse).map(|(r, i)| i * r).collect() };
        let mut direction = vec![V3d::zeros(); self.gradient.len()];
        let mut residual: Vec<V3d> = self.gradient.iter().map(|g| -g).collect();
        let mut p = precondition(&residual);
        let mut energy = dot(&residual, &p);
        let enough = RESIDUAL * energy;
        let mut iterations = 0;
        while energy > enough && iterations < MOST_LINEAR {
            iterations += 1;
            let q = self.times(&p, scene);
            let length = energy / dot(&p, &q);
            for i in 0..p.len() {
                direction[i] += p[i] * length;
                residual[i] -= q[i] * length;
            }
            let z = precondition(&residual);
            let next = dot(&residual, &z);
            for i in 0..p.len() {
                p[i] = z[i] + p[i] * (next / energy);
            }
            energy = next;
        }
        (direction, iterations)
    }
}
