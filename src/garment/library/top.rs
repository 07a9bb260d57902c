//! What hangs from the shoulders: T-shirt, long-sleeved shirt, tank top, hooded top.

use super::{mirrored, panel, sewn};
use crate::garment::{
    Anchor, Curve, GarmentError, GarmentKind, Material, Panel, Pattern, Placement, Seam, Side,
    SizeRow,
};

/// Fall of the shoulder seam from neck to tip, metres.
pub(super) const SHOULDER_FALL: f64 = 0.045;

/// What one top has and another has not. Metres.
struct Cut {
    name: &'static str,
    fabric: &'static str,
    /// Ease over the body's chest and hip.
    ease: [f64; 2],
    /// Half width of the neck opening beyond a fifth of the neck girth (the draughting rule of Aldrich 2015).
    neck: f64,
    /// Drop of the front and back neckline below the high point of the shoulder.
    drop: [f64; 2],
    /// Width of the shoulder seam; zero runs to the shoulder tip.
    strap: f64,
    /// Below an eighth of the chest: scye depth.
    scye: f64,
    /// Below the hip line.
    longer: f64,
    sleeve: Option<Sleeve>,
    hood: bool,
}

/// Metres.
struct Sleeve {
    /// Ease over the upper arm.
    ease: f64,
    /// Length from the shoulder tip; `None` to the wrist.
    length: Option<f64>,
    /// Width at the cuff over width at the underarm: of long sleeves half, wider ones slide to the elbow
    /// (docs/benchmarks.md).
    cuff: f64,
}

const TSHIRT: Cut = Cut {
    name: "tshirt",
    fabric: "jersey",
    ease: [0.10, 0.08], // a regular-fit T-shirt has 8 to 12 cm at the chest
    neck: 0.012,
    drop: [0.085, 0.022],
    strap: 0.0,
    scye: 0.105,
    longer: 0.045,
    sleeve: Some(Sleeve {
        ease: 0.085,
        length: Some(0.215),
        cuff: 0.93,
    }),
    hood: false,
};
const LONGSLEEVE: Cut = Cut {
    name: "longsleeve",
    fabric: "cotton",
    sleeve: Some(Sleeve {
        ease: 0.085,
        length: None,
        cuff: 0.50,
    }),
    ..TSHIRT
};
const TANK: Cut = Cut {
    name: "tank",
    ease: [0.05, 0.04],
    neck: 0.035,
    drop: [0.125, 0.065],
    strap: 0.052,
    scye: 0.105,
    longer: 0.03,
    sleeve: None,
    ..TSHIRT
};
const HOODIE: Cut = Cut {
    name: "hoodie",
    fabric: "fleece",
    ease: [0.16, 0.09],
    neck: 0.020,
    drop: [0.085, 0.020],
    scye: 0.125,
    longer: 0.04,
    sleeve: Some(Sleeve {
        ease: 0.12,
        length: None,
        cuff: 0.50,
    }),
    hood: true,
    ..TSHIRT
};

pub(super) fn tshirt(row: &SizeRow) -> Result<Pattern, GarmentError> {
    draw(row, &TSHIRT)
}
pub(super) fn longsleeve(row: &SizeRow) -> Result<Pattern, GarmentError> {
    draw(row, &LONGSLEEVE)
}
pub(super) fn tank(row: &SizeRow) -> Result<Pattern, GarmentError> {
    draw(row, &TANK)
}
pub(super) fn hoodie(row: &SizeRow) -> Result<Pattern, GarmentError> {
    draw(row, &HOODIE)
}

/// The edges of a panel above the armpits, from the right one to the left: armholes, shoulders and a neckline `drop`
/// metres deep. Right side of the high point of the shoulder, its tip, the underarm point, and the armhole's control points.
pub(super) fn yoke(
    high: [f64; 2],
    tip: [f64; 2],
    underarm: [f64; 2],
    drop: f64,
    [lower, upper]: [[f64; 2]; 2],
) -> [(&'static str, [f64; 2], Curve); 6] {
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

fn draw(row: &SizeRow, cut: &Cut) -> Result<Pattern, GarmentError> {
    let half = (row.body.chest + cut.ease[0]) / 4.0; // half width of the front panel
    let hem = (row.body.hip.max(row.body.chest) + cut.ease[1]) / 4.0;
    let neck = row.neck / 5.0 + cut.neck;
    let tip = if cut.strap > 0.0 {
        neck + cut.strap
    } else {
        row.shoulders / 2.0 + 0.005
    };
    let fall = SHOULDER_FALL * ((tip - neck) / (row.shoulders / 2.0 - row.neck / 5.0)).min(1.0);
    let armpit = -(row.body.chest / 8.0 + cut.scye);
    let length = -(row.trunk + cut.longer);
    let body = |name: &str, placement, drop: f64| {
        // Armhole: from the underarm point up to the shoulder tip, hollowed out.
        let lower = [tip - 0.02, armpit + 0.01];
        let upper = [tip - 0.028_f64.min(0.3 * (half - tip).abs()), armpit * 0.55];
        let flip = |p: [f64; 2]| [-p[0], p[1]];
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
    // Here `right` and `left` are the sides of the paper. On the front, paper right is the wearer's left.
    let front = body("front", Placement::TrunkFront, cut.drop[0]);
    let back = body("back", Placement::TrunkBack, cut.drop[1]);
    let mut seams = trunk_seams();
    let mut panels = vec![front, back];
    if let Some(s) = &cut.sleeve {
        sleeves(row, s, &mut panels, &mut seams);
    }
    if cut.hood {
        hood(&mut panels, &mut seams);
    }
    Ok(Pattern {
        name: cut.name.into(),
        kind: GarmentKind::Top,
        size: row.size,
        panels,
        seams,
        darts: vec![],
        anchors: vec![shoulders()],
        material: Material::preset(cut.fabric)?,
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

/// What a top hangs on.
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

fn length_of(p: &Panel, edge: &str) -> f64 {
    p.edge(edge).map_or(0.0, |i| p.edges[i].length(p.end(i)))
}

fn sleeves(row: &SizeRow, cut: &Sleeve, panels: &mut Vec<Panel>, seams: &mut Vec<Seam>) {
    let hole =
        0.5 * (length_of(&panels[0], "armhole_right") + length_of(&panels[1], "armhole_right"));
    let bicep = (row.upper_arm + cut.ease) / 2.0; // half width of the sleeve at the underarm
    let length = cut.length.unwrap_or(row.arm);
    let cuff = bicep * cut.cuff;
    // Cap height such that the two halves of the cap curve are as long as an armhole with a little ease.
    let cap_length = hole * 1.02;
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
    for _ in 0..40 {
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

/// Height of a hood from the neckline to its top, metres: head height and room.
const HOOD_HEIGHT: f64 = 0.355;
/// Depth of a hood at its widest, metres.
const HOOD_DEPTH: f64 = 0.245;

/// Two mirrored halves, sewn along the crown and to the neckline.
fn hood(panels: &mut Vec<Panel>, seams: &mut Vec<Seam>) {
    let (b, f) = (
        length_of(&panels[1], "neck_right"),
        length_of(&panels[0], "neck_right"),
    );
    // Seen from the wearer's right: x runs to the front, the seam along neck and crown starts at the nape.
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
                [HOOD_DEPTH * 0.98, HOOD_HEIGHT],
                Curve::Cubic(
                    [HOOD_DEPTH * 0.30, HOOD_HEIGHT * 1.08],
                    [-0.14, HOOD_HEIGHT * 0.62],
                ),
            ),
        ],
    );
    let left = mirrored(&right, "hood_left", Placement::Hood(Side::Left));
    panels.extend([right, left]);
    seams.extend([
        sewn(["hood_right", "crown"], ["hood_left", "crown"]),
        // On the front, paper left is the wearer's right; on the back, paper right.
        sewn(["hood_right", "neck_back"], ["back", "neck_right"]),
        sewn(["hood_right", "neck_front"], ["front", "neck_left"]),
        sewn(["hood_left", "neck_back"], ["back", "neck_left"]),
        sewn(["hood_left", "neck_front"], ["front", "neck_right"]),
    ]);
}
