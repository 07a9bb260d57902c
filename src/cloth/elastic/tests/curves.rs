//! Whole sheets against closed forms and measured curves of tension.

use super::statics::Statics;
use super::{
    BendLaw, ClothModel, ElasticExpansion, ElasticFabric, RestSheet, StretchLaw, Stretching,
};
use crate::specimens::strip::{StripMesh, StripPattern, strip};
use nalgebra::Matrix2;
use tryon_formats::fabric_json::read_fabric;
use tryon_formats::shared_data;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

pub(super) const WOVEN: Stretching = Stretching {
    weft: 700.0,
    coupling: 150.0,
    warp: 900.0,
    shear: 60.0,
};

fn fabric(stretch: StretchLaw, rigidity: f64) -> ElasticFabric {
    ElasticFabric {
        area_density: 0.2,
        stretch,
        bend: BendLaw::isotropic(rigidity, 0.0),
    }
}

fn model(s: &StripMesh, fabric: ElasticFabric) -> ClothModel {
    let rest = RestSheet::flat(s.faces.clone(), &s.at).expect("faces");
    ClothModel::new(&rest, s.at.len(), fabric).expect("valid")
}

/// Positions of a strip under a homogeneous deformation of its plane.
fn deformed(s: &StripMesh, f: &Matrix2<f64>) -> Vec<V3d> {
    let at = s.at.iter().map(|p| f * p);
    at.map(|p| V3d::new(p.x, 0.0, p.y)).collect()
}

/// Pulled by its ends, free to contract: P = λ (c₁₁ − c₁₂²/c₂₂) ε of St. Venant–Kirchhoff.
#[test]
fn uniaxial_tension_has_its_closed_form_on_an_unstructured_mesh() {
    let s = strip(0.1, 8, 3, StripPattern::Unstructured(4));
    let model = model(&s, fabric(StretchLaw::Linear(WOVEN), 1e-5));
    let (stretch, last) = (1.15, s.at.len() - s.rows);
    let mut held = vec![[false, true, false]; s.at.len()];
    for (i, h) in held.iter_mut().enumerate() {
        h[0] = i < s.rows || i >= last;
    }
    held[0][2] = true;
    let statics = Statics {
        model: &model,
        gravity: V3d::zeros(),
        held,
        load: vec![V3d::x(); 1], // scale of the tolerance: a newton on a held coordinate
    };
    let mut x = deformed(&s, &Matrix2::new(stretch, 0.0, 0.0, 1.0));
    statics.solve(&mut x);
    let mut e = ElasticExpansion::default();
    model.expand(Par::Seq, &x, &mut e);
    let pull: f64 = e.gradient[last..].iter().map(|g| g.x).sum();
    let width = s.at[s.rows - 1].y - s.at[0].y;
    let strain = 0.5 * (stretch * stretch - 1.0);
    let stiffness = WOVEN.weft - WOVEN.coupling.powi(2) / WOVEN.warp;
    assert!((pull / (width * stretch * stiffness * strain) - 1.0).abs() < 1e-8);
    let contraction = (x[s.rows - 1].z - x[0].z) / width;
    let expected = (1.0 - 2.0 * WOVEN.coupling / WOVEN.warp * strain).sqrt();
    assert!((contraction - expected).abs() < 1e-9);
}

/// Homogeneous state on an unstructured mesh: the energy per area, and forces on the boundary alone.
#[test]
fn biaxial_tension_has_its_closed_form() {
    let s = strip(0.1, 8, 4, StripPattern::Unstructured(5));
    let model = model(&s, fabric(StretchLaw::Linear(WOVEN), 1e-5));
    let area: f64 = model.membranes().iter().map(|m| m.rest.area).sum();
    let (a, b) = (0.5 * (1.1f64.powi(2) - 1.0), 0.5 * (1.05f64.powi(2) - 1.0));
    let density = 350.0 * a * a + 150.0 * a * b + 450.0 * b * b;
    let mut e = ElasticExpansion::default();
    let x = deformed(&s, &Matrix2::new(1.1, 0.0, 0.0, 1.05));
    model.expand(Par::Seq, &x, &mut e);
    assert!((e.value / (area * density) - 1.0).abs() < 1e-10);
    let inside = |i: usize| (1..s.rows - 1).contains(&(i % s.rows));
    let columns = s.rows..s.at.len() - s.rows;
    for i in columns.filter(|&i| inside(i)) {
        assert!(e.gradient[i].norm() < 1e-12, "{i}");
    }
}

/// Measured fabrics pulled along the weft and along the warp between wide clamps, against the data.
#[test]
fn measured_fabrics_pull_with_their_measured_force() {
    /// Green–Lagrange strain of the data's stretched rows, a stretch ratio of 7/6.
    const STRAIN: f64 = 0.5 * (49.0 / 36.0 - 1.0);
    for name in ["11oz-black-denim", "gray-interlock", "white-swim-solid"] {
        let path = format!("materials/wang2011_arcsim_NONCOMMERCIAL/{name}.json");
        let Some(path) = shared_data(path) else {
            return;
        };
        let data = read_fabric(&path).expect("fabric");
        let s = strip(0.1, 8, 4, StripPattern::Unstructured(6));
        let model = model(&s, ElasticFabric::measured(&data));
        let area: f64 = model.membranes().iter().map(|m| m.rest.area).sum();
        // Row of the stretched data and column of its stiffness, along the weft and along the warp.
        for (axis, row, column) in [(0, 1, 0), (1, 5, 2)] {
            for tau in [0.25f64, 0.6, 1.0] {
                let stretch = (1.0 + 2.0 * tau * STRAIN).sqrt();
                let energy = |stretch: f64| {
                    let mut f = Matrix2::identity();
                    f[(axis, axis)] = stretch;
                    model.energy(Par::Seq, &deformed(&s, &f)) / area
                };
                let force = (energy(stretch + 1e-5) - energy(stretch - 1e-5)) / 2e-5;
                let stiffness = |k: usize| data.stretching[k][column];
                let k = stiffness(0) * (1.0 - tau) + stiffness(row) * tau;
                let measured = stretch * k * tau * STRAIN;
                assert!((force / measured - 1.0).abs() < 1e-4, "{name} {axis} {tau}");
            }
        }
    }
}
