//! People of the bench: random shapes of the embedded body's space, and bodies outside it.

use super::common_joints::{CommonJoints, Points};
use super::settings::PeopleSettings;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::sync::Arc;
use tryon_body::embedded::{self, DIRECTIONS};
use tryon_body::{BodyShape, Template};
use tryon_synth::{Actor, Truth};

/// A named actor.
#[derive(Clone, Debug)]
pub(super) struct Person {
    pub(super) name: String,
    pub(super) actor: Actor,
    /// Another skeleton than the embedded one: joints of one name differ by a constant.
    pub(super) is_foreign: bool,
    common: CommonJoints,
}

const SEED: u64 = 0x5eed_0001;

impl Person {
    /// A person of the embedded body's shape space: normally distributed coefficients, sexes in turn.
    pub(super) fn random(index: usize, settings: &PeopleSettings) -> Self {
        let largest = settings.largest;
        let mut rng = rand_pcg::Pcg32::seed_from_u64(SEED + index as u64);
        let mut coefficient = || {
            let x: f64 = StandardNormal.sample(&mut rng);
            x.clamp(-largest, largest)
        };
        let mut coefficients: Vec<f64> = DIRECTIONS.iter().map(|_| coefficient()).collect();
        if let Some(sex) = DIRECTIONS.iter().position(|d| *d == "sex") {
            coefficients[sex] = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
        }
        let shape = BodyShape {
            coefficients,
            ..BodyShape::default()
        };
        Self::new(format!("own_{index}"), embedded::template(), shape, false)
    }

    /// A person with a skeleton of another origin.
    pub(super) fn foreign(name: &str, template: Arc<Template>, shape: BodyShape) -> Self {
        Self::new(name.to_owned(), template, shape, true)
    }

    fn new(name: String, template: Arc<Template>, shape: BodyShape, is_foreign: bool) -> Self {
        let appearance = name
            .bytes()
            .fold(7u64, |h, b| h.wrapping_mul(31).wrapping_add(u64::from(b)));
        Self {
            common: CommonJoints::new(template.skeleton()),
            name,
            is_foreign,
            actor: Actor {
                template,
                shape,
                appearance: appearance.into(),
            },
        }
    }

    /// Common joints of the truth.
    pub(super) fn points(&self, truth: &Truth) -> Points {
        self.common.points(&truth.joints)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_people_differ_and_stay_the_same_from_run_to_run() {
        let settings = PeopleSettings::default();
        let person = |index| Person::random(index, &settings);
        let (a, b) = (person(0), person(1));
        assert_ne!(a.actor.shape, b.actor.shape);
        assert_eq!(a.actor.shape, person(0).actor.shape);
        let all = a.actor.shape.coefficients.iter();
        assert!(all.clone().all(|c| c.abs() <= settings.largest) && all.len() == DIRECTIONS.len());
    }
}
