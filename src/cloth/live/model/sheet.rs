//! A sheet of cloth as a mechanical system: masses, flat triangles, hinges.

use super::bending::{Hinge, HingeSide, Wing};
use super::membrane::Membrane;
use super::resolution::BendingResolution;
use crate::live::ClothError;
use crate::settings::AirSettings;
use nalgebra::Matrix3x2;
use tryon_garment::{Bending, Material};
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::mesh::{Face, Topology, TriMesh};

/// A flat triangle with its shape gradients: F = Σ xₖ bₖᵀ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Corners.
    pub v: [u32; 3],
    /// Shape gradients [1/m].
    pub b: [[f64; 2]; 3],
    /// Rest area (m²).
    pub area: f64,
}

impl Element {
    /// Element of a triangle with these flat corners (m); a signed area.
    fn new(v: Face, t: &[[f64; 2]; 3]) -> Self {
        let (e1, e2) = (
            [t[1][0] - t[0][0], t[1][1] - t[0][1]],
            [t[2][0] - t[0][0], t[2][1] - t[0][1]],
        );
        let det = e1[0] * e2[1] - e1[1] * e2[0];
        let (b1, b2) = ([e2[1] / det, -e2[0] / det], [-e1[1] / det, e1[0] / det]);
        let b0 = [-b1[0] - b2[0], -b1[1] - b2[1]];
        Self {
            v,
            b: [b0, b1, b2],
            area: 0.5 * det,
        }
    }
    /// Deformation gradient.
    #[inline]
    pub fn gradient(&self, x: &[V3d]) -> Matrix3x2<f64> {
        let [p, q, r] = self.v.map(|i| x[i as usize]);
        let column = |d: usize| p * self.b[0][d] + q * self.b[1][d] + r * self.b[2][d];
        Matrix3x2::from_columns(&[column(0), column(1)])
    }
}

/// Smallest rest area of a triangle, a hundredth of a square millimetre (m²). Smaller ones have no usable gradient.
const SMALLEST_AREA: f64 = 1e-8;
/// Quantile of the reported stretch.
const STRETCH_PERCENTILE: usize = 99;

/// Immutable description of a sheet.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Mass of each vertex (kg).
    pub mass: Vec<f64>,
    /// Triangles.
    pub elements: Vec<Element>,
    /// Hinges.
    pub hinges: Vec<Hinge>,
    /// Membrane stiffness.
    pub membrane: Membrane,
    /// Edges with their rest lengths (m).
    pub edges: Vec<([u32; 2], f64)>,
    /// Damping rate (1/s).
    pub damping: f64,
    /// Drag of the air, ½ ρ C (kg/m³); zero in a vacuum.
    pub air: f64,
    /// Coulomb coefficient.
    pub friction: f64,
}

impl Sheet {
    /// Sheet of a mesh with flat rest triangles. A sheet that is not flat at rest (a cone) gives its 3D rest positions as
    /// `curved_rest`: hinges then keep their bend.
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
        let elements = elements(faces, rest)?;
        let mass = masses(vertices, &elements, material.area_density)?;
        let flat = FlatTriangles { faces, rest };
        let edges: Vec<_> = topology
            .edges()
            .iter()
            .map(|e| {
                let [a, b] = e.v;
                let l = flat.length(e.face, a, b);
                let twin = e.twin.map(|t| flat.length(t, a, b));
                (e.v, twin.map_or(l, |t| 0.5 * (l + t)))
            })
            .collect();
        let hinges = hinges(&topology, &flat, &material.bending, curved_rest);
        Ok(Self {
            mass,
            elements,
            hinges,
            membrane: Membrane::new(material),
            edges,
            damping: material.damping,
            air: 0.0,
            friction: material.friction,
        })
    }
    /// Sheet of a garment in still air, with the bending that its edges carry ([`BendingResolution`]).
    ///
    /// # Errors
    /// As [`Sheet::new`].
    pub fn of_garment(g: &tryon_garment::GarmentMesh) -> Result<Self, ClothError> {
        let (_, carried) = BendingResolution::of_garment(g);
        let mut sheet = Self::new(g.vertices, &g.faces, &g.rest, &carried, None)?;
        let air = AirSettings::default();
        sheet.air = 0.5 * air.density * air.drag;
        Ok(sheet)
    }
    /// Elastic energy (J).
    pub fn energy(&self, x: &[V3d]) -> f64 {
        let membrane = |e: &Element| e.area * self.membrane.value(&e.gradient(x));
        let membrane: f64 = self.elements.iter().map(membrane).sum();
        let bending: f64 = self.hinges.iter().map(|h| h.energy(x)).sum();
        membrane + bending
    }
    /// Adds the derivative of the energy by the positions to `out` (N).
    pub fn add_gradient(&self, x: &[V3d], out: &mut [V3d]) {
        for e in &self.elements {
            let g = self.membrane.gradient(&e.gradient(x)) * e.area;
            let (u, v): (V3d, V3d) = (g.column(0).into(), g.column(1).into());
            for k in 0..3 {
                out[e.v[k] as usize] += u * e.b[k][0] + v * e.b[k][1];
            }
        }
        self.hinges.iter().for_each(|h| h.add_gradient(x, out));
    }
    /// Largest and 99th-percentile stretch of the edges (length over rest length, minus one).
    pub fn strain(&self, x: &[V3d]) -> (f64, f64) {
        let stretch =
            |(v, l): &([u32; 2], f64)| (x[v[0] as usize] - x[v[1] as usize]).norm() / l - 1.0;
        let mut all: Vec<f64> = self.edges.iter().map(stretch).collect();
        [100, STRETCH_PERCENTILE]
            .map(|hundredths| percentile(&mut all, hundredths).unwrap_or(0.0))
            .into()
    }
}

fn elements(faces: &[Face], rest: &[[[f64; 2]; 3]]) -> Result<Vec<Element>, ClothError> {
    let checked = |(face, (f, t)): (usize, (&Face, &[[f64; 2]; 3]))| {
        let e = Element::new(*f, t);
        if e.area > SMALLEST_AREA {
            Ok(e)
        } else {
            Err(ClothError::ZeroArea { face, area: e.area })
        }
    };
    faces.iter().zip(rest).enumerate().map(checked).collect()
}

fn masses(vertices: usize, elements: &[Element], density: f64) -> Result<Vec<f64>, ClothError> {
    let mut mass = vec![0.0; vertices];
    for e in elements {
        for v in e.v {
            mass[v as usize] += e.area * density / 3.0;
        }
    }
    match mass.iter().position(|m| *m <= 0.0) {
        Some(index) => Err(ClothError::Field {
            field: format!("vertex {index}"),
            why: "it belongs to no triangle".into(),
        }),
        None => Ok(mass),
    }
}

/// Faces with their flat corners (m).
struct FlatTriangles<'a> {
    faces: &'a [Face],
    rest: &'a [[[f64; 2]; 3]],
}

impl FlatTriangles<'_> {
    /// Distance of two corners of a face (m).
    fn length(&self, face: u32, a: u32, b: u32) -> f64 {
        let (f, t) = (&self.faces[face as usize], &self.rest[face as usize]);
        let at = |v: u32| f.iter().position(|q| *q == v).map_or([0.0; 2], |k| t[k]);
        let (p, q) = (at(a), at(b));
        (p[0] - q[0]).hypot(p[1] - q[1])
    }
    /// Direction of the edge a b in a face, and the face's area.
    fn side(&self, face: u32, [a, b]: [u32; 2]) -> HingeSide {
        let (f, t) = (&self.faces[face as usize], &self.rest[face as usize]);
        let at = |v: u32| f.iter().position(|q| *q == v).map_or([0.0; 2], |k| t[k]);
        let (p, q) = (at(a), at(b));
        HingeSide {
            edge: [q[0] - p[0], q[1] - p[1]],
            area: Element::new(*f, t).area,
        }
    }
    /// A face on the edge a b.
    fn wing(&self, face: u32, [a, b]: [u32; 2], apex: u32) -> Wing {
        Wing {
            edge: self.length(face, a, b),
            to_apex: [self.length(face, a, apex), self.length(face, b, apex)],
        }
    }
}

fn hinges(
    topology: &Topology,
    flat: &FlatTriangles<'_>,
    bending: &Bending,
    curved_rest: Option<&[P3]>,
) -> Vec<Hinge> {
    let mut hinges = Vec::new();
    for e in topology.edges() {
        let (Some(twin), [Some(c), Some(d)]) = (e.twin, e.opposite) else {
            continue;
        };
        let wings = [flat.wing(e.face, e.v, c), flat.wing(twin, e.v, d)];
        let sides = [e.face, twin].map(|face| flat.side(face, e.v));
        let area = sides[0].area + sides[1].area;
        let rigidity = 0.5 * (sides[0].rigidity(bending) + sides[1].rigidity(bending));
        let mut hinge = Hinge {
            v: [e.v[0], e.v[1], c, d],
            c: Hinge::coefficients(&wings),
            w: rigidity / area,
            rest: 0.0,
        };
        if let Some(p) = curved_rest {
            hinge.rest = hinge.bow(|v| p[v as usize].coords.cast()).norm();
        }
        hinges.push(hinge);
    }
    hinges
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    /// Two triangles on an edge, 2 cm long.
    fn two_triangles(curved_rest: Option<&[P3]>) -> Sheet {
        let faces = [[0, 1, 2], [0, 2, 3]];
        let rest = [
            [[0.0, 0.0], [0.02, 0.0], [0.02, 0.02]],
            [[0.0, 0.0], [0.02, 0.02], [0.0, 0.02]],
        ];
        let cotton = Material::preset("cotton").expect("preset");
        Sheet::new(4, &faces, &rest, &cotton, curved_rest).expect("sheet")
    }

    #[test]
    fn gradient_is_the_derivative_of_the_energy() {
        let folded = [
            [0.0, 0.0, 0.0],
            [2.1, 0.2, 0.4],
            [1.9, 2.1, 0.1],
            [-0.1, 1.8, 0.5],
        ];
        let flat = [
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 2.0, 0.0],
            [0.0, 2.0, 0.0],
        ];
        let points = [folded.concat(), flat.concat()];
        let curved: Vec<P3> = folded
            .iter()
            .map(|p| P3::from(p.map(|c| 0.01 * c as f32)))
            .collect();
        for sheet in [two_triangles(None), two_triangles(Some(&curved))] {
            // Unknowns in centimetres.
            let evaluate = |x: &[f64], weight: f64| {
                let x: Vec<V3d> = x
                    .chunks(3)
                    .map(|p| V3d::from_column_slice(p) * 0.01)
                    .collect();
                let mut gradient = vec![V3d::zeros(); 4];
                sheet.add_gradient(&x, &mut gradient);
                let gradient = gradient
                    .iter()
                    .flat_map(|g| (g * (0.01 * weight)).data.0[0]);
                Derivatives::energy(weight * sheet.energy(&x), gradient.collect())
            };
            DerivativeCheck::default().run(&points[..1], evaluate);
            DerivativeCheck::default().run_degenerate(&points[1..], evaluate);
        }
    }

    #[test]
    fn internal_forces_conserve_linear_and_angular_momentum() {
        let sheet = two_triangles(None);
        let x = [
            [0.0, 0.0, 0.0],
            [0.021, 0.002, 0.004],
            [0.019, 0.021, 0.001],
            [-0.001, 0.018, 0.005],
        ]
        .map(V3d::from);
        let mut g = vec![V3d::zeros(); 4];
        sheet.add_gradient(&x, &mut g);
        assert!(g[0].norm() > 1e-3);
        assert!(g.iter().sum::<V3d>().norm() < 1e-12);
        let moment: V3d = x.iter().zip(&g).map(|(p, g)| p.cross(g)).sum();
        assert!(moment.norm() < 1e-12);
    }

    #[test]
    fn triangle_without_area_is_refused_by_number() {
        let faces = [[0, 1, 2], [0, 2, 3]];
        let rest = [
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]],
            [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]],
        ];
        let silk = Material::preset("silk").expect("preset");
        let e = Sheet::new(4, &faces, &rest, &silk, None).expect_err("flat");
        assert!(matches!(e, ClothError::ZeroArea { face: 1, .. }));
    }
}
