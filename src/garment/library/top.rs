//! T-shirt and long-sleeved shirt: front, back, two sleeves.

use super::{mirrored, panel, sewn};
use crate::garment::{Anchor, Curve, GarmentError, GarmentKind, Material, Pattern, Placement, Side, SizeRow};

/// Ease over the body's chest, metres: a regular-fit T-shirt has 8 to 12 cm.
const CHEST_EASE: f64 = 0.10;
/// Drop of the front and back neckline below the high point of the shoulder, metres.
const NECK_DROP: [f64; 2] = [0.085, 0.025];
/// Fall of the shoulder seam from neck to tip, metres.
const SHOULDER_FALL: f64 = 0.045;
/// Ease over the upper arm, metres.
const ARM_EASE: f64 = 0.085;

pub(super) fn shirt(row: &SizeRow, long: bool) -> Result<Pattern, GarmentError> {
    let half = (row.body.chest + CHEST_EASE) / 4.0; // half width of the front panel
    let hem = (row.body.hip.max(row.body.chest) + 0.08) / 4.0;
    let neck = row.neck / 5.0 + 0.012; // half width of the neck opening (a fifth of the neck girth, and room for the rib)
    let tip = row.shoulders / 2.0 + 0.005;
    let armpit = -(row.body.chest / 8.0 + 0.105); // scye depth: an eighth of the chest and 10.5 cm
    let length = -(row.trunk + 0.04);
    let body = |name: &str, placement, drop: f64| {
        // Armhole: from the underarm point up to the shoulder tip, hollowed out.
        let lower = [tip - 0.02, armpit + 0.01];
        let upper = [tip - 0.028, armpit * 0.55];
        let flip = |p: [f64; 2]| [-p[0], p[1]];
        let (hp, st, ua, he) = ([neck, 0.0], [tip, -SHOULDER_FALL], [half, armpit], [hem, length]);
        panel(
            name,
            placement,
            &[
                ("hem", flip(he), Curve::Line),
                ("side_right", he, Curve::Line),
                ("armhole_right", ua, Curve::Cubic(lower, upper)),
                ("shoulder_right", st, Curve::Line),
                ("neck_right", hp, Curve::Cubic([neck * 0.93, -drop * 0.62], [neck * 0.5, -drop])),
                ("neck_left", [0.0, -drop], Curve::Cubic([-neck * 0.5, -drop], [-neck * 0.93, -drop * 0.62])),
                ("shoulder_left", flip(hp), Curve::Line),
                ("armhole_left", flip(st), Curve::Cubic(flip(upper), flip(lower))),
                ("side_left", flip(ua), Curve::Line),
            ],
        )
    };
    // Here `right` and `left` are the sides of the paper. On the front, paper right is the wearer's left.
    let front = body("front", Placement::TrunkFront, NECK_DROP[0]);
    let back = body("back", Placement::TrunkBack, NECK_DROP[1]);
    let hole = front.edge("armhole_right").map_or(0.0, |i| front.edges[i].length(front.end(i)));
    let bicep = (row.upper_arm + ARM_EASE) / 2.0; // half width of the sleeve at the underarm
    let (sleeve_length, cuff) = if long { (row.arm + 0.02, bicep * 0.62) } else { (0.215, bicep * 0.93) };
    // Cap height from Pythagoras: the two halves of the cap curve are as long as an armhole with a little ease.
    let cap_length = hole * 1.02;
    let mut cap = 0.10;
    let build = |cap: f64| {
        let (l, r, top) = ([-bicep, -cap], [bicep, -cap], [0.0, 0.0]);
        panel(
            "sleeve_left",
            Placement::Sleeve(Side::Left),
            &[
                ("cuff", [-cuff, -sleeve_length], Curve::Line),
                ("under_right", [cuff, -sleeve_length], Curve::Line),
                ("cap_right", r, Curve::Cubic([bicep * 0.62, -cap * 0.93], [bicep * 0.50, 0.0])),
                ("cap_left", top, Curve::Cubic([-bicep * 0.50, 0.0], [-bicep * 0.62, -cap * 0.93])),
                ("under_left", l, Curve::Line),
            ],
        )
    };
    for _ in 0..40 {
        let p = build(cap);
        let now = p.edges[2].length(p.end(2));
        cap = (cap + (cap_length - now)).clamp(0.02, 0.3);
    }
    let left = build(cap);
    let right = mirrored(&left, "sleeve_right", Placement::Sleeve(Side::Right));
    let name = if long { "longsleeve" } else { "tshirt" };
    Ok(Pattern {
        name: name.into(),
        kind: GarmentKind::Top,
        size: row.size,
        panels: vec![front, back, left, right],
        seams: vec![
            sewn(["front", "side_right"], ["back", "side_left"]),
            sewn(["front", "side_left"], ["back", "side_right"]),
            sewn(["front", "shoulder_right"], ["back", "shoulder_left"]),
            sewn(["front", "shoulder_left"], ["back", "shoulder_right"]),
            // Left sleeve: its +x is the back. Right sleeve, mirrored with its names: `…_right` lies at −x, the back.
            sewn(["sleeve_left", "cap_right"], ["back", "armhole_left"]),
            sewn(["sleeve_left", "cap_left"], ["front", "armhole_right"]),
            sewn(["sleeve_right", "cap_right"], ["back", "armhole_right"]),
            sewn(["sleeve_right", "cap_left"], ["front", "armhole_left"]),
            sewn(["sleeve_left", "under_right"], ["sleeve_left", "under_left"]),
            sewn(["sleeve_right", "under_right"], ["sleeve_right", "under_left"]),
        ],
        anchors: vec![Anchor {
            name: "shoulders".into(),
            edges: vec![["front".into(), "shoulder_right".into()], ["front".into(), "shoulder_left".into()]],
            strength: 0.5,
        }],
        material: Material::preset(if long { "cotton" } else { "jersey" })?,
        layer: 1,
        finished: [half * 4.0, 0.0, hem * 4.0],
    })
}
