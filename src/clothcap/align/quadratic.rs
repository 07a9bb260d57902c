//! Quadratic energy of vertex positions: the coupling, smoothness and data terms of eq. 5, 17, 19 and 20 in one sparse system.
//!
//! x, y and z share one matrix, since every term measures a distance and no direction.

use crate::CaptureError;
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use tryon_geometry::linear::{
    BlockJacobi, CgSettings, Factor, LinearError, SymbolicFactor, SymmetricPattern,
    conjugate_gradient,
};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Csr, Face};

/// Weight of an edge of an even mesh in the Dirichlet energy of a displacement: the cotangent of 60°.
pub(crate) const EVEN_EDGE: f64 = 0.577;

/// Weighted sum of a few vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Stencil {
    /// Vertices.
    pub vertices: Vec<u32>,
    /// Their factors.
    pub factors: Vec<f64>,
    /// Weight of the squared distance from the target.
    pub weight: f64,
}

impl Stencil {
    /// Edge from `b` to `a`.
    pub fn edge([a, b]: [u32; 2], weight: f64) -> Self {
        Self {
            vertices: vec![a, b],
            factors: vec![1.0, -1.0],
            weight,
        }
    }
}

/// Place of the surface that is pulled at.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PullPlace {
    /// A vertex.
    Vertex(u32),
    /// Barycentric coordinates in a face.
    Face(u32, [f32; 3]),
}

/// Pull of one place to a target. At weight 0 its vertices are solved with those that are pulled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pull {
    pub(crate) at: PullPlace,
    pub(crate) weight: f64,
    pub(crate) target: P3,
}

/// Σ w ‖Σ f x − target‖² with a fixed set of stencils and faces.
#[derive(Debug)]
pub struct QuadraticEnergy {
    stencils: Vec<Stencil>,
    faces: Vec<Face>,
    /// Storage of the entries of each stencil, then of each face: lower triangle in the order of pairs (0,0), (1,0), (1,1),
    /// (2,0) …
    slots: Vec<Vec<u32>>,
    pattern: Arc<SymmetricPattern>,
    /// Columns of each row beside its diagonal, and where their values are stored.
    rows: [Csr; 2],
    factor: Factor,
    values: Vec<f64>,
    rhs: Vec<[f64; 3]>,
}

impl QuadraticEnergy {
    /// Analyses the system of `vertices` unknown positions.
    ///
    /// # Errors
    /// A vertex out of range or a system too large.
    pub fn new(
        vertices: usize,
        stencils: Vec<Stencil>,
        faces: &[Face],
    ) -> Result<Self, CaptureError> {
        let own = stencils.iter().map(|s| s.vertices.as_slice());
        let terms: Vec<&[u32]> = own.chain(faces.iter().map(|f| f.as_slice())).collect();
        let mut pairs = Vec::new();
        for all in &terms {
            for (k, &a) in all.iter().enumerate() {
                pairs.extend(all[..k].iter().map(|&b| (a.min(b), a.max(b))));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let pattern = SymmetricPattern::new(vertices, pairs.iter().copied()).map_err(fault)?;
        let pattern = Arc::new(pattern);
        let slots = |all: &&[u32]| {
            let slot = |a: u32, b: u32| pattern.slot(a, b).unwrap_or_default() as u32;
            let row = |k: usize| all[..=k].iter().map(move |b| slot(all[k], *b));
            (0..all.len()).flat_map(row).collect()
        };
        Ok(Self {
            slots: terms.iter().map(slots).collect(),
            faces: faces.to_vec(),
            rows: rows(&pattern, &pairs),
            values: vec![0.0; pattern.entries()],
            rhs: vec![[0.0; 3]; vertices],
            factor: Factor::new(SymbolicFactor::new(pattern.clone()).map_err(fault)?),
            pattern,
            stencils,
        })
    }

    /// Empties the system.
    pub fn reset(&mut self) {
        self.values.fill(0.0);
        self.rhs.fill([0.0; 3]);
    }

    /// Adds a stencil with its target, metres; its weight is multiplied by `scale`.
    pub fn add_stencil(&mut self, index: usize, scale: f64, target: [f64; 3]) {
        let stencil = &self.stencils[index];
        let weight = stencil.weight * scale;
        let (vertices, factors) = (&stencil.vertices, &stencil.factors);
        let mut slots = self.slots[index].iter();
        for (k, (v, f)) in vertices.iter().zip(factors).enumerate() {
            for (g, s) in factors[..=k].iter().zip(&mut slots) {
                self.values[*s as usize] += weight * f * g;
            }
            for (r, t) in self.rhs[*v as usize].iter_mut().zip(target) {
                *r += weight * f * t;
            }
        }
    }

    /// Pulls a point of a face to `target`, metres.
    pub fn add_face_point(&mut self, face: u32, corners: [f32; 3], weight: f64, target: &P3) {
        let factors = corners.map(f64::from);
        let mut slots = self.slots[self.stencils.len() + face as usize].iter();
        for (k, (v, f)) in self.faces[face as usize].iter().zip(factors).enumerate() {
            for (g, s) in factors[..=k].iter().zip(&mut slots) {
                self.values[*s as usize] += weight * f * g;
            }
            for (r, t) in self.rhs[*v as usize].iter_mut().zip(target.iter()) {
                *r += weight * f * f64::from(*t);
            }
        }
    }

    /// Pulls a vertex to `target`, metres.
    pub fn add_vertex(&mut self, vertex: u32, weight: f64, target: &P3) {
        let slot = self.pattern.diagonal_slot(vertex as usize);
        self.values[slot] += weight;
        for (r, t) in self.rhs[vertex as usize].iter_mut().zip(target.iter()) {
            *r += weight * f64::from(*t);
        }
    }

    /// Adds a pull; its vertices, a single one three times.
    pub(crate) fn add_pull(&mut self, pull: &Pull) -> [u32; 3] {
        match pull.at {
            PullPlace::Vertex(v) => {
                self.add_vertex(v, pull.weight, &pull.target);
                [v; 3]
            }
            PullPlace::Face(face, corners) => {
                self.add_face_point(face, corners, pull.weight, &pull.target);
                self.faces[face as usize]
            }
        }
    }

    /// Positions of least energy, metres, shape `[vertices]`.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] if a vertex has no term or the numbers are not finite.
    pub fn minimise(&mut self, stage: &'static str) -> Result<Vec<P3>, CaptureError> {
        let fault = |why: String| CaptureError::solve(stage, why);
        let refactored = self.factor.refactor(&self.values);
        refactored.map_err(|e| fault(e.to_string()))?;
        let mut x = self.rhs.clone();
        self.factor.solve(&mut x);
        let out: Vec<P3> = x.iter().map(|p| P3::from(p.map(|c| c as f32))).collect();
        match out.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            Some(vertex) => Err(fault(format!("vertex {vertex} is not finite"))),
            None => Ok(out),
        }
    }

    /// Moves some vertices of `x` to the positions of least energy, metres, all others held, from where they are.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] if the numbers are not finite.
    pub fn minimise_some(
        &self,
        x: &mut [P3],
        some: &[u32],
        stop: CgSettings,
        stage: &'static str,
    ) -> Result<(), CaptureError> {
        let mut system = self.restricted(x, some);
        let mut inverse = BlockJacobi::from_inverse(std::mem::take(&mut system.inverse));
        let mut moves = vec![Vector3::zeros(); some.len()];
        let apply = |from: &[Vector3<f64>], to: &mut [Vector3<f64>]| system.multiply(from, to);
        conjugate_gradient(apply, &mut inverse, &system.rhs, &mut moves, stop);
        for (v, by) in some.iter().zip(&moves) {
            let moved = x[*v as usize].cast::<f64>() + by;
            if !moved.iter().all(|c| c.is_finite()) {
                let why = format!("vertex {v} is not finite");
                return Err(CaptureError::solve(stage, why));
            }
            x[*v as usize] = moved.cast();
        }
        Ok(())
    }

    /// Equations of the motion of some vertices from `x`, all others held.
    fn restricted(&self, x: &[P3], some: &[u32]) -> RestrictedSystem {
        const HELD: u32 = u32::MAX;
        let mut local = vec![HELD; x.len()];
        for (k, v) in some.iter().enumerate() {
            local[*v as usize] = k as u32;
        }
        let mut out = RestrictedSystem::default();
        for &v in some {
            let v = v as usize;
            let diagonal = self.values[self.pattern.diagonal_slot(v)];
            let mut left = Vector3::from(self.rhs[v]) - x[v].coords.cast() * diagonal;
            let [columns, slots] = self.rows.each_ref().map(|r| r.row(v));
            for (column, slot) in columns.iter().zip(slots) {
                let value = self.values[*slot as usize];
                left -= x[*column as usize].coords.cast() * value;
                if local[*column as usize] != HELD {
                    out.entries.push((local[*column as usize], value));
                }
            }
            out.ends.push(out.entries.len());
            out.diagonal.push(diagonal);
            let inverse = Matrix3::from_diagonal_element(1.0 / diagonal);
            out.inverse.push(inverse);
            out.rhs.push(left);
        }
        out
    }
}

/// Rows and columns of some vertices.
#[derive(Debug, Default)]
struct RestrictedSystem {
    diagonal: Vec<f64>,
    inverse: Vec<Matrix3<f64>>,
    /// Column and value beside the diagonal, row after row.
    entries: Vec<(u32, f64)>,
    /// End of each row in them.
    ends: Vec<usize>,
    rhs: Vec<Vector3<f64>>,
}

impl RestrictedSystem {
    fn multiply(&self, from: &[Vector3<f64>], to: &mut [Vector3<f64>]) {
        let mut first = 0;
        for (row, out) in to.iter_mut().enumerate() {
            let mut sum = from[row] * self.diagonal[row];
            for (column, value) in &self.entries[first..self.ends[row]] {
                sum += from[*column as usize] * *value;
            }
            (*out, first) = (sum, self.ends[row]);
        }
    }
}

/// Columns of each row of a pattern beside its diagonal, and the slots of their values; `pairs` are the entries.
fn rows(pattern: &SymmetricPattern, pairs: &[(u32, u32)]) -> [Csr; 2] {
    let both = pairs.iter().flat_map(|&(a, b)| [(a, b), (b, a)]);
    let columns: Vec<(u32, u32)> = both.filter(|(a, b)| a != b).collect();
    let slot = |&(a, b): &(u32, u32)| (a, pattern.slot(a, b).unwrap_or_default() as u32);
    let slots: Vec<(u32, u32)> = columns.iter().map(slot).collect();
    [columns, slots].map(|all| Csr::from_pairs(pattern.size(), &all))
}

fn fault(e: LinearError) -> CaptureError {
    CaptureError::solve("sparse system", e)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SurfaceFitSettings;

    /// Two triangles; the minimum of a convex quadratic has a vanishing gradient by differences.
    #[test]
    fn minimum_has_no_slope() {
        let faces = [[0, 1, 2], [2, 1, 3]];
        let bend = Stencil {
            vertices: vec![0, 1, 2],
            factors: vec![1.0, -2.0, 1.0],
            weight: 0.4,
        };
        let stencils = vec![Stencil::edge([0, 1], 0.7), Stencil::edge([1, 3], 0.2), bend];
        let targets = [[0.1, 0.0, 0.3], [-0.2, 0.4, 0.0], [0.05; 3]];
        let pulls = [
            (0, [0.2, 0.3, 0.5], 2.0, P3::new(1.0, 2.0, 0.0)),
            (1, [0.0, 0.4, 0.6], 1.5, P3::new(0.0, -1.0, 0.5)),
        ];
        let mut energy = QuadraticEnergy::new(4, stencils.clone(), &faces).expect("in range");
        (0..3).for_each(|k| energy.add_stencil(k, 1.0, targets[k]));
        for (face, corners, weight, target) in &pulls {
            energy.add_face_point(*face, *corners, *weight, target);
        }
        (0..4).for_each(|v| energy.add_vertex(v, 0.05, &P3::origin()));
        let x = energy.minimise("test").expect("definite");
        let value = |x: &[P3]| -> f64 {
            let mut sum = 0.0;
            for (s, t) in stencils.iter().zip(&targets) {
                let terms = s.vertices.iter().zip(&s.factors);
                let at: Vector3<f64> = terms.map(|(v, f)| x[*v as usize].coords.cast() * *f).sum();
                sum += s.weight * (0..3).map(|d| (at[d] - t[d]).powi(2)).sum::<f64>();
            }
            for (face, c, w, t) in &pulls {
                let f: Face = faces[*face as usize];
                let p: Vector3<f32> = (0..3).map(|k| x[f[k] as usize].coords * c[k]).sum();
                sum += w * f64::from((p - t.coords).norm_squared());
            }
            let anchored = x.iter().map(|p| 0.05 * f64::from(p.coords.norm_squared()));
            sum + anchored.sum::<f64>()
        };
        let least = value(&x);
        for (v, d) in (0..12).map(|k| (k / 3, k % 3)) {
            let moved = |by: f32| {
                let mut moved = x.clone();
                moved[v][d] += by;
                value(&moved)
            };
            let slope = (moved(0.01) - moved(-0.01)) / 0.02;
            assert!(slope.abs() < 1e-4 && moved(0.01) > least, "{v} {d}");
        }
    }

    /// Some vertices solved with the others held at the minimum arrive there too.
    #[test]
    fn some_vertices_alone_arrive_at_the_minimum_of_all() {
        let n = 12;
        let edges = (1..n).map(|i| Stencil::edge([i - 1, i], 0.5 + 0.1 * f64::from(i)));
        let mut energy = QuadraticEnergy::new(n as usize, edges.collect(), &[]).expect("in range");
        (0..n as usize - 1).for_each(|k| energy.add_stencil(k, 1.0, [0.01, 0.0, 0.02]));
        for v in [0, 5, 11] {
            energy.add_vertex(v, 0.3, &P3::new(v as f32, 1.0, -1.0));
        }
        let least = energy.minimise("test").expect("definite");
        let (some, stop) = ([2, 3, 4, 8, 9], SurfaceFitSettings::default().stop());
        let mut x = least.clone();
        some.iter().for_each(|v| x[*v as usize].y += 0.5);
        for _ in 0..4 {
            let solved = energy.minimise_some(&mut x, &some, stop, "test");
            solved.expect("solved");
        }
        let off = x.iter().zip(&least).map(|(a, b)| (a - b).norm());
        assert!(off.fold(0.0, f32::max) < 1e-5);
        x[2].y = f32::NAN;
        assert!(energy.minimise_some(&mut x, &some, stop, "test").is_err());
    }

    #[test]
    fn faults_are_named() {
        assert!(QuadraticEnergy::new(2, vec![Stencil::edge([0, 5], 1.0)], &[]).is_err());
        let mut empty = QuadraticEnergy::new(2, Vec::new(), &[]).expect("in range");
        let fault = empty.minimise("test");
        assert!(matches!(
            fault,
            Err(CaptureError::Solve { stage: "test", .. })
        ));
    }
}
