//! A sleeveless dress: bodice shaped by waist darts, flared skirt to the knee.

use super::cuts::DressCut;
use super::draft::{flip, panel, sewn};
use super::skirt::{Sector, darts, flare};
use super::top::{shoulders, trunk_seams, yoke};
use crate::{
    Anchor, Curve, GarmentError, GarmentKind, Material, Panel, Pattern, Placement, SizeRow,
};

/// Measures of the bodice, metres.
struct Bodice<'a> {
    cut: &'a DressCut,
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

impl Bodice<'_> {
    /// The front (0) or the back (1).
    fn panel(&self, name: &str, placement: Placement, k: usize) -> Panel {
        let Self {
            cut,
            half,
            cut_waist,
            neck,
            tip,
            armpit,
            length,
        } = *self;
        let (high, shoulder) = ([neck, 0.0], [tip, -cut.shoulder_fall]);
        let (underarm, waist) = ([half, armpit], [cut_waist, length]);
        let (at, dart, depth) = (cut_waist * cut.dart_at, cut.dart, cut.dart_depth[k]);
        let (inner, apex, outer) = (
            [at - dart / 2.0, length],
            [at, length + depth],
            [at + dart / 2.0, length],
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
            &yoke(high, shoulder, underarm, cut.drop[k], [lower, upper])[..],
            &[("side_left", flip(underarm), Curve::Line)],
        ];
        panel(name, placement, &edges.concat())
    }
}

/// A flared dress.
pub(super) fn flared(row: &SizeRow, cut: &DressCut) -> Result<Pattern, GarmentError> {
    let waist = (row.body.waist + cut.skirt.waist_ease) / 4.0; // half width of a panel once sewn
    let bodice = Bodice {
        cut,
        half: (row.body.chest + cut.chest_ease) / 4.0,
        cut_waist: waist + cut.dart,
        neck: row.neck / 5.0 + cut.neck,
        tip: row.shoulders / 2.0 - cut.inset,
        armpit: -(row.body.chest / 8.0 + cut.scye),
        length: -(row.trunk - cut.skirt.hip_depth + cut.longer),
    };
    let skirt_waist = 2.0 * waist;
    let half_angle = flare(
        skirt_waist,
        (row.body.hip + cut.skirt.hip_ease) / 2.0,
        &cut.skirt,
    );
    // The waist of the skirt is divided at the darts of the bodice.
    let dart = bodice.cut_waist * cut.dart_at + cut.dart / 2.0;
    let side = (bodice.cut_waist - dart) / skirt_waist;
    let cuts = [side, 1.0 - side];
    let sector = Sector {
        waist: skirt_waist,
        half_angle,
        length: cut.skirt.length,
        cuts: &cuts,
    };
    let panels = vec![
        bodice.panel("front", Placement::TrunkFront, 0),
        bodice.panel("back", Placement::TrunkBack, 1),
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
        trims: vec![],
        anchors: vec![Anchor {
            strength: 0.5,
            ..shoulders()
        }],
        material: Material::preset("cotton")?,
        layer: 1,
        finished: [
            bodice.half * 4.0,
            waist * 4.0,
            sector.girth(cut.skirt.hip_depth),
        ],
    })
}
