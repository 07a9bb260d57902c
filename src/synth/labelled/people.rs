//! Random people: shapes over the whole range, any stature, clothes and hair as bumps of the surface.

use super::settings::LabelledSettings;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tryon_body::{BodyShape, RestBody, Template, embedded};
use tryon_geometry::math::{P3, P3d};
use tryon_tracking::PartClasses;
use tryon_tracking::part_classes::{PartKind, kind_of};

/// Rest body of a random person.
pub(super) fn draw(
    settings: &LabelledSettings,
    template: &Template,
    classes: &PartClasses,
    rng: &mut Pcg64Mcg,
) -> RestBody {
    let directions = template.shape_space().map_or(0, |s| s.names.len());
    let normal = |rng: &mut Pcg64Mcg| -> f64 { StandardNormal.sample(rng) };
    let limit = embedded::RANGE;
    let coefficients = (0..directions)
        .map(|_| (settings.spread * normal(rng)).clamp(-limit, limit))
        .collect();
    let displacements = if rng.random_bool(settings.clothed) {
        clothes(settings, template, classes, rng)
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
    let [low, high] = settings.statures;
    let scale = rng.random_range(low..high) / f64::from(hi - lo);
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
fn clothes(
    settings: &LabelledSettings,
    template: &Template,
    classes: &PartClasses,
    rng: &mut Pcg64Mcg,
) -> Vec<f32> {
    let height = rng.random_range(0.0..settings.bumps);
    // Squares of uniform numbers: tight clothes are the most frequent.
    let widths = settings.widths.map(|w| w * rng.random::<f32>().powi(2));
    let [low, high] = settings.waves;
    let k: [f32; 3] = std::array::from_fn(|_| rng.random_range(low..high));
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
