//! Scalp: the part of the head that hair covers.

use tryon_body::Template;
use tryon_body::parts::BodySegment;

/// Height of the hairline between chin and crown.
const HAIRLINE: f32 = 0.78;

/// Back and top of the head, where hair grows; shape `[vertices]`.
pub(super) fn scalp(template: &Template) -> Vec<bool> {
    let vertices = template.mesh().vertices();
    let is_head =
        |v: &usize| template.parts().segment(template.weights().dominant(*v)) == BodySegment::Head;
    let head: Vec<usize> = (0..vertices.len()).filter(is_head).collect();
    let heights = head.iter().map(|v| vertices[*v].y);
    let (low, high) = heights.fold((f32::MAX, f32::MIN), |(l, h), y| (l.min(y), h.max(y)));
    let middle = head.iter().map(|v| vertices[*v].z).sum::<f32>() / head.len().max(1) as f32;
    let mut out = vec![false; vertices.len()];
    for v in head {
        let p = vertices[v];
        out[v] = p.z < middle || p.y > low + HAIRLINE * (high - low);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn the_scalp_is_behind_and_above_the_face() {
        let template = embedded::template();
        let scalp = scalp(&template);
        let vertices = template.mesh().vertices();
        let top = vertices.iter().map(|p| p.y).fold(f32::MIN, f32::max);
        let crown = vertices.iter().position(|p| p.y == top).expect("a crown");
        let head = (0..vertices.len()).filter(|v| {
            template.parts().segment(template.weights().dominant(*v)) == BodySegment::Head
        });
        let nose = head.max_by(|a, b| vertices[*a].z.total_cmp(&vertices[*b].z));
        assert!(scalp[crown] && !scalp[nose.expect("a nose")]);
    }
}
