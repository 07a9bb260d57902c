//! Random people: shapes over the whole range, any stature, clothes and hair as bumps of the surface.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tryon_body::{BodyShape, RestBody, Template, embedded};
use tryon_geometry::math::{P3, P3d};
use tryon_tracking::PartClasses;
use tryon_tracking::part_classes::{PartKind, kind_of};

/// Statures, metres.
const STATURES: [f64; 2] = [1.45, 2.05];
/// Spread of the coefficients, standard deviations: wider than the population.
const SPREAD: f64 = 1.3;
/// Greatest height of bumps, metres: a loose jacket, long hair.
const BUMPS: f32 = 0.035;
/// Share of people with bumps.
const CLOTHED: f64 = 0.6;
/// Wavelengths of bumps, radians per metre.
const WAVES: [f32; 2] = [4.0, 14.0];

/// Widths of clothes over the skin: trunk, arms, legs; metres.
const WIDTHS: [f32; 3] = [0.05, 0.025, 0.035];

/// Rest body of a random person.
pub(super) fn draw(template: &Template, classes: &PartClasses, rng: &mut Pcg64Mcg) -> RestBody {
    let directions = template.shape_space().map_or(0, |s| s.names.len());
    let normal = |rng: &mut Pcg64Mcg| -> f64 { StandardNormal.sample(rng) };
    let limit = embedded::RANGE;
    let coefficients = (0..directions)
        .map(|_| (SPREAD * normal(rng)).clamp(-limit, limit))
        .collect();
    let displacements = if rng.random_bool(CLOTHED) {
        clothes(template, classes, rng)
    } else {
        vec![]
    };
    let mut rest = template.personalise(&BodyShape {
        coefficients,
        bone_scales: vec![],
        displacements,
    });
    let heights = rest.vertices.iter().map(|v| v.y);
    let (lo, hi) = heights.fold((f32::MAX, f32::MIN), |(l, h), y| (l.min(y), h.max(y)));
    let scale = rng.random_range(STATURES[0]..STATURES[1]) / f64::from(hi - lo);
    let small = scale as f32;
    rest.vertices
        .iter_mut()
        .for_each(|v| *v = P3::from(v.coords * small));
    rest.joints
        .iter_mut()
        .for_each(|j| *j = P3d::from(j.coords * scale));
    rest
}

/// Distance of clothes over the skin: a width for trunk, arms and legs, and smooth bumps as a product of waves in the rest
/// pose.
fn clothes(template: &Template, classes: &PartClasses, rng: &mut Pcg64Mcg) -> Vec<f32> {
    let height = rng.random_range(0.0..BUMPS);
    // Squares of uniform numbers: tight clothes are the most frequent.
    let widths = WIDTHS.map(|w| w * rng.random::<f32>().powi(2));
    let k: [f32; 3] = std::array::from_fn(|_| rng.random_range(WAVES[0]..WAVES[1]));
    let phase: [f32; 3] = std::array::from_fn(|_| rng.random_range(0.0..std::f32::consts::TAU));
    let wave = |p: &P3| {
        (0..3)
            .map(|i| 0.5 + 0.5 * (k[i] * p[i] + phase[i]).sin())
            .product::<f32>()
    };
    let vertices = template.mesh().vertices().iter();
    let worn = |(p, class): (&P3, &u8)| height * (0.3 + wave(p)) + width(*class, &widths);
    vertices.zip(classes.of_vertex()).map(worn).collect()
}

/// Width of clothes at a class: `[trunk, arms, legs]`, metres.
fn width(class: u8, [trunk, arms, legs]: &[f32; 3]) -> f32 {
    use PartKind::*;
    match kind_of(class) {
        Some((Shoulder | Chest | Belly | Hip, _)) => *trunk,
        Some((UpperArm | Elbow | Forearm, _)) => *arms,
        Some((Thigh | Knee | Shank, _)) => *legs,
        _ => 0.0,
    }
}
