//! A sheet of cloth as a mechanical system: masses, flat triangles, hinges, and the constant matrix of its stiffness.

use super::membrane::Membrane;
use crate::cloth::ClothError;
use crate::garment::Material;
use crate::linear::SymmetricPattern;
use crate::math::{P3, V3d};
use crate::mesh::{Face, Topology, TriMesh};
use nalgebra::Matrix3x2;
use std::sync::Arc;

/// A flat triangle with its shape gradients: F = Σ xₖ bₖᵀ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Corners.
    pub v: [u32; 3],
    /// Shape gradients, 1/m.
    pub b: [[f64; 2]; 3],
    /// Rest area, m².
    pub area: f64,
}

impl Element {
    /// Deformation gradient.
    #[inline]
    pub fn gradient(&self, x: &[V3d]) -> Matrix3x2<f64> {
        let [p, q, r] = self.v.map(|i| x[i as usize]);
        let column = |d: usize| p * self.b[0][d] + q * self.b[1][d] + r * self.b[2][d];
        Matrix3x2::from_columns(&[column(0), column(1)])
    }
}

/// Two triangles on an edge: E = ½ w |Σ cₖ xₖ|², the quadratic bending of Bergou et al. 2006 (flat at rest).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hinge {
    /// Edge ends, then the two opposite corners.
    pub v: [u32; 4],
    /// Coefficients, 1/m⁰ (sum zero).
    pub c: [f64; 4],
    /// Stiffness, N/m.
    pub w: f64,
    /// Length of Σ cₖ xₖ at rest; zero for a flat hinge.
    pub rest: f64,
}

/// Smallest rest area of a triangle, m²: a hundredth of a square millimetre.
const SMALLEST_AREA: f64 = 1e-8;

/// Immutable description of a sheet.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Mass of each vertex, kg.
    pub mass: Vec<f64>,
    /// Triangles.
    pub elements: Vec<Element>,
    /// Hinges.
    pub hinges: Vec<Hinge>,
    /// Membrane stiffness.
    pub membrane: Membrane,
    /// Edges as vertex pairs with rest lengths, metres, for strain reports and springs.
    pub edges: Vec<([u32; 2], f64)>,
    /// Pattern of the system matrix.
    pub pattern: Arc<SymmetricPattern>,
    /// Constant part of the system matrix: stiffness without inertia, N/m, in pattern order.
    pub stiffness: Vec<f64>,
    /// Rate of air drag, 1/s.
    pub damping: f64,
    /// Coulomb coefficient.
    pub friction: f64,
}

impl Sheet {
    /// Builds the system of a mesh with flat rest triangles. `curved_rest` gives 3D rest positions when the sheet is not
    /// flat at rest (a cone): hinges then keep their bend.
    ///
    /// # Errors
    /// [`ClothError::ZeroArea`] names the triangle; topology faults name the edge.
    pub fn new(
        vertices: usize,
        faces: &[Face],
        rest: &[[[f64; 2]; 3]],
        material: &Material,
        curved_rest: Option<&[P3]>,
    ) -> Result<Self, ClothError> {
        material.check()?;
        if rest.len() != faces.len() {
            return Err(ClothError::Count {
                what: "rest triangles",
                got: rest.len(),
                expected: faces.len(),
            });
        }
        let mesh = TriMesh::new(vec![P3::origin(); vertices], faces.to_vec())?;
        let topology = Topology::new(&mesh)?;
        let mut mass = vec![0.0; vertices];
        let mut elements = Vec::with_capacity(faces.len());
        for (face, (f, t)) in faces.iter().zip(rest).enumerate() {
            let (e1, e2) = (
                [t[1][0] - t[0][0], t[1][1] - t[0][1]],
                [t[2][0] - t[0][0], t[2][1] - t[0][1]],
            );
            let det = e1[0] * e2[1] - e1[1] * e2[0];
            let area = 0.5 * det;
            if !(area > SMALLEST_AREA) {
                return Err(ClothError::ZeroArea { face, area });
            }
            let (b1, b2) = ([e2[1] / det, -e2[0] / det], [-e1[1] / det, e1[0] / det]);
            let b0 = [-b1[0] - b2[0], -b1[1] - b2[1]];
            elements.push(Element {
                v: *f,
                b: [b0, b1, b2],
                area,
            });
            for v in f {
                mass[*v as usize] += area * material.area_density / 3.0;
            }
        }
        if let Some(index) = mass.iter().position(|m| *m <= 0.0) {
            return Err(ClothError::Field {
                field: format!("vertex {index}"),
                why: "it belongs to no triangle".into(),
            });
        }
        let length = |face: u32, a: u32, b: u32| {
            let (f, t) = (&faces[face as usize], &rest[face as usize]);
            let at = |v: u32| f.iter().position(|q| *q == v).map_or([0.0; 2], |k| t[k]);
            let (p, q) = (at(a), at(b));
            (p[0] - q[0]).hypot(p[1] - q[1])
        };
        let mut hinges = Vec::new();
        let mut edges = Vec::new();
        for e in topology.edges() {
            let [a, b] = e.v;
            let l0 = length(e.face, a, b);
            let l = e.twin.map_or(l0, |t| 0.5 * (l0 + length(t, a, b)));
            edges.push((e.v, l));
            if let (Some(twin), [Some(c), Some(d)]) = (e.twin, e.opposite) {
                // Cotangents at the edge's ends in both triangles.
                let cot = |face: u32, apex: u32, at: u32, other: u32| {
                    let (pa, po, lo) = (
                        length(face, at, apex),
                        length(face, other, apex),
                        length(face, at, other),
                    );
                    let cos =
                        (pa * pa + lo * lo - po * po) / (2.0 * pa * lo).max(f64::MIN_POSITIVE);
                    cos / (1.0 - cos * cos).max(1e-12).sqrt()
                };
                let (c1, c2) = (cot(e.face, c, a, b), cot(e.face, c, b, a));
                let (c3, c4) = (cot(twin, d, a, b), cot(twin, d, b, a));
                let area = elements[e.face as usize].area + elements[twin as usize].area;
                let c = [c2 + c4, c1 + c3, -c1 - c2, -c3 - c4];
                let v = [a, b, e.opposite[0].unwrap_or(a), e.opposite[1].unwrap_or(a)];
                let at_rest = curved_rest.map_or(0.0, |p| {
                    (0..4)
                        .fold(V3d::zeros(), |s, k| {
                            s + p[v[k] as usize].coords.cast::<f64>() * c[k]
                        })
                        .norm()
                });
                hinges.push(Hinge {
                    v,
                    c,
                    w: 3.0 * material.bending / area,
                    rest: at_rest,
                });
            }
        }
        let pairs = edges
            .iter()
            .map(|(v, _)| (v[0], v[1]))
            .chain(hinges.iter().map(|h| (h.v[2], h.v[3])));
        let pattern = Arc::new(SymmetricPattern::new(vertices, pairs)?);
        let membrane = Membrane::new(material);
        let mut stiffness = vec![0.0; pattern.entries()];
        let mut add = |i: u32, j: u32, w: f64| {
            if let Some(s) = pattern.slot(i, j) {
                stiffness[s] += w;
            }
        };
        let k = membrane.stiffest();
        for e in &elements {
            for i in 0..3 {
                for j in 0..=i {
                    add(
                        e.v[i],
                        e.v[j],
                        e.area * (k[0] * e.b[i][0] * e.b[j][0] + k[1] * e.b[i][1] * e.b[j][1]),
                    );
                }
            }
        }
        for h in &hinges {
            for i in 0..4 {
                for j in 0..=i {
                    add(h.v[i], h.v[j], h.w * h.c[i] * h.c[j]);
                }
            }
        }
        Ok(Self {
            mass,
            elements,
            hinges,
            membrane,
            edges,
            pattern,
            stiffness,
            damping: material.damping,
            friction: material.friction,
        })
    }
    /// A garment's sheet.
    ///
    /// # Errors
    /// As [`Sheet::new`].
    pub fn of_garment(g: &crate::garment::GarmentMesh) -> Result<Self, ClothError> {
        Self::new(g.vertices, &g.faces, &g.rest, &g.material, None)
    }
    /// Elastic energy, J.
    pub fn energy(&self, x: &[V3d]) -> f64 {
        let membrane: f64 = self
            .elements
            .iter()
            .map(|e| e.area * self.membrane.value(&e.gradient(x)))
            .sum();
        let bending: f64 = self
            .hinges
            .iter()
            .map(|h| {
                let q = (0..4).fold(V3d::zeros(), |s, k| s + x[h.v[k] as usize] * h.c[k]);
                0.5 * h.w * (q.norm() - h.rest).powi(2)
            })
            .sum();
        membrane + bending
    }
    /// Adds the derivative of the energy by the positions to `out`, N.
    pub fn add_gradient(&self, x: &[V3d], out: &mut [V3d]) {
        for e in &self.elements {
            let g = self.membrane.gradient(&e.gradient(x)) * e.area;
            let (u, v): (V3d, V3d) = (g.column(0).into(), g.column(1).into());
            for k in 0..3 {
                out[e.v[k] as usize] += u * e.b[k][0] + v * e.b[k][1];
            }
        }
        for h in &self.hinges {
            let mut q = (0..4).fold(V3d::zeros(), |s, k| s + x[h.v[k] as usize] * h.c[k]);
            if h.rest > 0.0 {
                let n = q.norm().max(f64::MIN_POSITIVE);
                q *= 1.0 - h.rest / n;
            }
            for k in 0..4 {
                out[h.v[k] as usize] += q * (h.w * h.c[k]);
            }
        }
    }
    /// Adds the (positive semidefinite) second derivative at `x` times `d` to `out`, N.
    pub fn add_hessian_product(&self, x: &[V3d], d: &[V3d], out: &mut [V3d]) {
        for e in &self.elements {
            let h = self
                .membrane
                .hessian_apply(&e.gradient(x), &e.gradient(d), true)
                * e.area;
            let (u, v): (V3d, V3d) = (h.column(0).into(), h.column(1).into());
            for k in 0..3 {
                out[e.v[k] as usize] += u * e.b[k][0] + v * e.b[k][1];
            }
        }
        for h in &self.hinges {
            let q = (0..4).fold(V3d::zeros(), |s, k| s + d[h.v[k] as usize] * h.c[k]);
            for k in 0..4 {
                out[h.v[k] as usize] += q * (h.w * h.c[k]);
            }
        }
    }
    /// Largest and 99th-percentile stretch of the edges (length over rest length, minus one).
    pub fn strain(&self, x: &[V3d]) -> (f64, f64) {
        let mut all: Vec<f64> = self
            .edges
            .iter()
            .map(|(v, l)| (x[v[0] as usize] - x[v[1] as usize]).norm() / l - 1.0)
            .collect();
        all.sort_unstable_by(f64::total_cmp);
        let at = |q: f64| {
            all.get(((all.len() as f64 * q) as usize).min(all.len().saturating_sub(1)))
                .copied()
        };
        (at(1.0).unwrap_or(0.0), at(0.99).unwrap_or(0.0))
    }
}
