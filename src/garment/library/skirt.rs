//! A flared skirt to the knee: front and back, waist and hem on arcs.

use super::{panel, sewn};
use crate::garment::{Anchor, Curve, GarmentError, GarmentKind, Material, Pattern, Placement, SizeRow};

/// Ease at the waist, metres.
const WAIST_EASE: f64 = 0.015;
/// Ease at the hip, metres.
const HIP_EASE: f64 = 0.07;
/// Waist to hip line, metres.
const HIP_DEPTH: f64 = 0.20;
/// Waist to hem, metres.
const LENGTH: f64 = 0.56;
/// Half angle of each panel's flare, radians: both panels together make a third of a circle.
const FLARE: f64 = 0.30;

pub(super) fn flared(row: &SizeRow) -> Result<Pattern, GarmentError> {
    // A ring sector: arc length at the waist is half the waist. Hips that need more than the flare gives widen it.
    let waist = (row.body.waist + WAIST_EASE) / 2.0;
    let hip = (row.body.hip + HIP_EASE) / 2.0;
    let half_angle = FLARE.max((hip - waist) / HIP_DEPTH / 2.0);
    let radius = waist / (2.0 * half_angle);
    // Cubic approximation of an arc of ±half_angle about (0, radius): control length 4/3·tan(θ/4).
    let at = |r: f64, a: f64| [r * a.sin(), radius - r * a.cos()];
    let arc = |r: f64, from: f64, to: f64| {
        let k = 4.0 / 3.0 * ((to - from) / 4.0).tan() * r;
        let (p, q) = (at(r, from), at(r, to));
        Curve::Cubic([p[0] + k * from.cos(), p[1] + k * from.sin()], [q[0] - k * to.cos(), q[1] - k * to.sin()])
    };
    let build = |name: &str, placement| {
        panel(
            name,
            placement,
            &[
                ("hem", at(radius + LENGTH, -half_angle), arc(radius + LENGTH, -half_angle, half_angle)),
                ("side_right", at(radius + LENGTH, half_angle), Curve::Line),
                ("waist", at(radius, half_angle), arc(radius, half_angle, -half_angle)),
                ("side_left", at(radius, -half_angle), Curve::Line),
            ],
        )
    };
    Ok(Pattern {
        name: "skirt".into(),
        kind: GarmentKind::Skirt,
        size: row.size,
        panels: vec![build("front", Placement::SkirtFront), build("back", Placement::SkirtBack)],
        seams: vec![
            sewn(["front", "side_right"], ["back", "side_left"]),
            sewn(["front", "side_left"], ["back", "side_right"]),
        ],
        anchors: vec![Anchor {
            name: "waist".into(),
            edges: vec![["front".into(), "waist".into()], ["back".into(), "waist".into()]],
            strength: 1.0,
        }],
        material: Material::preset("twill")?,
        layer: 0,
        finished: [0.0, waist * 2.0, (radius + HIP_DEPTH) * half_angle * 4.0],
    })
}
