//! A population: bodies drawn from the shape space (section 6.4).

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use tryon_body::embedded::RANGE;
use tryon_body::{BodyShape, Template};

/// Shapes of `count` bodies, the same for the same seed: normally distributed coefficients within the sound range.
pub fn population(template: &Template, count: usize, seed: u64) -> Vec<BodyShape> {
    let mut rng = rand_pcg::Pcg32::seed_from_u64(seed);
    let directions = template.shape_space().map_or(0, |s| s.names.len());
    let mut coefficient = || -> f64 {
        let x: f64 = StandardNormal.sample(&mut rng);
        x.clamp(-RANGE, RANGE)
    };
    let shape = |_| BodyShape {
        coefficients: (0..directions).map(|_| coefficient()).collect(),
        ..BodyShape::default()
    };
    (0..count).map(shape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn bodies_differ_and_repeat() {
        let template = embedded::template();
        let some = population(&template, 20, 1);
        assert_eq!(some, population(&template, 20, 1));
        assert_ne!(some, population(&template, 20, 2));
        let heights = some.iter().map(|s| {
            let body = template.personalise(s);
            body.vertices.iter().map(|p| p.y).fold(f32::MIN, f32::max)
        });
        let (low, high) = heights.fold((f32::MAX, f32::MIN), |(l, h), y| (l.min(y), h.max(y)));
        assert!(high - low > 0.1);
    }
}
