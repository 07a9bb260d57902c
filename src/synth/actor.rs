//! Person in front of a camera: somebody in everyday clothes, or the display figure of a shop.

use super::settings::{FigureSettings, StreetClothes};
use std::sync::Arc;
use tryon_body::{BodyShape, Template};

/// Head, hair, clothes and colours of an actor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ActorAppearance {
    /// A face, short hair, T-shirt, leggings and shoes in the colours of this number.
    Everyday(u64),
    /// The same face and hair in other clothes.
    Street(StreetClothes),
    /// A figure without a face, with a smooth head, hair in a knot and a base layer of tank top and leggings.
    Figure(FigureSettings),
}

impl Default for ActorAppearance {
    fn default() -> Self {
        Self::Everyday(0)
    }
}

impl From<u64> for ActorAppearance {
    fn from(number: u64) -> Self {
        Self::Everyday(number)
    }
}

/// Person in front of the camera.
#[derive(Clone, Debug)]
pub struct Actor {
    /// Body and joints.
    pub template: Arc<Template>,
    /// Shape of this person.
    pub shape: BodyShape,
    /// Head, hair and clothes.
    pub appearance: ActorAppearance,
}

impl Actor {
    /// A tall, slender display figure: what a shop shows its clothes on.
    pub fn figure() -> Self {
        let shape = BodyShape {
            coefficients: FIGURE.iter().map(|(_, x)| *x).collect(),
            ..BodyShape::default()
        };
        Self {
            template: tryon_body::embedded::template(),
            shape,
            appearance: ActorAppearance::Figure(FigureSettings::default()),
        }
    }
}

/// Coefficients of the display figure in the order of [`tryon_body::embedded::DIRECTIONS`], standard deviations: within
/// what tracking measures.
const FIGURE: [(&str, f64); 10] = [
    ("stature", 0.9),
    ("girth", -0.8),
    ("sex", -0.7),
    ("limb_length", 1.0),
    ("torso_length", -0.4),
    ("shoulder_width", 0.3),
    ("chest", 0.0),
    ("waist", -0.9),
    ("hip", -0.4),
    ("belly", -0.5),
];

impl Default for Actor {
    /// The embedded body as it is.
    fn default() -> Self {
        Self {
            template: tryon_body::embedded::template(),
            shape: BodyShape::default(),
            appearance: ActorAppearance::default(),
        }
    }
}
