//! Measure of being worn: how far cloth goes around a part of the body.

use tryon_body::Template;
use tryon_body::parts::BodyPart;
use tryon_geometry::math::{P3, V3};

/// Directions around a part that count apart.
const SECTORS: usize = 24;
/// Thickness of a slice across a part, metres: cloth has a vertex in each sector of it.
const SLICE: f32 = 0.05;

/// Largest share of the way around a part of the body, 0 to 1, of cloth vertices `x` (m) over parts `over`; `parts` are those
/// of the body's vertices.
pub(super) fn wrap(template: &Template, parts: &[u8], x: &[P3], over: &[u8]) -> f64 {
    let body = template.mesh().vertices();
    let of_part = |part: &BodyPart| {
        let along = axis(template, *part)?;
        let of = |points: &[P3], masks: &[u8]| -> Vec<P3> {
            let pairs = points.iter().zip(masks);
            let own = pairs.filter(|(_, mask)| **mask & part.mask() != 0);
            own.map(|(p, _)| *p).collect()
        };
        Some(around(&of(body, parts), &of(x, over), along))
    };
    let shares = BodyPart::ALL.iter().filter_map(of_part);
    shares.fold(0.0, f64::max)
}

/// Direction of a part of the body at rest; `None` for a limb that the skeleton lacks.
fn axis(template: &Template, part: BodyPart) -> Option<V3> {
    if part == BodyPart::Trunk {
        return Some(V3::y());
    }
    let limb = template.parts().limb(part)?;
    let at = |joint: usize| template.skeleton().joints()[joint].rest.cast::<f32>();
    (at(limb.end) - at(limb.root)).try_normalize(1e-6)
}

/// Largest share of the sectors of a slice of `skin` that have cloth.
fn around(skin: &[P3], cloth: &[P3], along: V3) -> f64 {
    let across = along.cross(&V3::x()).try_normalize(0.1);
    let across = across.unwrap_or_else(|| along.cross(&V3::z()));
    let other = along.cross(&across);
    let slice = |p: &P3| (p.coords.dot(&along) / SLICE).floor() as i32;
    let mut slices: Vec<i32> = cloth.iter().map(slice).collect();
    slices.sort_unstable();
    slices.dedup();
    let share = |s: i32| {
        let own = skin.iter().filter(|p| slice(p) == s);
        let (sum, count) = own.fold((V3::zeros(), 0), |(sum, n), p| (sum + p.coords, n + 1));
        if count == 0 {
            return 0.0;
        }
        let middle = sum / count as f32;
        let mut has_cloth = [false; SECTORS];
        for p in cloth.iter().filter(|p| slice(p) == s) {
            let d = p.coords - middle;
            let turn = d.dot(&across).atan2(d.dot(&other)) / std::f32::consts::TAU + 0.5;
            has_cloth[((turn * SECTORS as f32) as usize).min(SECTORS - 1)] = true;
        }
        has_cloth.iter().filter(|b| **b).count() as f64 / SECTORS as f64
    };
    slices.into_iter().map(share).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_body::parts::vertex_masks;

    /// Skin that `is_covered`, as cloth.
    fn share(is_covered: impl Fn(&P3) -> bool) -> f64 {
        let t = embedded::template();
        let (body, parts) = (t.mesh().vertices(), vertex_masks(&t));
        let pairs = body.iter().zip(&parts).filter(|(p, _)| is_covered(p));
        let (x, over): (Vec<P3>, Vec<u8>) = pairs.unzip();
        wrap(&t, &parts, &x, &over)
    }

    #[test]
    fn a_vest_goes_around_and_its_front_half_around() {
        let is_trunk = |p: &P3| (1.0..1.2).contains(&p.y) && p.x.abs() < 0.25;
        assert!(share(is_trunk) > 0.95);
        let front = share(|p| is_trunk(p) && p.z > 0.02);
        assert!((0.3..0.7).contains(&front), "{front}");
        let sleeve = share(|p| p.x > 0.3 && p.y > 1.0);
        assert!(sleeve > 0.95, "{sleeve}");
        assert_eq!(share(|_| false), 0.0);
    }
}
