//! A sleeveless dress: bodice shaped by waist darts, flared skirt to the knee.

use super::draft::{flip, panel, sewn};
use super::skirt::{DART_AT, HIP_DEPTH, Sector, darts, flare};
use super::top::{SHOULDER_FALL, shoulders, trunk_seams, yoke};
use crate::{
    Anchor, Curve, GarmentError, GarmentKind, Material, Panel, Pattern, Placement, SizeRow,
};

/// Ease at chest, waist and hip, metres.
const EASE: [f64; 3] = [0.06, 0.04, 0.10];
/// Width of each of the four darts, metres.
const DART: f64 = 0.026;
/// Depth of the darts, front and back, metres.
const DART_DEPTH: [f64; 2] = [0.12, 0.14];
/// Waist to hem, metres.
const SKIRT: f64 = 0.58;
/// Depth of the front and back neckline, metres.
const DROP: [f64; 2] = [0.105, 0.045];

/// Measures of the bodice, metres.
struct Bodice {
    /// Half width of a panel at the chest, and at the waist before the darts are sewn.
    half: f64,
    cut_waist: f64,
    /// Half width of the neck opening, and of the shoulder.
    neck: f64,
    tip: f64,
    /// Height of the underarm point and of the waist below the high point of the shoulder, negative.
    armpit: f64,
    length: f64,
}

impl Bodice {
    /// A panel with a neckline `drop` and darts `depth` metres deep.
    fn panel(&self, name: &str, placement: Placement, drop: f64, depth: f64) -> Panel {
        let Self {
            half,
            cut_waist,
            neck,
            tip,
            armpit,
            length,
        } = *self;
        let (high, shoulder) = ([neck, 0.0], [tip, -SHOULDER_FALL]);
        let (underarm, waist) = ([half, armpit], [cut_waist, length]);
        let at = cut_waist * DART_AT;
        let (inner, apex, outer) = (
            [at - DART / 2.0, length],
            [at, length + depth],
            [at + DART / 2.0, length],
        );
        let (lower, upper) = ([tip - 0.012, armpit + 0.01], [tip - 0.024, armpit * 0.55]);
        let edges = [
            &[
                ("waist_2", flip(waist), Curve::Line),
                ("dart_left_a", flip(outer), Curve::Line),
                ("dart_left_b", flip(apex), Curve::Line),
                ("waist_1", flip(inner), Curve::Line),
                ("dart_right_a", inner, Curve::Line),
                ("dart_right_b", apex, Curve::Line),
                ("waist_0", outer, Curve::Line),
                ("side_right", waist, Curve::Line),
            ],
            &yoke(high, shoulder, underarm, drop, [lower, upper])[..],
            &[("side_left", flip(underarm), Curve::Line)],
        ];
        panel(name, placement, &edges.concat())
    }
}

/// A flared dress.
pub(super) fn flared(row: &SizeRow) -> Result<Pattern, GarmentError> {
    let waist = (row.body.waist + EASE[1]) / 4.0; // half width of a panel once sewn
    let bodice = Bodice {
        half: (row.body.chest + EASE[0]) / 4.0,
        cut_waist: waist + DART,
        neck: row.neck / 5.0 + 0.028,
        tip: row.shoulders / 2.0 - 0.022,
        armpit: -(row.body.chest / 8.0 + 0.098),
        length: -(row.trunk - HIP_DEPTH + 0.01),
    };
    let skirt_waist = 2.0 * waist;
    let half_angle = flare(skirt_waist, (row.body.hip + EASE[2]) / 2.0);
    // The waist of the skirt is divided at the darts of the bodice.
    let side = (bodice.cut_waist - (bodice.cut_waist * DART_AT + DART / 2.0)) / skirt_waist;
    let cuts = [side, 1.0 - side];
    let sector = Sector {
        waist: skirt_waist,
        half_angle,
        length: SKIRT,
        cuts: &cuts,
    };
    let panels = vec![
        bodice.panel("front", Placement::TrunkFront, DROP[0], DART_DEPTH[0]),
        bodice.panel("back", Placement::TrunkBack, DROP[1], DART_DEPTH[1]),
        sector.panel("skirt_front", Placement::SkirtFront),
        sector.panel("skirt_back", Placement::SkirtBack),
    ];
    let mut seams = trunk_seams();
    for (a, b) in [("side_right", "side_left"), ("side_left", "side_right")] {
        seams.push(sewn(["skirt_front", a], ["skirt_back", b]));
    }
    for side in ["front", "back"] {
        let s = format!("skirt_{side}");
        for e in ["waist_0", "waist_1", "waist_2"] {
            seams.push(sewn([side, e], [&s, e]));
        }
    }
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
        finished: [bodice.half * 4.0, waist * 4.0, sector.girth(HIP_DEPTH)],
    })
}
