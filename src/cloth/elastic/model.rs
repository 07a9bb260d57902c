//! Elastic model of a sheet: masses, elements, energy and its second-order expansion.

use super::curvature_set::CurvatureSet;
use super::edges::interior_edges;
use super::element_set::{CHUNK, ElementSet};
use super::packed::Packed;
use super::{
    ElasticError, ElasticExpansion, ElasticFabric, MembraneElement, RestSheet, RestTriangle,
    SheetMotion,
};
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::edges;
use tryon_geometry::par::{Par, map_into};

/// Elastic sheet on a fixed mesh. Positions are in metres, shape `[vertices]`, energies in joules.
#[derive(Clone, Debug)]
pub struct ClothModel {
    fabric: ElasticFabric,
    masses: Vec<f64>,
    pairs: Vec<[u32; 2]>,
    membranes: Vec<MembraneElement>,
    membrane_set: ElementSet,
    curvatures: CurvatureSet,
}

impl ClothModel {
    /// Model of a sheet of `vertices` vertices, of which those in no face have no mass.
    ///
    /// # Errors
    /// Names the face, edge or fabric value at fault.
    pub fn new(
        rest: &RestSheet,
        vertices: usize,
        fabric: ElasticFabric,
    ) -> Result<Self, ElasticError> {
        fabric.check()?;
        let triangles = rest.triangles(vertices)?;
        let hinges = interior_edges(&rest.faces);
        let mut curvatures = CurvatureSet::new(rest, &triangles, &hinges, &fabric.bend.at_rest());
        let mut pairs = edges(&rest.faces);
        pairs.extend(curvatures.pairs());
        pairs.sort_unstable();
        pairs.dedup();
        curvatures.list(vertices, &pairs);
        Ok(Self {
            masses: lumped_masses(&rest.faces, &triangles, vertices, fabric.area_density),
            membrane_set: ElementSet::new(rest.faces.clone(), vertices, &pairs),
            curvatures,
            membranes: triangles
                .into_iter()
                .map(|rest| MembraneElement { rest })
                .collect(),
            fabric,
            pairs,
        })
    }
    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.masses.len()
    }
    /// Lumped masses (kg), shape `[vertices]`: a third of each triangle's at each corner.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }
    /// Pairs i < j of vertices that share an element, sorted: the off-diagonal blocks of every Hessian.
    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs
    }
    /// Constitutive laws.
    pub fn fabric(&self) -> &ElasticFabric {
        &self.fabric
    }
    /// Membrane elements, shape `[faces]`.
    pub fn membranes(&self) -> &[MembraneElement] {
        &self.membranes
    }
    /// Elastic energy (J) at `x`, the same bits at any number of threads.
    pub fn energy(&self, par: Par, x: &[V3d]) -> f64 {
        self.moved_energy(par, &SheetMotion::still(x))
    }
    /// Energy (J) after a motion, in which no angle jumps by a turn.
    pub fn moved_energy(&self, par: Par, at: &SheetMotion<'_>) -> f64 {
        let x = at.now;
        let mut values = Vec::new();
        map_into(par, self.membranes.len(), CHUNK, &mut values, |k| {
            if at.is_asleep(self.membrane_set.vertices(k)) {
                return 0.0;
            }
            self.membranes[k].value(&self.fabric.stretch, &self.membrane_set.corners(k, x))
        });
        let stretch = values.iter().sum::<f64>();
        stretch + self.curvatures.energy(&self.fabric.bend, par, at)
    }
    /// Energy, gradient and positive semi-definite Hessian at `x`, the same bits at any number of threads.
    pub fn expand(&self, par: Par, x: &[V3d], out: &mut ElasticExpansion) {
        self.moved_expansion(par, &SheetMotion::still(x), out);
    }
    /// The same after a motion, in which no angle jumps by a turn.
    pub fn moved_expansion(&self, par: Par, at: &SheetMotion<'_>, out: &mut ElasticExpansion) {
        let x = at.now;
        out.reset(self.vertex_count(), self.pairs.len());
        let mut buffers = std::mem::take(&mut out.buffers);
        self.membrane_set
            .assemble(par, &mut buffers.membranes, out, |k| {
                if at.is_asleep(self.membrane_set.vertices(k)) {
                    return Packed::default();
                }
                let at = self.membrane_set.corners(k, x);
                Packed::new(&self.membranes[k].expand(&self.fabric.stretch, &at))
            });
        let (law, buffer) = (&self.fabric.bend, &mut buffers.curvatures);
        self.curvatures.assemble(law, par, at, buffer, out);
        out.buffers = buffers;
    }
}

/// A third of the mass of each triangle at each of its corners (kg).
fn lumped_masses(
    faces: &[[u32; 3]],
    triangles: &[RestTriangle],
    vertices: usize,
    density: f64,
) -> Vec<f64> {
    let mut masses = vec![0.0; vertices];
    for (f, t) in faces.iter().zip(triangles) {
        for &v in f {
            masses[v as usize] += density * t.area / 3.0;
        }
    }
    masses
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastic::{BendLaw, StretchLaw, Stretching};
    use nalgebra::{DMatrix, Vector2};
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};
    use tryon_geometry::par::with_threads;

    fn fabric() -> ElasticFabric {
        ElasticFabric {
            area_density: 0.2,
            stretch: StretchLaw::Linear(Stretching::isotropic(500.0, 0.3)),
            bend: BendLaw::isotropic(1e-3, 0.3),
        }
    }

    /// Grid of n × n quads with alternating diagonals, and a wavy state of it.
    fn sheet(n: u32) -> (RestSheet, Vec<V3d>) {
        let at = |k: u32| Vector2::new(f64::from(k % (n + 1)), f64::from(k / (n + 1))) * 0.1;
        let rest: Vec<_> = (0..(n + 1) * (n + 1)).map(at).collect();
        let mut faces = Vec::new();
        for k in (0..n * n).map(|q| q / n * (n + 1) + q % n) {
            let [a, b, c, d] = [k, k + 1, k + n + 2, k + n + 1];
            if k % 2 == 0 {
                faces.extend([[a, b, c], [a, c, d]]);
            } else {
                faces.extend([[a, b, d], [b, c, d]]);
            }
        }
        let state = rest
            .iter()
            .map(|p| {
                V3d::new(
                    1.05 * p.x,
                    0.03 * (30.0 * p.x + 11.0 * p.y).sin(),
                    0.95 * p.y,
                )
            })
            .collect();
        (RestSheet::flat(faces, &rest).expect("faces"), state)
    }

    /// A triangle in its plane, its first edge along u.
    fn laid_flat([a, b, c]: [V3d; 3]) -> [Vector2<f64>; 3] {
        let (e, d) = (b - a, c - a);
        let u = e.normalize();
        let v = e.cross(&d).normalize().cross(&u);
        [
            Vector2::zeros(),
            Vector2::new(u.dot(&e), v.dot(&e)),
            Vector2::new(u.dot(&d), v.dot(&d)),
        ]
    }

    fn dense(model: &ClothModel, e: &ElasticExpansion) -> DMatrix<f64> {
        let n = model.vertex_count();
        let mut h = DMatrix::zeros(3 * n, 3 * n);
        for (i, d) in e.diagonal.iter().enumerate() {
            h.fixed_view_mut::<3, 3>(3 * i, 3 * i).copy_from(d);
        }
        for (&[i, j], b) in model.pairs().iter().zip(&e.off_diagonal) {
            let (i, j) = (3 * i as usize, 3 * j as usize);
            h.fixed_view_mut::<3, 3>(i, j).copy_from(b);
            h.fixed_view_mut::<3, 3>(j, i).copy_from(&b.transpose());
        }
        h
    }

    fn expanded(model: &ClothModel, x: &[V3d]) -> ElasticExpansion {
        let mut e = ElasticExpansion::default();
        model.expand(Par::Seq, x, &mut e);
        e
    }

    fn stacked(x: &[V3d]) -> Vec<f64> {
        x.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
    }

    #[test]
    fn sums_are_the_derivatives_of_the_energy() {
        let (rest, state) = sheet(2);
        let model = ClothModel::new(&rest, state.len(), fabric()).expect("valid");
        let evaluate = |x: &[f64], weight: f64| {
            let x: Vec<V3d> = x.chunks(3).map(V3d::from_column_slice).collect();
            let e = expanded(&model, &x);
            assert!((model.energy(Par::Seq, &x) - e.value).abs() <= 1e-14 * e.value);
            let gradient = stacked(&e.gradient)
                .into_iter()
                .map(|g| weight * g)
                .collect();
            (
                Derivatives::energy(weight * e.value, gradient),
                dense(&model, &e) * weight,
            )
        };
        let check = DerivativeCheck {
            step: 1e-6,
            ..DerivativeCheck::default()
        };
        check.run(&[stacked(&state)], |x, w| evaluate(x, w).0);
        // In tension and flat nothing is projected: the Hessian is the derivative of the gradient.
        let stretched = |p: &V3d| V3d::new(p.x, 0.0, 1.1 * p.z);
        let flat: Vec<V3d> = state.iter().map(stretched).collect();
        check.run(&[stacked(&flat)], |x, w| {
            let (energy, hessian) = evaluate(x, w);
            energy.with_hessian(hessian)
        });
    }

    #[test]
    fn expansion_has_the_same_bits_at_any_thread_count() {
        let (rest, state) = sheet(30);
        let model = ClothModel::new(&rest, state.len(), fabric());
        let model = model.expect("valid");
        let run = |par| {
            let mut e = ElasticExpansion::default();
            for _ in 0..2 {
                model.expand(par, &state, &mut e);
            }
            (
                model.energy(par, &state),
                e.value,
                e.gradient,
                e.diagonal,
                e.off_diagonal,
            )
        };
        let one = run(Par::Seq);
        for threads in [1, 2, 5] {
            let got = with_threads(threads, || run(Par::Rayon)).expect("pool");
            assert!(got == one, "{threads} threads");
        }
    }

    /// Closed surfaces whose vertices have three and four neighbours: angles of rest, also around a cone.
    #[test]
    fn folded_rest_shapes_are_at_rest() {
        let tetrahedron = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let octahedron = vec![
            [0, 1, 4],
            [1, 2, 4],
            [2, 3, 4],
            [3, 0, 4],
            [1, 0, 5],
            [2, 1, 5],
            [3, 2, 5],
            [0, 3, 5],
        ];
        let (x, y, z) = (V3d::x(), V3d::y(), V3d::z());
        for (faces, at) in [
            (tetrahedron, vec![V3d::zeros(), x, y, z]),
            (octahedron, vec![x, y, -x, -y, z, -z]),
        ] {
            let rest = RestSheet {
                corners: faces
                    .iter()
                    .map(|f| laid_flat(f.map(|v| at[v as usize])))
                    .collect(),
                faces,
                folded: Some(at.clone()),
            };
            let model = ClothModel::new(&rest, at.len(), fabric()).expect("valid");
            let e = expanded(&model, &at);
            assert!(e.value < 1e-25, "{}", e.value);
            assert!(e.gradient.iter().all(|g| g.norm() < 1e-10));
            // Squeezed, it resists with the derivative of its energy.
            let squeezed: Vec<V3d> = at.iter().map(|p| V3d::new(p.x, p.y, 0.8 * p.z)).collect();
            assert!(expanded(&model, &squeezed).value > 0.1);
            let check = DerivativeCheck {
                step: 1e-6,
                ..DerivativeCheck::default()
            };
            check.run(&[stacked(&squeezed)], |x, weight| {
                let x: Vec<V3d> = x.chunks(3).map(V3d::from_column_slice).collect();
                let e = expanded(&model, &x);
                let gradient = stacked(&e.gradient)
                    .into_iter()
                    .map(|g| weight * g)
                    .collect();
                Derivatives::energy(weight * e.value, gradient)
            });
        }
    }

    #[test]
    fn masses_sum_to_that_of_the_sheet_and_faults_are_named() {
        let (rest, state) = sheet(4);
        let model = ClothModel::new(&rest, state.len(), fabric());
        let total: f64 = model.expect("valid").masses().iter().sum();
        assert!((total - 0.2 * 0.16).abs() < 1e-12);
        let fault = |rest: &RestSheet, fabric| {
            ClothModel::new(rest, 25, fabric)
                .map(|_| ())
                .expect_err("fault")
        };
        let mut flat = rest.clone();
        flat.corners[3] = [Vector2::zeros(); 3];
        assert!(matches!(
            fault(&flat, fabric()),
            ElasticError::Area { face: 3, .. }
        ));
        let mut twice = rest.clone();
        twice.faces[1] = twice.faces[0];
        let seam = ClothModel::new(&twice, 25, fabric());
        assert!(seam.is_ok(), "a seam of three panels is no hinge");
        let mut light = fabric();
        light.area_density = 0.0;
        assert!(matches!(fault(&rest, light), ElasticError::Fabric { .. }));
    }
}
