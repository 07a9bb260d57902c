//! Straight trousers and shorts: two fronts, two backs.

use super::cuts::TrousersCut;
use super::draft::{mirrored, panel, sewn};
use crate::{
    Anchor, Curve, GarmentError, GarmentKind, Material, Panel, Pattern, Placement, Side, SizeRow,
};

/// Measures of a leg, metres. A panel has x = 0 at the centre line of the body.
struct LegCut {
    /// Width of one of four panels at the hip and at the waist.
    hip: f64,
    waist: f64,
    /// Heights of crotch, hip line and hem below the waist, negative.
    rise: f64,
    hip_line: f64,
    hem: f64,
    /// Width at the hem over that at the crotch.
    taper: f64,
}

impl LegCut {
    /// A panel with its outer side at +x whose crotch extends `crotch` metres beyond the centre line.
    fn panel(&self, name: &str, placement: Placement, crotch: f64) -> Panel {
        let Self {
            hip,
            waist,
            rise,
            hip_line,
            hem,
            taper,
        } = *self;
        let inner = -crotch;
        let crease = (hip + inner) / 2.0;
        let cuff = (hip - inner) * taper / 2.0; // half width of the hem
        let outseam_top = Curve::Cubic(
            [hip, rise * 0.62],
            [waist + (hip - waist) * 0.75, hip_line * 0.35],
        );
        let crotch = Curve::Cubic([0.0, rise * 0.90], [inner * 0.35, rise]);
        let edges = [
            ("hem", [crease - cuff, hem], Curve::Line),
            ("outseam", [crease + cuff, hem], Curve::Line),
            ("outseam_top", [hip, rise], outseam_top),
            ("waist", [waist, 0.0], Curve::Line),
            ("centre", [0.0, 0.0], Curve::Line),
            ("crotch", [0.0, hip_line], crotch),
            ("inseam", [inner, rise], Curve::Line),
        ];
        panel(name, placement, &edges)
    }
}

/// Trousers or shorts of this fabric.
pub(super) fn draft(
    row: &SizeRow,
    name: &str,
    fabric: &str,
    cut: &TrousersCut,
) -> Result<Pattern, GarmentError> {
    let rise = -(row.rise + cut.rise_ease);
    let leg = LegCut {
        hip: (row.body.hip + cut.hip_ease) / 4.0,
        waist: (row.body.waist + cut.waist_ease) / 4.0,
        rise,
        hip_line: rise * 0.68,
        hem: rise - cut.inseam.unwrap_or(row.inseam),
        taper: cut.taper,
    };
    let crotch = cut.crotch.map(|share| share * row.body.hip);
    let front = Placement::LegFront;
    let fl = leg.panel("front_left", front(Side::Left), crotch[0]);
    let fr = mirrored(&fl, "front_right", front(Side::Right));
    // A back panel is seen from behind: the body's left leg has its outer side at −x.
    let back = Placement::LegBack;
    let br = leg.panel("back_right", back(Side::Right), crotch[1]);
    let bl = mirrored(&br, "back_left", back(Side::Left));
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
    let panels = vec![fl, fr, bl, br];
    let waist = panels.iter().map(|p| [p.name.clone(), "waist".into()]);
    Ok(Pattern {
        name: name.into(),
        kind: GarmentKind::Trousers,
        size: row.size,
        seams,
        darts: vec![],
        trims: vec![],
        anchors: vec![Anchor {
            name: "waist".into(),
            edges: waist.collect(),
            strength: 1.0,
        }],
        material: Material::preset(fabric)?,
        layer: 0,
        finished: [0.0, leg.waist * 4.0, leg.hip * 4.0],
        panels,
    })
}
