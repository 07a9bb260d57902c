//! Square patch in a picture frame of four hinged bars: its shear force by the angle, against the closed form.
//!
//! Bars of length L at the angle π/2 − γ keep the lengths of weft and warp: F = [1 sin γ; 0 cos γ], ε = (0, 0, sin γ) in
//! (εᵤᵤ, εᵥᵥ, γ). Pulled at a corner by a force P along its diagonal, the frame shears the patch by P = 2 T cos φ with
//! 2φ = π/2 − γ (Cao et al. 2008, "Characterization of mechanical behavior of woven fabrics: Experimental methods and
//! benchmark results", Composites A 39). The work of P is that of the membrane stress S = ∂W/∂ε, so T = L S_γ(0, 0, sin γ).

use super::curves::WOVEN;
use super::statics::Statics;
use super::{BendLaw, ClothModel, ElasticExpansion, ElasticFabric, RestSheet};
use super::{MeasuredStretch, StretchLaw};
use crate::settings::ElasticSettings;
use crate::specimens::strip::{StripMesh, StripPattern, strip};
use nalgebra::Vector2;
use tryon_formats::fabric_json::read_fabric;
use tryon_formats::shared_data;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Length of a bar (m).
const SIDE: f64 = 0.1;
/// Shear angles γ (rad), to 46°.
const ANGLES: [f64; 3] = [0.1, 0.4, 0.8];

/// Mesh of n × n squares.
fn square(n: usize, pattern: StripPattern) -> StripMesh {
    strip(SIDE * (n as f64 - 1.5) / n as f64, n, n, pattern)
}

/// Square patch, from the hinge at its first vertex.
struct Patch {
    at: Vec<Vector2<f64>>,
    model: ClothModel,
    /// True for vertices on a bar.
    clamped: Vec<bool>,
}

impl Patch {
    fn new(mesh: &StripMesh, stretch: &StretchLaw) -> Self {
        let (mut at, faces) = (mesh.at.clone(), mesh.faces.clone());
        let first = at[0];
        at.iter_mut().for_each(|p| *p -= first);
        let fabric = ElasticFabric {
            area_density: 0.2,
            stretch: stretch.clone(),
            bend: BendLaw::isotropic(0.0, 0.0),
        };
        let rest = RestSheet::flat(faces, &at).expect("faces");
        let model = ClothModel::new(&rest, at.len(), fabric).expect("valid");
        let on_side = |c: &f64| *c < 1e-9 || *c > SIDE - 1e-9;
        let clamped = at.iter().map(|p| p.iter().any(on_side)).collect();
        Self { at, model, clamped }
    }

    /// Plane position of a material point at a shear angle, and its derivative by the angle.
    fn sheared(p: &Vector2<f64>, angle: f64) -> [Vector2<f64>; 2] {
        let (s, c) = angle.sin_cos();
        [
            Vector2::new(p.x + p.y * s, p.y * c),
            Vector2::new(p.y * c, -p.y * s),
        ]
    }

    /// Shear force T (N) at `x` by the virtual work of the vertices that move by `rate` with the angle:
    /// P dD = T L cos γ dγ for the frame's diagonal D.
    fn shear_force(&self, x: &[V3d], angle: f64, rate: impl Fn(usize) -> V3d) -> f64 {
        let mut e = ElasticExpansion::default();
        self.model.expand(Par::Seq, x, &mut e);
        let work: f64 = (0..x.len()).map(|i| e.gradient[i].dot(&rate(i))).sum();
        work / (SIDE * angle.cos())
    }

    /// Shear force by the bars alone, of a patch whose inside came to rest from a start beside equilibrium.
    fn force_on_bars(&self, angle: f64) -> f64 {
        let flat = |p: Vector2<f64>| V3d::new(p.x, 0.0, p.y);
        let place = |i: usize| flat(Self::sheared(&self.at[i], angle)[0]);
        let aside = |i: usize| {
            let wave = 1e3 * self.at[i];
            V3d::new(wave.y.sin(), 0.0, wave.x.cos())
                * (5e-4 * f64::from(u8::from(!self.clamped[i])))
        };
        let mut x: Vec<V3d> = (0..self.at.len()).map(|i| place(i) + aside(i)).collect();
        let statics = Statics {
            model: &self.model,
            gravity: V3d::zeros(),
            held: self.clamped.iter().map(|h| [*h, true, *h]).collect(),
            load: vec![V3d::x(); 1], // scale of the tolerance: a newton on a held coordinate
        };
        assert!(statics.solve(&mut x) > 0);
        self.shear_force(&x, angle, |i| {
            let rate = flat(Self::sheared(&self.at[i], angle)[1]);
            rate * f64::from(u8::from(self.clamped[i]))
        })
    }

    /// Shear force of the frame rolled onto a cylinder of this radius (m), its vertices on it.
    fn force_on_cylinder(&self, angle: f64, radius: f64) -> f64 {
        let at = |i: usize| Self::sheared(&self.at[i], angle);
        let x: Vec<V3d> = (0..self.at.len())
            .map(|i| {
                let (s, c) = (at(i)[0].x / radius).sin_cos();
                V3d::new(radius * s, radius * c, at(i)[0].y)
            })
            .collect();
        self.shear_force(&x, angle, |i| {
            let [p, rate] = at(i);
            let (s, c) = (p.x / radius).sin_cos();
            V3d::new(c * rate.x, -s * rate.x, rate.y)
        })
    }
}

/// Membrane law with its shear modulus (N/m) at rest and stretched along 45° to the weft.
struct ShearLaw {
    stretch: StretchLaw,
    moduli: [f64; 2],
}

impl ShearLaw {
    /// Shear stress S_γ(0, 0, g) (N/m). The principal strains are ± g/2; a measured law counts them as a tension with faded
    /// compression of (g/2)² / √((g/2)² + ¼ (g/2)²) = g/√5, τ in units of the data's strain: W = ½ g² (k₀ + ⅔ τ Δk) up to
    /// τ = 1, ½ g² (k₀ + (1 − 1/(3 τ²)) Δk) beyond.
    fn stress(&self, g: f64) -> f64 {
        /// Green–Lagrange strain of the data's stretched rows, a stretch ratio of 7/6.
        const STRAIN: f64 = 0.5 * (49.0 / 36.0 - 1.0);
        let tau = (g / (5f64.sqrt() * STRAIN)).min(1.0);
        g * (self.moduli[0] + tau * (self.moduli[1] - self.moduli[0]))
    }
}

/// The linear law and measured stiff weaves. The energies of the other measured fabrics lose rank-one convexity under shear,
/// so that no homogeneous state is a minimum.
fn laws() -> Vec<ShearLaw> {
    let mut all = vec![ShearLaw {
        stretch: StretchLaw::Linear(WOVEN),
        moduli: [WOVEN.shear; 2],
    }];
    for name in ["11oz-black-denim", "royal-target", "white-dots-on-blk"] {
        let path = format!("materials/wang2011_arcsim_NONCOMMERCIAL/{name}.json");
        let Some(path) = shared_data(path) else {
            continue;
        };
        let data = read_fabric(&path).expect("fabric");
        all.push(ShearLaw {
            stretch: StretchLaw::Measured(Box::new(MeasuredStretch::new(
                &data,
                &ElasticSettings::default(),
            ))),
            // The data's third stretched row is that along 45°.
            moduli: [0, 3].map(|row| data.stretching[row][3]),
        });
    }
    all
}

/// Homogeneous shear is in the space of every mesh, so that each has the force to rounding.
#[test]
fn bars_of_a_frame_feel_the_closed_shear_force_on_every_mesh() {
    for law in laws() {
        for (n, pattern) in [
            (4, StripPattern::Uniform),
            (7, StripPattern::Staggered),
            (6, StripPattern::Unstructured(8)),
            (12, StripPattern::Unstructured(9)),
        ] {
            let patch = Patch::new(&square(n, pattern), &law.stretch);
            for angle in ANGLES {
                let force = patch.force_on_bars(angle);
                let expected = SIDE * law.stress(angle.sin());
                let error = (force / expected - 1.0).abs();
                assert!(error < 1e-8, "{n} {pattern:?} {angle}: {force} {expected}");
            }
        }
    }
}

/// Rolled onto a cylinder the frame has the same strain, and triangles as chords: the force converges with h².
#[test]
fn shear_force_of_a_rolled_frame_converges_in_second_order() {
    const RADIUS: f64 = 0.05;
    for pattern in [
        StripPattern::Uniform,
        StripPattern::Alternating,
        StripPattern::Unstructured(10),
    ] {
        let order = match pattern {
            StripPattern::Unstructured(_) => 1.66,
            _ => 1.9,
        };
        let meshes = [6, 24].map(|n| square(n, pattern));
        for law in laws() {
            let patches = meshes.each_ref().map(|m| Patch::new(m, &law.stretch));
            for angle in ANGLES {
                let error = |patch: &Patch| {
                    let force = patch.force_on_cylinder(angle, RADIUS);
                    (force / (SIDE * law.stress(angle.sin())) - 1.0).abs()
                };
                let [coarse, fine] = patches.each_ref().map(error);
                let case = format!("{pattern:?} {angle}: {coarse:.1e} {fine:.1e}");
                assert!(fine < 6e-3 && fine < coarse * 4f64.powf(-order), "{case}");
            }
        }
    }
}
