//! Straight trousers and shorts: two fronts, two backs.

use super::{mirrored, panel, sewn};
use crate::garment::{
    Anchor, Curve, GarmentError, GarmentKind, Material, Pattern, Placement, Side, SizeRow,
};

/// Ease at the waist, metres.
const WAIST_EASE: f64 = 0.02;
/// Ease at the hip, metres.
const HIP_EASE: f64 = 0.055;
/// Crotch of the cloth below that of the body, metres.
const RISE_EASE: f64 = 0.015;
/// How far the crotch reaches beyond the centre line, as a share of the hip: front and back.
const CROTCH: [f64; 2] = [0.045, 0.085];

/// Inseam of shorts, metres.
const SHORT: f64 = 0.20;

pub(super) fn long(row: &SizeRow) -> Result<Pattern, GarmentError> {
    draw(row, "trousers", "denim", row.inseam, 0.64)
}
pub(super) fn shorts(row: &SizeRow) -> Result<Pattern, GarmentError> {
    draw(row, "shorts", "twill", SHORT, 0.96)
}

/// `taper` is the width at the hem over that at the crotch.
fn draw(
    row: &SizeRow,
    name: &str,
    fabric: &str,
    inseam: f64,
    taper: f64,
) -> Result<Pattern, GarmentError> {
    let hip = (row.body.hip + HIP_EASE) / 4.0; // width of one of four panels at the hip
    let waist = (row.body.waist + WAIST_EASE) / 4.0;
    let rise = -(row.rise + RISE_EASE);
    let hip_line = rise * 0.68;
    let hem = rise - inseam;
    // Left leg: x = 0 is the centre line of the body, outer side at +x, as seen from the front.
    let leg = |name: &str, placement, crotch: f64| {
        let inner = -crotch * row.body.hip;
        let crease = (hip + inner) / 2.0;
        let cuff = (hip - inner) * taper / 2.0; // half width of the hem
        let (co, wo) = ([hip, rise], [waist, 0.0]);
        panel(
            name,
            placement,
            &[
                ("hem", [crease - cuff, hem], Curve::Line),
                ("outseam", [crease + cuff, hem], Curve::Line),
                (
                    "outseam_top",
                    co,
                    Curve::Cubic(
                        [hip, rise * 0.62],
                        [waist + (hip - waist) * 0.75, hip_line * 0.35],
                    ),
                ),
                ("waist", wo, Curve::Line),
                ("centre", [0.0, 0.0], Curve::Line),
                (
                    "crotch",
                    [0.0, hip_line],
                    Curve::Cubic([0.0, rise * 0.90], [inner * 0.35, rise]),
                ),
                ("inseam", [inner, rise], Curve::Line),
            ],
        )
    };
    let fl = leg("front_left", Placement::LegFront(Side::Left), CROTCH[0]);
    let fr = mirrored(&fl, "front_right", Placement::LegFront(Side::Right));
    // A back panel is seen from behind: the wearer's left leg has its outer side at −x.
    let template = leg("back_right", Placement::LegBack(Side::Right), CROTCH[1]);
    let bl = mirrored(&template, "back_left", Placement::LegBack(Side::Left));
    let mut seams = Vec::new();
    for side in ["left", "right"] {
        let (f, b) = (format!("front_{side}"), format!("back_{side}"));
        for e in ["outseam", "outseam_top", "inseam"] {
            seams.push(sewn([&f, e], [&b, e]));
        }
    }
    for e in ["centre", "crotch"] {
        seams.push(sewn(["front_left", e], ["front_right", e]));
        seams.push(sewn(["back_left", e], ["back_right", e]));
    }
    let edge = |p: &str| [p.to_owned(), "waist".to_owned()];
    Ok(Pattern {
        name: name.into(),
        kind: GarmentKind::Trousers,
        size: row.size,
        panels: vec![fl, fr, bl, template],
        seams,
        darts: vec![],
        anchors: vec![Anchor {
            name: "waist".into(),
            edges: vec![
                edge("front_left"),
                edge("front_right"),
                edge("back_left"),
                edge("back_right"),
            ],
            strength: 1.0,
        }],
        material: Material::preset(fabric)?,
        layer: 0,
        finished: [0.0, waist * 4.0, hip * 4.0],
    })
}
