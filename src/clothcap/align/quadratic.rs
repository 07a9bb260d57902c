//! Quadratic energy of vertex positions: the coupling, smoothness and data terms of eq. 5, 17, 19 and 20 in one sparse system.
//!
//! x, y and z share one matrix, since every term measures a distance and no direction.

use crate::clothcap::CaptureError;
use crate::linear::{Factor, LinearError, SymbolicFactor, SymmetricPattern};
use crate::math::P3;
use crate::mesh::Face;
use std::sync::Arc;

/// Weight of an edge of an even mesh in the Dirichlet energy of a displacement: the cotangent of 60°.
pub(in crate::clothcap) const EVEN_EDGE: f64 = 0.577;

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
    /// Value at some positions, metres.
    pub fn at(&self, x: &[P3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (v, f) in self.vertices.iter().zip(&self.factors) {
            for (s, c) in sum.iter_mut().zip(x[*v as usize].iter()) {
                *s += f * f64::from(*c);
            }
        }
        sum
    }
}

/// Storage of the entries of one stencil: lower triangle in the order of pairs (0,0), (1,0), (1,1), (2,0) …
type Slots = Vec<u32>;

/// Σ w ‖Σ f x − target‖² with a fixed set of stencils and faces.
#[derive(Debug)]
pub struct QuadraticEnergy {
    stencils: Vec<(Stencil, Slots)>,
    faces: Vec<[u32; 6]>,
    corners: Vec<Face>,
    pattern: Arc<SymmetricPattern>,
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
        let mut pairs = Vec::new();
        let stencil_vertices = stencils.iter().map(|s| s.vertices.as_slice());
        for all in stencil_vertices.chain(faces.iter().map(|f| f.as_slice())) {
            for (k, &a) in all.iter().enumerate() {
                pairs.extend(all[..k].iter().map(|&b| (a, b)));
            }
        }
        let pattern = Arc::new(SymmetricPattern::new(vertices, pairs).map_err(fault)?);
        let slots = |all: &[u32]| -> Slots {
            let mut out = Vec::new();
            for (k, &a) in all.iter().enumerate() {
                let slot = |&b: &u32| pattern.slot(a, b).unwrap_or_default() as u32;
                out.extend(all[..=k].iter().map(slot));
            }
            out
        };
        let face_slots = |f: &Face| -> [u32; 6] {
            let all = slots(f);
            std::array::from_fn(|k| all.get(k).copied().unwrap_or_default())
        };
        Ok(Self {
            faces: faces.iter().map(face_slots).collect(),
            corners: faces.to_vec(),
            stencils: stencils
                .into_iter()
                .map(|s| {
                    let at = slots(&s.vertices);
                    (s, at)
                })
                .collect(),
            values: vec![0.0; pattern.entries()],
            rhs: vec![[0.0; 3]; vertices],
            factor: Factor::new(SymbolicFactor::new(pattern.clone()).map_err(fault)?),
            pattern,
        })
    }

    /// Empties the system.
    pub fn reset(&mut self) {
        self.values.fill(0.0);
        self.rhs.fill([0.0; 3]);
    }

    /// Adds a stencil with its target, metres; its weight is multiplied by `scale`.
    pub fn add_stencil(&mut self, index: usize, scale: f64, target: [f64; 3]) {
        let (stencil, slots) = &self.stencils[index];
        let weight = stencil.weight * scale;
        let mut slot = slots.iter();
        for (k, (v, f)) in stencil.vertices.iter().zip(&stencil.factors).enumerate() {
            for g in &stencil.factors[..=k] {
                if let Some(s) = slot.next() {
                    self.values[*s as usize] += weight * f * g;
                }
            }
            for (r, t) in self.rhs[*v as usize].iter_mut().zip(target) {
                *r += weight * f * t;
            }
        }
    }

    /// Pulls a point of a face to `target`, metres.
    pub fn add_face_point(&mut self, face: u32, corners: [f32; 3], weight: f64, target: &P3) {
        let c = corners.map(f64::from);
        let s = &self.faces[face as usize];
        let mut slot = 0;
        for k in 0..3 {
            for l in 0..=k {
                self.values[s[slot] as usize] += weight * c[k] * c[l];
                slot += 1;
            }
            let rhs = &mut self.rhs[self.corners[face as usize][k] as usize];
            for (r, t) in rhs.iter_mut().zip(target.iter()) {
                *r += weight * c[k] * f64::from(*t);
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

    /// Positions of least energy, metres, shape `[vertices]`.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] if a vertex has no term or the numbers are not finite.
    pub fn minimise(&mut self, stage: &'static str) -> Result<Vec<P3>, CaptureError> {
        let why = |why: String| CaptureError::Solve { stage, why };
        self.factor
            .refactor(&self.values)
            .map_err(|e| why(e.to_string()))?;
        let mut x = self.rhs.clone();
        self.factor.solve(&mut x);
        let out: Vec<P3> = x.iter().map(|p| P3::from(p.map(|c| c as f32))).collect();
        match out.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            Some(vertex) => Err(why(format!("vertex {vertex} is not finite"))),
            None => Ok(out),
        }
    }
}

fn fault(e: LinearError) -> CaptureError {
    CaptureError::Solve {
        stage: "sparse system",
        why: e.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles; the minimum of a convex quadratic has a vanishing gradient by differences.
    #[test]
    fn minimum_has_no_slope() {
        let faces = [[0, 1, 2], [2, 1, 3]];
        let stencils = vec![
            Stencil::edge([0, 1], 0.7),
            Stencil::edge([1, 3], 0.2),
            Stencil {
                vertices: vec![0, 1, 2],
                factors: vec![1.0, -2.0, 1.0],
                weight: 0.4,
            },
        ];
        let targets = [[0.1, 0.0, 0.3], [-0.2, 0.4, 0.0], [0.05; 3]];
        let pulls = [
            (0, [0.2, 0.3, 0.5], 2.0, P3::new(1.0, 2.0, 0.0)),
            (1, [0.0, 0.4, 0.6], 1.5, P3::new(0.0, -1.0, 0.5)),
        ];
        let mut energy = QuadraticEnergy::new(4, stencils.clone(), &faces).expect("in range");
        for (k, t) in targets.iter().enumerate() {
            energy.add_stencil(k, 1.0, *t);
        }
        for (face, corners, weight, target) in &pulls {
            energy.add_face_point(*face, *corners, *weight, target);
        }
        (0..4).for_each(|v| energy.add_vertex(v, 0.05, &P3::origin()));
        let x = energy.minimise("test").expect("definite");
        let value = |x: &[P3]| -> f64 {
            let mut sum = 0.0;
            for (s, t) in stencils.iter().zip(&targets) {
                let at = s.at(x);
                sum += s.weight * (0..3).map(|d| (at[d] - t[d]).powi(2)).sum::<f64>();
            }
            for (face, c, w, t) in &pulls {
                let f: Face = faces[*face as usize];
                let p: nalgebra::Vector3<f32> =
                    (0..3).map(|k| x[f[k] as usize].coords * c[k]).sum();
                sum += w * f64::from((p - t.coords).norm_squared());
            }
            sum + x
                .iter()
                .map(|p| 0.05 * f64::from(p.coords.norm_squared()))
                .sum::<f64>()
        };
        let least = value(&x);
        for v in 0..4 {
            for d in 0..3 {
                let mut moved = x.clone();
                moved[v][d] += 0.01;
                let mut back = x.clone();
                back[v][d] -= 0.01;
                let slope = (value(&moved) - value(&back)) / 0.02;
                assert!(
                    slope.abs() < 1e-4 && value(&moved) > least,
                    "{v} {d}: {slope}"
                );
            }
        }
    }

    #[test]
    fn faults_are_named() {
        assert!(QuadraticEnergy::new(2, vec![Stencil::edge([0, 5], 1.0)], &[]).is_err());
        let mut empty = QuadraticEnergy::new(2, Vec::new(), &[]).expect("in range");
        assert!(matches!(
            empty.minimise("test"),
            Err(CaptureError::Solve { stage: "test", .. })
        ));
    }
}
