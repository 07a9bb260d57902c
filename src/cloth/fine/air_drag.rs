//! Drag of still air on triangles: normal to each, by the square of the normal component of its velocity.
//!
//! In a step of h seconds, with d = n·Δx the mean displacement of the corners along the triangle's normal at the step's
//! begin, the energy ⅓ k A |d|³/h² has the force k A |v| v along the normal at v = d/h, k = ½ ρ C. It is convex.

use super::energy_term::EnergyElements;
use crate::elastic::SheetMotion;
use crate::settings::AirSettings;
use nalgebra::Matrix3;
use tryon_geometry::math::{ElementEnergy, V3d};
use tryon_geometry::mesh::Face;

/// Air on the triangles of a sheet.
#[derive(Clone, Debug)]
pub struct AirDrag {
    faces: Vec<Face>,
    /// ½ ρ C (kg/m³).
    coefficient: f64,
}

/// Displacement of one triangle against the air.
struct Draught {
    normal: V3d,
    /// d (m).
    along: f64,
    /// k A/h² (kg/(m s²)).
    scale: f64,
}

impl AirDrag {
    /// Drag on these triangles.
    pub fn new(faces: Vec<Face>, settings: &AirSettings) -> Self {
        Self {
            faces,
            coefficient: 0.5 * settings.density * settings.drag,
        }
    }

    /// `None` for a triangle without area, or without a step.
    fn draught(&self, element: usize, at: &SheetMotion<'_>) -> Option<Draught> {
        let corners = |x: &[V3d]| self.faces[element].map(|v| x[v as usize]);
        let ([a, b, c], now) = (corners(at.start), corners(at.now));
        let double = (b - a).cross(&(c - a));
        let normal = double.try_normalize(f64::MIN_POSITIVE)?;
        let moved = (now[0] - a + now[1] - b + now[2] - c) / 3.0;
        let scale = self.coefficient * 0.5 * double.norm() / (at.step * at.step);
        (scale > 0.0).then(|| Draught {
            along: normal.dot(&moved),
            normal,
            scale,
        })
    }
}

impl EnergyElements<3, 9> for AirDrag {
    fn count(&self) -> usize {
        self.faces.len()
    }

    fn vertices(&self, element: usize) -> [u32; 3] {
        self.faces[element]
    }

    fn value(&self, element: usize, at: &SheetMotion<'_>) -> f64 {
        let draught = self.draught(element, at);
        draught.map_or(0.0, |d| d.scale * d.along.abs().powi(3) / 3.0)
    }

    fn expand(&self, element: usize, at: &SheetMotion<'_>) -> ElementEnergy<9> {
        let Some(d) = self.draught(element, at) else {
            return ElementEnergy::default();
        };
        let size = d.along.abs();
        let pull = d.normal * (d.scale * d.along * size / 3.0);
        let block: Matrix3<f64> = d.normal * d.normal.transpose() * (d.scale * 2.0 * size / 9.0);
        ElementEnergy::of_corners(self.value(element, at), |_| pull, |_, _| block)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastic::{BendLaw, ClothModel, ElasticFabric, RestSheet, StretchLaw, Stretching};
    use crate::fine::{
        ElasticTerm, ElementTerm, EnergyTerm, FrameTargets, MotionState, OfflineCloth,
        OfflineSettings, OfflineSolver, OfflineState,
    };
    use nalgebra::{DMatrix, Vector2};
    use std::ops::ControlFlow;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};
    use tryon_geometry::par::Par;

    #[test]
    fn forces_are_derivatives_of_the_energy() {
        let start = [[0.0, 0.0, 0.0], [0.02, 0.0, 0.001], [0.0, 0.03, 0.0]].map(V3d::from);
        let evaluate = |x: &[f64], weight: f64| {
            let now: Vec<V3d> = x.chunks(3).map(V3d::from_column_slice).collect();
            let air = AirSettings {
                drag: 1e3 * weight,
                ..AirSettings::default()
            };
            let at = SheetMotion {
                step: 0.01,
                ..SheetMotion::moved(&start, &now)
            };
            let e = AirDrag::new(vec![[0, 1, 2]], &air).expand(0, &at);
            Derivatives::energy(e.value, e.gradient.as_slice().to_vec())
                .with_hessian(DMatrix::from_column_slice(9, 9, e.hessian.as_slice()))
        };
        let moved = |d: f64| {
            start
                .iter()
                .flat_map(|p| [p.x, p.y, p.z + d])
                .collect::<Vec<_>>()
        };
        let check = DerivativeCheck {
            step: 1e-6,
            ..DerivativeCheck::default()
        };
        check.run(&[moved(0.01), moved(-0.02)], evaluate);
        check.run_degenerate(&[moved(0.0)], evaluate);
    }

    /// A sheet that falls flat reaches m g = k A v² in the closed form v = v₀ tanh(g t/v₀).
    #[test]
    fn a_falling_sheet_has_its_closed_form() {
        const DENSITY: f64 = 0.1;
        let corners = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]].map(Vector2::from);
        let faces = vec![[0, 1, 2], [0, 2, 3]];
        let rest = RestSheet::flat(faces.clone(), &corners).expect("a sheet");
        let fabric = ElasticFabric {
            area_density: DENSITY,
            stretch: StretchLaw::Linear(Stretching::isotropic(500.0, 0.2)),
            bend: BendLaw::isotropic(1e-4, 0.0),
        };
        let model = ClothModel::new(&rest, 4, fabric).expect("a model");
        let (mass, air) = (model.masses().to_vec(), AirSettings::default());
        let terms: Vec<Box<dyn EnergyTerm>> = vec![
            Box::new(ElasticTerm::new(model)),
            Box::new(ElementTerm::new(AirDrag::new(faces.clone(), &air))),
        ];
        let gravity = V3d::new(0.0, -9.81, 0.0);
        let cloth = OfflineCloth::new(mass, faces, gravity, terms).expect("cloth");
        let x: Vec<V3d> = corners.iter().map(|p| V3d::new(p.x, 0.0, p.y)).collect();
        let state = OfflineState {
            now: MotionState {
                v: vec![V3d::zeros(); 4],
                x,
            },
            ..OfflineState::default()
        };
        let settings = OfflineSettings {
            contact: None,
            sleep: None,
            error_rate: 1e-4,
            ..OfflineSettings::default()
        };
        let mut solver =
            OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
        solver
            .animate(
                1.0 / 60.0,
                1..=60,
                |_| FrameTargets::default(),
                |_, _| ControlFlow::Continue(()),
            )
            .expect("frames");
        let speed = -solver.state().now.v[0].y;
        let k = 0.5 * air.density * air.drag;
        let terminal = (DENSITY * 9.81 / k).sqrt();
        let expected = terminal * (9.81 / terminal).tanh();
        assert!((speed / expected - 1.0).abs() < 0.01, "{speed} {expected}");
    }
}
