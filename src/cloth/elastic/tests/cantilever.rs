//! Cantilevers of cloth under their own weight against the heavy elastica.

use super::statics::Statics;
use super::strips::{StripPattern, TestStrip, strip};
use super::{BendLaw, ClothModel, ElasticFabric, RestSheet, StretchLaw, Stretching};
use tryon_geometry::math::V3d;

/// Overhang (m), area density (kg/m²) and gravity (m/s²).
const LENGTH: f64 = 0.1;
const DENSITY: f64 = 0.2;
const GRAVITY: f64 = 9.81;

/// Tip of a clamped elastica of unit length under its own weight, horizontal at the clamp: (forward, down).
///
/// `c` is the bending length (B/w)^⅓ over the length. With θ down from the horizontal: c³ θ″ = −(1 − s) cos θ, θ(0) = 0,
/// θ′(1) = 0. Integrated by Runge–Kutta, the curvature at the clamp found by bisection.
fn elastica_tip(c: f64) -> [f64; 2] {
    const STEPS: usize = 500;
    let stiffness = c.powi(3);
    let integrate = |curvature: f64| {
        let h = 1.0 / STEPS as f64;
        let slope = |s: f64, y: [f64; 4]| {
            let bend = -(1.0 - s) * y[0].cos() / stiffness;
            [y[1], bend, y[0].cos(), y[0].sin()]
        };
        let mut y = [0.0, curvature, 0.0, 0.0];
        for i in 0..STEPS {
            let s = i as f64 * h;
            let add = |y: [f64; 4], k: [f64; 4], f: f64| std::array::from_fn(|d| y[d] + f * k[d]);
            let k1 = slope(s, y);
            let k2 = slope(s + 0.5 * h, add(y, k1, 0.5 * h));
            let k3 = slope(s + 0.5 * h, add(y, k2, 0.5 * h));
            let k4 = slope(s + h, add(y, k3, h));
            y = std::array::from_fn(|d| y[d] + h / 6.0 * (k1[d] + 2.0 * (k2[d] + k3[d]) + k4[d]));
        }
        y
    };
    // θ′(1) grows with θ′(0); a straight horizontal beam has θ′(0) = 1/(2 c³).
    let (mut low, mut high) = (0.0, 0.6 / stiffness);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if integrate(middle)[1] > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    let y = integrate(low);
    [y[2], y[3]]
}

/// Bending length over the overhang whose elastica has this droop, down over forward.
fn bending_length_of(droop: f64) -> f64 {
    let (mut low, mut high) = (0.2f64, 2.0f64);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let [x, y] = elastica_tip(middle);
        if y / x > droop {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Sheet held at its first three columns; u is x, v is z.
fn droop(s: &TestStrip, rigidity: f64, membrane: f64) -> f64 {
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

#[test]
fn elastica_has_the_limits_of_a_beam() {
    // A stiff beam: w L⁴/(8 B) = 1/(8 c³).
    let [x, y] = elastica_tip(5.0);
    assert!((y / (1.0 / (8.0 * 125.0)) - 1.0).abs() < 1e-3 && (x - 1.0).abs() < 1e-5);
    // Peirce 1930: the bending length is half the overhang at 41.5°.
    let [x, y] = elastica_tip(0.5);
    assert!((y.atan2(x).to_degrees() - 41.5).abs() < 0.7);
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
