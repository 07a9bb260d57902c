//! Own clothes of an everyday person: long sleeves, trousers, or a coat that stands off the body.

use super::rest_pose::rest_joint;
use super::settings::{CoveringSettings, StreetClothes};
use tryon_body::parts::BodySegment::{
    self, Abdomen, Chest, Collar, Forearm, Pelvis, Thigh, UpperArm,
};
use tryon_body::{RestBody, Template};
use tryon_geometry::math::V3;
use tryon_geometry::mesh::smoothing::smoothed;
use tryon_geometry::par::Par;

/// Height over which a coat ends at the knees (m).
const HEM: f32 = 0.05;

/// Thickness of a coat at a vertex of a rest body (m), from that of trunk and hips, thighs, arms; it ends above `knee`.
pub(super) fn coat_thickness(
    template: &Template,
    rest: &RestBody,
    vertex: usize,
    thickness: [f32; 3],
    knee: f32,
) -> f32 {
    let (weights, parts) = (template.weights(), template.parts());
    let share = |wanted: &[BodySegment]| -> f32 {
        let joints = weights.joints[vertex].iter().zip(&weights.weights[vertex]);
        joints
            .filter(|(j, _)| wanted.contains(&parts.segment(usize::from(**j))))
            .map(|(_, w)| *w)
            .sum()
    };
    let hem = ((rest.vertices[vertex].y - knee) / HEM).clamp(0.0, 1.0);
    thickness[0] * share(&[Pelvis, Abdomen, Chest])
        + thickness[1] * share(&[Thigh]) * hem
        + thickness[2] * share(&[Collar, UpperArm, Forearm])
}

/// Moves the surface of a rest body outwards by the coat.
pub(super) fn put_on_coat(template: &Template, rest: &mut RestBody, clothes: &StreetClothes) {
    if clothes.coat.iter().all(|t| *t <= 0.0) {
        return;
    }
    let knee = rest_joint(template, rest, "left_knee").y;
    let vertices = 0..rest.vertices.len();
    let mut depth: Vec<f32> = vertices
        .map(|i| coat_thickness(template, rest, i, clothes.coat, knee))
        .collect();
    let around = template.topology().vertex_neighbours();
    for _ in 0..CoveringSettings::default().smoothing {
        depth = smoothed(Par::Seq, around, &depth);
    }
    for (i, thickness) in depth.iter().enumerate() {
        let out: V3 = rest.normals[i] * *thickness;
        rest.vertices[i] += out;
        rest.base[i] += out;
    }
    rest.normals = template.normals(&rest.base);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Actor, ActorAppearance, Sequence, Setting};

    #[test]
    fn a_coat_stands_off_trunk_and_thighs_and_leaves_head_and_feet() {
        let plain = Sequence::new(Actor::default(), Setting::default());
        let clothes = StreetClothes {
            coat: [0.07, 0.10, 0.04],
            ..StreetClothes::default()
        };
        let actor = Actor {
            appearance: ActorAppearance::Street(clothes),
            ..Actor::default()
        };
        let coated = Sequence::new(actor, Setting::default());
        let parts = plain.actor().template.parts().clone();
        let weights = plain.actor().template.weights();
        let pairs = plain.rest().vertices.iter().zip(&coated.rest().vertices);
        let moved = pairs.enumerate().map(|(i, (a, b))| {
            let segment = parts.segment(weights.dominant(i));
            (segment, (a - b).norm())
        });
        let most = |wanted: BodySegment| {
            let of = moved.clone().filter(|(s, _)| *s == wanted);
            of.map(|(_, d)| d).fold(0.0, f32::max)
        };
        assert!(most(Chest) > 0.05 && most(Thigh) > 0.07);
        assert!(most(BodySegment::Head) < 0.01 && most(BodySegment::Foot) < 1e-6);
    }
}
