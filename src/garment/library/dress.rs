//! A sleeveless dress: bodice shaped by waist darts, flared skirt to the knee.

use super::skirt::{HIP_DEPTH, darts, flare, sector};
use super::top::{SHOULDER_FALL, shoulders, trunk_seams, yoke};
use super::{panel, sewn};
use crate::garment::{
    Anchor, Curve, GarmentError, GarmentKind, Material, Pattern, Placement, SizeRow,
};

/// Ease at chest, waist and hip, metres.
const EASE: [f64; 3] = [0.06, 0.04, 0.10];
/// Width taken out by each of the four darts, metres.
const DART: f64 = 0.026;
/// Their depth, front and back, metres.
const DART_DEPTH: [f64; 2] = [0.12, 0.14];
/// Waist to hem, metres.
const SKIRT: f64 = 0.58;
/// Drop of the front and back neckline, metres.
const DROP: [f64; 2] = [0.105, 0.045];

pub(super) fn flared(row: &SizeRow) -> Result<Pattern, GarmentError> {
    let half = (row.body.chest + EASE[0]) / 4.0;
    let waist = (row.body.waist + EASE[1]) / 4.0; // half width of a panel once sewn
    let cut_waist = waist + DART;
    let neck = row.neck / 5.0 + 0.028;
    let tip = row.shoulders / 2.0 - 0.022;
    let armpit = -(row.body.chest / 8.0 + 0.098);
    let length = -(row.trunk - HIP_DEPTH + 0.01);
    let bodice = |name: &str, placement, drop: f64, depth: f64| {
        let flip = |p: [f64; 2]| [-p[0], p[1]];
        let (hp, st, ua, wa) = (
            [neck, 0.0],
            [tip, -SHOULDER_FALL],
            [half, armpit],
            [cut_waist, length],
        );
        let at = cut_waist * 0.52;
        let (inn, apex, out) = (
            [at - DART / 2.0, length],
            [at, length + depth],
            [at + DART / 2.0, length],
        );
        let (lower, upper) = ([tip - 0.012, armpit + 0.01], [tip - 0.024, armpit * 0.55]);
        panel(
            name,
            placement,
            &[
                &[
                    ("waist_2", flip(wa), Curve::Line),
                    ("dart_left_a", flip(out), Curve::Line),
                    ("dart_left_b", flip(apex), Curve::Line),
                    ("waist_1", flip(inn), Curve::Line),
                    ("dart_right_a", inn, Curve::Line),
                    ("dart_right_b", apex, Curve::Line),
                    ("waist_0", out, Curve::Line),
                    ("side_right", wa, Curve::Line),
                ],
                &yoke(hp, st, ua, drop, [lower, upper])[..],
                &[("side_left", flip(ua), Curve::Line)],
            ]
            .concat(),
        )
    };
    let skirt_waist = 2.0 * waist;
    let half_angle = flare(skirt_waist, (row.body.hip + EASE[2]) / 2.0);
    // The skirt's waist is divided where the bodice's darts close.
    let side = (cut_waist - (cut_waist * 0.52 + DART / 2.0)) / skirt_waist;
    let cuts = [side, 1.0 - side];
    let skirt =
        |name: &str, placement| sector(name, placement, skirt_waist, half_angle, SKIRT, &cuts);
    let panels = vec![
        bodice("front", Placement::TrunkFront, DROP[0], DART_DEPTH[0]),
        bodice("back", Placement::TrunkBack, DROP[1], DART_DEPTH[1]),
        skirt("skirt_front", Placement::SkirtFront),
        skirt("skirt_back", Placement::SkirtBack),
    ];
    let mut seams = trunk_seams();
    seams.push(sewn(
        ["skirt_front", "side_right"],
        ["skirt_back", "side_left"],
    ));
    seams.push(sewn(
        ["skirt_front", "side_left"],
        ["skirt_back", "side_right"],
    ));
    for side in ["front", "back"] {
        let s = format!("skirt_{side}");
        for e in ["waist_0", "waist_1", "waist_2"] {
            seams.push(sewn([side, e], [&s, e]));
        }
    }
    let radius = skirt_waist / (2.0 * half_angle);
    Ok(Pattern {
        name: "dress".into(),
        kind: GarmentKind::Dress,
        size: row.size,
        panels,
        seams,
        darts: darts(&["front", "back"]),
        anchors: vec![Anchor {
            strength: 0.5,
            ..shoulders()
        }],
        material: Material::preset("cotton")?,
        layer: 1,
        finished: [
            half * 4.0,
            waist * 4.0,
            (radius + HIP_DEPTH) * half_angle * 4.0,
        ],
    })
}
