//! The collision model of a template as cloth of given settings meets it.

use super::{ClothError, Config};
use crate::contact::{CollisionError, CollisionModel, CollisionParts};
use tryon_body::Template;
use tryon_body::parts::{BodyPart, hinge_vertices, opposing_masks, pressing_masks, vertex_masks};
use tryon_garment::Region;

/// A garment's regions are masks of body parts.
const _: () = {
    let masks = [
        Region::TRUNK,
        Region::LEFT_ARM,
        Region::RIGHT_ARM,
        Region::LEFT_LEG,
        Region::RIGHT_LEG,
    ];
    let mut k = 0;
    while k < masks.len() {
        assert!(masks[k].0 == BodyPart::ALL[k].mask());
        k += 1;
    }
};

/// Collision model of bodies made from `template`, for [`crate::contact::CollisionBody`].
///
/// # Errors
/// Faults of the template's mesh.
pub fn collision_model(template: &Template, config: &Config) -> Result<CollisionModel, ClothError> {
    let own = vertex_masks(template);
    let opposite = opposing_masks(template, &own);
    let parts = CollisionParts {
        pressing: pressing_masks(template, opposite.clone()),
        opposite,
        own,
        hinges: hinge_vertices(template),
    };
    Ok(CollisionModel::new(
        template.mesh(),
        parts,
        config.collision(),
    )?)
}

impl From<CollisionError> for ClothError {
    fn from(e: CollisionError) -> Self {
        match e {
            CollisionError::Count { got, expected } => Self::Count {
                what: "body vertices",
                got,
                expected,
            },
            CollisionError::NotFinite { vertex } => Self::NotFinite {
                what: "body vertex",
                index: vertex,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{CollisionBody, CollisionWorkspace};
    use tryon_body::{BodyShape, embedded};
    use tryon_geometry::math::P3;

    #[test]
    fn arms_in_the_trunk_are_separated_in_any_frame_and_nothing_else_moves() {
        let template = embedded::template();
        let heavy = BodyShape {
            coefficients: vec![0.3, 2.0, 1.2],
            ..BodyShape::default()
        };
        let rest = template.personalise(&heavy).vertices;
        // The upper half made narrower: arms penetrate the trunk.
        let narrow = |p: &P3| P3::new(p.x * if p.x.abs() > 0.14 { 0.8 } else { 1.0 }, p.y, p.z);
        let body: Vec<P3> = rest.iter().map(narrow).collect();
        let model = collision_model(&template, &Config::default()).expect("a body");
        let separated = |posed: &[P3]| {
            let (mut b, mut work) = (CollisionBody::default(), CollisionWorkspace::default());
            b.update(&model, posed, 0.0, &mut work).expect("it fits");
            b.vertices().to_vec()
        };
        let once = separated(&body);
        let moved = || once.iter().zip(&body).map(|(a, b)| (a - b).norm());
        let count = moved().filter(|d| *d > 1e-6).count();
        assert!(count > 20 && count < body.len() / 4, "{count}");
        assert!(moved().all(|d| d < 0.041));
        // Half a turn about the vertical.
        let half_turn = |p: &P3| P3::new(-p.x, p.y, -p.z);
        let turned: Vec<P3> = body.iter().map(half_turn).collect();
        let back = separated(&turned);
        let pairs = once.iter().zip(back.iter().map(half_turn));
        assert!(pairs.into_iter().all(|(a, b)| (a - b).norm() < 1e-5));
    }
}
