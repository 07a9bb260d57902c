//! Tops: T-shirt, long-sleeved shirt, tank top, hooded top.

use super::cuts::{HoodCut, SleeveCut, TopCut};
use super::draft::{DraftEdge, flip, mirrored, panel, sewn};
use crate::{
    Anchor, Curve, GarmentError, GarmentKind, Material, Panel, Pattern, Placement, Seam, Side,
    SizeRow,
};

/// Iterations for the height of a sleeve cap.
const CAP_ITERATIONS: usize = 40;

/// Edges of a panel above the armpits, from paper right to left: armholes, shoulders and a neckline `drop` metres deep.
/// Points are those of the right side, the last pair the control points of the armhole.
pub(super) fn yoke(
    high: [f64; 2],
    tip: [f64; 2],
    underarm: [f64; 2],
    drop: f64,
    [lower, upper]: [[f64; 2]; 2],
) -> [DraftEdge<'static>; 6] {
    let flip = |p: [f64; 2]| [-p[0], p[1]];
    let neck = high[0];
    [
        ("armhole_right", underarm, Curve::Cubic(lower, upper)),
        ("shoulder_right", tip, Curve::Line),
        (
            "neck_right",
            high,
            Curve::Cubic([neck * 0.93, -drop * 0.62], [neck * 0.5, -drop]),
        ),
        (
            "neck_left",
            [0.0, -drop],
            Curve::Cubic([-neck * 0.5, -drop], [-neck * 0.93, -drop * 0.62]),
        ),
        ("shoulder_left", flip(high), Curve::Line),
        (
            "armhole_left",
            flip(tip),
            Curve::Cubic(flip(upper), flip(lower)),
        ),
    ]
}

/// A top of this fabric.
pub(super) fn draft(
    row: &SizeRow,
    name: &str,
    fabric: &str,
    cut: &TopCut,
) -> Result<Pattern, GarmentError> {
    let half = (row.body.chest + cut.ease[0]) / 4.0; // half width of the front panel
    let hem = (row.body.hip.max(row.body.chest) + cut.ease[1]) / 4.0;
    let neck = row.neck / 5.0 + cut.neck;
    let tip = if cut.strap > 0.0 {
        neck + cut.strap
    } else {
        row.shoulders / 2.0 + 0.005
    };
    let fall = cut.shoulder_fall * ((tip - neck) / (row.shoulders / 2.0 - row.neck / 5.0)).min(1.0);
    let armpit = -(row.body.chest / 8.0 + cut.scye);
    let length = -(row.trunk + cut.longer);
    let body = |name: &str, placement, drop: f64| {
        // Control points of a hollow armhole, from the underarm point to the shoulder tip.
        let lower = [tip - 0.02, armpit + 0.01];
        let upper = [tip - 0.028_f64.min(0.3 * (half - tip).abs()), armpit * 0.55];
        let (hp, st, ua, he) = ([neck, 0.0], [tip, -fall], [half, armpit], [hem, length]);
        panel(
            name,
            placement,
            &[
                &[
                    ("hem", flip(he), Curve::Line),
                    ("side_right", he, Curve::Line),
                ],
                &yoke(hp, st, ua, drop, [lower, upper])[..],
                &[("side_left", flip(ua), Curve::Line)],
            ]
            .concat(),
        )
    };
    // `right` and `left` are sides of the paper. On the front, paper right is the body's left.
    let front = body("front", Placement::TrunkFront, cut.drop[0]);
    let back = body("back", Placement::TrunkBack, cut.drop[1]);
    let mut seams = trunk_seams();
    let mut panels = vec![front, back];
    if let Some(s) = &cut.sleeve {
        sleeves(row, s, &mut panels, &mut seams);
    }
    if let Some(h) = &cut.hood {
        hood(h, &mut panels, &mut seams);
    }
    Ok(Pattern {
        name: name.into(),
        kind: GarmentKind::Top,
        size: row.size,
        panels,
        seams,
        darts: vec![],
        trims: vec![],
        anchors: vec![shoulders()],
        material: Material::preset(fabric)?,
        layer: 1,
        finished: [half * 4.0, 0.0, hem * 4.0],
    })
}

/// Side and shoulder seams of a front and a back.
pub(super) fn trunk_seams() -> Vec<Seam> {
    vec![
        sewn(["front", "side_right"], ["back", "side_left"]),
        sewn(["front", "side_left"], ["back", "side_right"]),
        sewn(["front", "shoulder_right"], ["back", "shoulder_left"]),
        sewn(["front", "shoulder_left"], ["back", "shoulder_right"]),
    ]
}

/// Anchor of a top.
pub(super) fn shoulders() -> Anchor {
    Anchor {
        name: "shoulders".into(),
        edges: vec![
            ["front".into(), "shoulder_right".into()],
            ["front".into(), "shoulder_left".into()],
        ],
        strength: 0.5,
    }
}

/// Length of an edge, metres.
fn length_of(p: &Panel, edge: &str) -> f64 {
    p.edge(edge).map_or(0.0, |i| p.edges[i].length(p.end(i)))
}

/// Adds two sleeves whose caps fit the armholes.
fn sleeves(row: &SizeRow, cut: &SleeveCut, panels: &mut Vec<Panel>, seams: &mut Vec<Seam>) {
    let hole =
        0.5 * (length_of(&panels[0], "armhole_right") + length_of(&panels[1], "armhole_right"));
    let bicep = (row.upper_arm + cut.ease) / 2.0; // half width of the sleeve at the underarm
    let length = cut.length.unwrap_or(row.arm);
    let cuff = bicep * cut.cuff;
    let cap_length = hole * cut.cap_ease;
    let mut cap = 0.10;
    let build = |cap: f64| {
        let (l, r, top) = ([-bicep, -cap], [bicep, -cap], [0.0, 0.0]);
        panel(
            "sleeve_left",
            Placement::Sleeve(Side::Left),
            &[
                ("cuff", [-cuff, -length], Curve::Line),
                ("under_right", [cuff, -length], Curve::Line),
                (
                    "cap_right",
                    r,
                    Curve::Cubic([bicep * 0.62, -cap * 0.93], [bicep * 0.50, 0.0]),
                ),
                (
                    "cap_left",
                    top,
                    Curve::Cubic([-bicep * 0.50, 0.0], [-bicep * 0.62, -cap * 0.93]),
                ),
                ("under_left", l, Curve::Line),
            ],
        )
    };
    // Fixed-point iteration for the cap height at which each half of the cap curve has this length.
    for _ in 0..CAP_ITERATIONS {
        cap = (cap + (cap_length - length_of(&build(cap), "cap_right"))).clamp(0.02, 0.3);
    }
    let left = build(cap);
    let right = mirrored(&left, "sleeve_right", Placement::Sleeve(Side::Right));
    panels.extend([left, right]);
    seams.extend([
        // Left sleeve: its +x is the back. Right sleeve, mirrored with its names: `…_right` lies at −x, the back.
        sewn(["sleeve_left", "cap_right"], ["back", "armhole_left"]),
        sewn(["sleeve_left", "cap_left"], ["front", "armhole_right"]),
        sewn(["sleeve_right", "cap_right"], ["back", "armhole_right"]),
        sewn(["sleeve_right", "cap_left"], ["front", "armhole_left"]),
        sewn(
            ["sleeve_left", "under_right"],
            ["sleeve_left", "under_left"],
        ),
        sewn(
            ["sleeve_right", "under_right"],
            ["sleeve_right", "under_left"],
        ),
    ]);
}

/// Adds the two halves of a hood, sewn along the crown and to the neckline.
fn hood(cut: &HoodCut, panels: &mut Vec<Panel>, seams: &mut Vec<Seam>) {
    let (b, f) = (
        length_of(&panels[1], "neck_right"),
        length_of(&panels[0], "neck_right"),
    );
    // Seen from the body's right: x runs to the front, the seam along neck and crown starts at the nape.
    let dip = 0.03; // the front of a neckline lies lower
    let right = panel(
        "hood_right",
        Placement::Hood(Side::Right),
        &[
            ("neck_back", [0.0, 0.0], Curve::Line),
            ("neck_front", [b, 0.0], Curve::Line),
            (
                "face",
                [b + (f * f - dip * dip).max(0.0).sqrt(), -dip],
                Curve::Line,
            ),
            (
                "crown",
                [cut.depth * 0.98, cut.height],
                Curve::Cubic(
                    [cut.depth * 0.30, cut.height * 1.08],
                    [-0.14, cut.height * 0.62],
                ),
            ),
        ],
    );
    let left = mirrored(&right, "hood_left", Placement::Hood(Side::Left));
    panels.extend([right, left]);
    seams.extend([
        sewn(["hood_right", "crown"], ["hood_left", "crown"]),
        // On the front, paper left is the body's right; on the back, paper right.
        sewn(["hood_right", "neck_back"], ["back", "neck_right"]),
        sewn(["hood_right", "neck_front"], ["front", "neck_left"]),
        sewn(["hood_left", "neck_back"], ["back", "neck_left"]),
        sewn(["hood_left", "neck_front"], ["front", "neck_right"]),
    ]);
}
