//! Cantilevers of cloth under their own weight against the heavy elastica.

use super::statics::Statics;
use super::{BendLaw, ClothModel, ElasticFabric, RestSheet, StretchLaw, Stretching};
use crate::specimens::elastica::bending_length_of;
use crate::specimens::strip::{StripMesh, StripPattern, strip};
use tryon_geometry::math::V3d;

/// Overhang (m), area density (kg/m²) and gravity (m/s²).
const LENGTH: f64 = 0.1;
const DENSITY: f64 = 0.2;
const GRAVITY: f64 = 9.81;

/// Sheet held at its first three columns; u is x, v is z.
fn droop(s: &StripMesh, rigidity: f64, membrane: f64) -> f64 {
    let fabric = ElasticFabric {
        area_density: DENSITY,
        stretch: StretchLaw::Linear(Stretching::isotropic(membrane, 0.0)),
        bend: BendLaw::isotropic(rigidity, 0.0),
    };
    let rest = RestSheet::flat(s.faces.clone(), &s.at).expect("faces");
    let model = ClothModel::new(&rest, s.at.len(), fabric).expect("valid");
    let statics = Statics {
        model: &model,
        gravity: V3d::new(0.0, -GRAVITY, 0.0),
        held: (0..s.at.len()).map(|i| [i < 3 * s.rows; 3]).collect(),
        load: Vec::new(),
    };
    let mut x: Vec<V3d> = s.at.iter().map(|p| V3d::new(p.x, 0.0, p.y)).collect();
    statics.solve(&mut x);
    let tip = &x[x.len() - s.rows..];
    let mean = tip.iter().sum::<V3d>() / tip.len() as f64;
    -mean.y / mean.x
}

/// Relative error of the bending length of a strip 25 mm wide whose bending length is `c` overhangs.
fn error(pattern: StripPattern, columns: usize, c: f64) -> f64 {
    let rows = columns / 4;
    let rigidity = DENSITY * GRAVITY * (c * LENGTH).powi(3);
    let s = strip(LENGTH, columns, rows, pattern);
    bending_length_of(droop(&s, rigidity, 1000.0)) / c - 1.0
}

/// Five patterns; with 8 columns a square is 0.3 of the bending length, and two of them cross the strip.
#[test]
fn curvature_elements_keep_the_bending_length_on_any_mesh() {
    for pattern in [
        StripPattern::Uniform,
        StripPattern::Alternating,
        StripPattern::Staggered,
        StripPattern::Unstructured(1),
        StripPattern::Unstructured(2),
    ] {
        let coarse = error(pattern, 8, 0.5);
        let fine = error(pattern, 16, 0.5);
        assert!(coarse.abs() < 0.011, "{pattern:?}: {coarse}");
        assert!(fine.abs() < 0.003, "{pattern:?}: {fine}");
        let soft = error(pattern, 16, 0.3);
        assert!(soft.abs() < 0.007, "{pattern:?}: {soft}");
    }
}
