//! Parts of the vertices of a body, as bit masks.

use super::{BodyPart, BodySegment};
use crate::{Joint, Template};
use tryon_geometry::math::{P3, P3d, V3};

/// A connected component with at most this share of a body's vertices is no skin (mannequin: pegs 0.04 %, hands 3.8 %).
const SMALLEST_COMPONENT: f64 = 1e-3;

/// Mask of the part of each body vertex, by its dominant joint; 0 in a component too small to be skin.
///
/// A mannequin's pegs in wrists and ankles end just under the skin, where cloth is inside the limb.
pub fn vertex_masks(template: &Template) -> Vec<u8> {
    let (component, count) = template.topology().components();
    let mut sizes = vec![0usize; count];
    component.iter().for_each(|c| sizes[*c as usize] += 1);
    let smallest = SMALLEST_COMPONENT * component.len() as f64;
    let mask = |v: usize| {
        if sizes[component[v] as usize] as f64 <= smallest {
            0
        } else {
            template.parts().part(template.weights().dominant(v)).mask()
        }
    };
    (0..component.len()).map(mask).collect()
}

/// Mean distance of the vertices of a bone (of `joint`) from the line a–b, metres; `None` without vertices or line.
pub fn mean_radius(
    template: &Template,
    vertices: &[P3],
    joint: usize,
    [a, b]: [P3d; 2],
) -> Option<f64> {
    let u = (b - a).try_normalize(0.0)?;
    let (sum, count) = (0..vertices.len())
        .filter(|i| template.weights().dominant(*i) == joint)
        .map(|i| {
            let d = vertices[i].cast::<f64>() - a;
            (d - u * u.dot(&d)).norm()
        })
        .fold((0.0, 0.0), |(s, c), r| (s + r, c + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// Mask of the part that each vertex may penetrate, given [`vertex_masks`]; shape `[vertices]`.
///
/// The trunk for an arm, the nearer arm for the trunk, the other leg for a leg.
pub fn opposing_masks(template: &Template, masks: &[u8]) -> Vec<u8> {
    let vertices = template.mesh().vertices();
    let [trunk, left_arm, right_arm, left_leg, right_leg] = BodyPart::ALL.map(BodyPart::mask);
    let mean = |mask: u8| {
        let of: Vec<_> = vertices
            .iter()
            .zip(masks)
            .filter(|(_, m)| **m == mask)
            .map(|(v, _)| v.coords)
            .collect();
        of.iter().sum::<V3>() / of.len().max(1) as f32
    };
    let (left, right) = (mean(left_arm), mean(right_arm));
    let of = |(v, mask): (&P3, &u8)| match *mask {
        0 => 0,
        m if m == left_arm || m == right_arm => trunk,
        m if m == left_leg => right_leg,
        m if m == right_leg => left_leg,
        _ if (v.coords - left).norm() < (v.coords - right).norm() => left_arm,
        _ => right_arm,
    };
    vertices.iter().zip(masks).map(of).collect()
}

/// [`opposing_masks`] without thin segments, which have cloth on one side only: 0 there.
pub fn pressing_masks(template: &Template, mut opposing: Vec<u8>) -> Vec<u8> {
    for (v, mask) in opposing.iter_mut().enumerate() {
        let segment = template.parts().segment(template.weights().dominant(v));
        if segment.is_thin() {
            *mask = 0;
        }
    }
    opposing
}

/// Vertices that move with the upper and with the lower segment of each elbow and knee.
pub fn hinge_vertices(template: &Template) -> Vec<[Vec<u32>; 2]> {
    let parts = template.parts();
    let moved_by = |j: usize| -> Vec<u32> {
        (0..template.mesh().vertices().len())
            .filter(|v| template.weights().dominant(*v) == j)
            .map(|v| v as u32)
            .collect()
    };
    let hinge = |(j, joint): (usize, &Joint)| {
        let (parent, own) = (joint.parent?, parts.segment(j));
        let bends = matches!(own, BodySegment::Forearm | BodySegment::Shin);
        (bends && parts.segment(parent) != own).then(|| [moved_by(parent), moved_by(j)])
    };
    let joints = template.skeleton().joints().iter().enumerate();
    joints.filter_map(hinge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embedded;
    use crate::parts::BodyPart;

    #[test]
    fn the_embedded_body_has_four_limbs_that_mirror_each_other() {
        let t = embedded::template();
        let name = |j: usize| t.skeleton().joints()[j].name.as_str();
        let limbs = BodyPart::ALL.map(|p| {
            let l = t.parts().limb(p)?;
            Some([l.root, l.hinge, l.end, l.tip].map(name))
        });
        let side = |s: &str, names: [&str; 4]| names.map(|n| format!("{s}_{n}"));
        let arm = ["shoulder", "elbow", "wrist", "hand_end"];
        let leg = ["hip", "knee", "ankle", "foot"];
        let expected = [("left", arm), ("right", arm), ("left", leg), ("right", leg)];
        assert_eq!(limbs[0], None);
        for (got, (s, names)) in limbs[1..].iter().zip(expected) {
            assert_eq!(got.expect("a limb"), side(s, names));
        }
        let masks = vertex_masks(&t);
        let count = |p: BodyPart| masks.iter().filter(|m| **m == p.mask()).count();
        assert_eq!(count(BodyPart::LeftArm), count(BodyPart::RightArm));
        assert_eq!(count(BodyPart::LeftLeg), count(BodyPart::RightLeg));
        assert!(
            masks.iter().all(|m| m.count_ones() == 1),
            "all of it is skin"
        );
        assert_eq!(hinge_vertices(&t).len(), 4);
        let opposing = opposing_masks(&t, &masks);
        assert!(
            masks
                .iter()
                .zip(&opposing)
                .all(|(m, o)| m & o == 0 && *o != 0)
        );
        let thin = |v: usize| t.parts().segment(t.weights().dominant(v)).is_thin();
        let pressing = pressing_masks(&t, opposing);
        assert!(
            pressing
                .iter()
                .enumerate()
                .all(|(v, m)| (*m == 0) == thin(v))
        );
    }
}
