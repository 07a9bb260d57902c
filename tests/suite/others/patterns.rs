//! Sewing patterns of other programs: placed by geometry and seams, and worn.
//!
//! Oracle of "worn": the winding number of the cloth around a bone of the body, in a plane across the bone. A sleeve goes
//! once around its arm, a skirt once around each leg and around both, and nothing goes around the other arm.

use crate::common::arms_down;
use nalgebra::{Point3, Vector3};
use std::path::{Path, PathBuf};
use tryon::body::{BodyShape, BoneTransforms, embedded};
use tryon::dressing::{DressOptions, Dressed, dress};
use tryon::formats::garmentcode::parse_garmentcode;
use tryon::formats::shared_data;
use tryon::garment::import::from_garmentcode;
use tryon::garment::{GarmentKind, Material, Pattern, Placement, Side, Size};

/// Turns that openings of the garment far off the bone, a neckline or a hem, add at most.
const OPEN: f64 = 0.25;

fn import(text: &str, name: &str) -> Result<Pattern, String> {
    let raw = parse_garmentcode(text, Path::new(name)).map_err(|e| e.to_string())?;
    let cotton = Material::preset("cotton").expect("preset");
    from_garmentcode(&raw, name, Size::M, cotton).map_err(|e| e.to_string())
}

fn drafted(name: &str) -> Pattern {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("others/garmentcode");
    let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).expect("a design");
    import(&text, name).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A garment on the average body, and the body's joints.
struct Worn {
    name: String,
    dressed: Dressed,
    joints: Vec<(String, Point3<f64>)>,
    floor: f64,
}

impl Worn {
    fn new(pattern: &Pattern) -> Self {
        let t = embedded::template();
        let rest = t.personalise(&BodyShape::default());
        let pose = arms_down(&t, &rest);
        let garments = [pattern.clone()];
        let dressed = dress(&t, &rest, &pose, &garments, &DressOptions::default());
        let dressed = dressed.unwrap_or_else(|e| panic!("{}: {e}", pattern.name));
        assert_eq!(dressed.report.crossings, 0, "{}", pattern.name);
        let (mut bones, mut skin) = (BoneTransforms::default(), Vec::new());
        t.skin_pose(&rest, &pose, &mut bones, &mut skin);
        let names = t.skeleton().joints().iter().map(|j| j.name.clone());
        let floor = skin.iter().map(|p| f64::from(p.y)).fold(f64::MAX, f64::min);
        Self {
            name: pattern.name.clone(),
            dressed,
            joints: names.zip(bones.joints.iter().copied()).collect(),
            floor,
        }
    }
    fn joint(&self, name: &str) -> Point3<f64> {
        let found = self.joints.iter().find(|(n, _)| n == name);
        found.unwrap_or_else(|| panic!("joint {name}")).1
    }
    /// Lowest and highest point over the floor, metres.
    fn heights(&self) -> [f64; 2] {
        let x = &self.dressed.state.garments[0].positions;
        let heights = x.iter().map(|p| f64::from(p.y) - self.floor);
        heights.fold([f64::MAX, f64::MIN], |[l, h], y| [l.min(y), h.max(y)])
    }
    /// Turns of the cloth around a bone at a share of the way from one joint to the other.
    fn around(&self, from: &str, to: &str, share: f64) -> f64 {
        let (a, b) = (self.joint(from), self.joint(to));
        self.turns(a + (b - a) * share, b - a)
    }
    /// Turns of the cloth around a line through a point, in the plane across it.
    fn turns(&self, at: Point3<f64>, along: Vector3<f64>) -> f64 {
        let n = along.normalize();
        let u = n
            .cross(&Vector3::z())
            .try_normalize(1e-6)
            .unwrap_or_else(Vector3::x);
        let v = n.cross(&u);
        let g = &self.dressed.model.outfit.garments[0];
        let x = &self.dressed.state.garments[0].positions;
        let mut total = 0.0;
        for f in &g.faces {
            let p = f.map(|i| x[i as usize].cast::<f64>() - at);
            let d = p.map(|q| q.dot(&n));
            let cut = |i: usize, j: usize| {
                let q = p[i] + (p[j] - p[i]) * (d[i] / (d[i] - d[j]));
                q.dot(&v).atan2(q.dot(&u))
            };
            // In through the edge that rises over the plane, out through the one that falls.
            let edges = [(0, 1), (1, 2), (2, 0)];
            let rising = edges.iter().find(|(i, j)| d[*i] < 0.0 && d[*j] >= 0.0);
            let falling = edges.iter().find(|(i, j)| d[*i] >= 0.0 && d[*j] < 0.0);
            if let (Some(r), Some(f)) = (rising, falling) {
                let turn = cut(f.0, f.1) - cut(r.0, r.1);
                total += turn.sin().atan2(turn.cos());
            }
        }
        total.abs() / std::f64::consts::TAU
    }
    fn check(&self, what: &str, turns: f64, expected: f64) {
        assert!(
            (turns - expected).abs() < OPEN,
            "{}: {turns:.2} turns around {what}",
            self.name
        );
    }
    /// Checks the turns around both thighs.
    fn thighs(&self, expected: f64) {
        for side in ["left", "right"] {
            let turns = self.around(&format!("{side}_hip"), &format!("{side}_knee"), 0.6);
            self.check(&format!("the {side} thigh"), turns, expected);
        }
    }
    /// Checks the turns around both upper arms, and one around the waist.
    fn arms_and_waist(&self, expected: f64) {
        for side in ["left", "right"] {
            let turns = self.around(&format!("{side}_shoulder"), &format!("{side}_elbow"), 0.5);
            self.check(&format!("the {side} arm"), turns, expected);
        }
        let hips = nalgebra::center(&self.joint("left_hip"), &self.joint("right_hip"));
        let waist = hips + Vector3::y() * 0.19;
        self.check("the waist", self.turns(waist, Vector3::y()), 1.0);
    }
}

fn has(p: &Pattern, wanted: Placement) -> usize {
    p.panels.iter().filter(|q| q.placement == wanted).count()
}

#[test]
fn a_top_named_front_and_back_and_a_skirt_with_a_waistband_are_worn() {
    let Some(folder) = shared_data("reports/garmentcode_names") else {
        return;
    };
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a pattern");
    let top = import(&read("front_back.json"), "front_back").expect("a top");
    assert_eq!(top.kind, GarmentKind::Top);
    assert_eq!(
        [
            has(&top, Placement::TrunkFront),
            has(&top, Placement::TrunkBack)
        ],
        [1, 1]
    );
    let worn = Worn::new(&top);
    worn.arms_and_waist(0.0);
    let [low, high] = worn.heights();
    assert!(
        (0.5..0.8).contains(&low) && (1.1..1.4).contains(&high),
        "{low} {high}"
    );

    let skirt =
        import(&read("skirt_with_waistband.json"), "skirt_with_waistband").expect("a skirt");
    assert_eq!(skirt.kind, GarmentKind::Skirt);
    assert_eq!(
        [
            has(&skirt, Placement::SkirtFront),
            has(&skirt, Placement::SkirtBack)
        ],
        [2, 2]
    );
    let worn = Worn::new(&skirt);
    worn.thighs(1.0);
    let [low, high] = worn.heights();
    assert!(
        (0.2..0.5).contains(&low) && (0.8..1.15).contains(&high),
        "{low} {high}"
    );
}

#[test]
fn designs_drafted_by_garmentcode_are_worn() {
    let strapless = drafted("strapless");
    assert_eq!(
        (strapless.kind, strapless.anchors[0].name.as_str()),
        (GarmentKind::Top, "chest")
    );
    let worn = Worn::new(&strapless);
    worn.arms_and_waist(0.0);
    worn.thighs(0.0);
    let [_, high] = worn.heights();
    assert!((1.2..1.42).contains(&high), "under the shoulders: {high}");

    let lapel = drafted("lapel");
    assert_eq!(has(&lapel, Placement::Collar), 4);
    Worn::new(&lapel).arms_and_waist(1.0);

    for name in ["asymcircle_wb", "manypanels_wb", "godet_wb", "levels_wb"] {
        let skirt = drafted(name);
        assert_eq!(skirt.kind, GarmentKind::Skirt, "{name}");
        let worn = Worn::new(&skirt);
        let [_, high] = worn.heights();
        assert!((0.95..1.2).contains(&high), "{name}: {high}");
        if name == "levels_wb" || name == "godet_wb" {
            worn.thighs(1.0);
        }
    }

    let trousers = drafted("pants_wb_cuff");
    assert_eq!(trousers.kind, GarmentKind::Trousers);
    for side in [Side::Left, Side::Right] {
        assert_eq!(has(&trousers, Placement::LegFront(side)), 2, "leg and cuff");
    }
    let worn = Worn::new(&trousers);
    worn.thighs(1.0);
    worn.arms_and_waist(0.0);
    worn.check("a calf", worn.around("left_knee", "left_ankle", 0.6), 1.0);
}

/// A skirt of eight tilted panels around the waist as origin, as the first data set draws it.
fn tilted_skirt() -> String {
    let mut panels = Vec::new();
    let mut stitches = Vec::new();
    for k in 0..8 {
        let turn = 45.0 * f64::from(k);
        let (s, c) = turn.to_radians().sin_cos();
        panels.push(format!(
            r#""p{k}":{{"translation":[{},-22,{}],"rotation":[-45,{turn},0],"vertices":[[-5.4,30],[5.4,30],[13.4,-30],[-13.4,-30]],
            "edges":[{{"endpoints":[3,2],"curvature":[0.5,-0.1]}},{{"endpoints":[2,1]}},{{"endpoints":[1,0],"curvature":[0.5,0.1]}},{{"endpoints":[0,3]}}]}}"#,
            38.0 * s,
            38.0 * c
        ));
        let next = (k + 1) % 8;
        stitches.push(format!(
            r#"[{{"panel":"p{k}","edge":1}},{{"panel":"p{next}","edge":3}}]"#
        ));
    }
    format!(
        r#"{{"pattern":{{"panels":{{{}}},"stitches":[{}]}},"properties":{{"units_in_meter":100,"curvature_coords":"relative"}}}}"#,
        panels.join(","),
        stitches.join(",")
    )
}

#[test]
fn panels_around_a_waist_as_origin_are_worn() {
    let skirt = import(&tilted_skirt(), "tilted").expect("a skirt");
    assert_eq!(skirt.kind, GarmentKind::Skirt);
    let front = skirt.panels.iter().find(|p| p.name == "p0").expect("front");
    let sector = front.sector.expect("a sector").map(f64::to_degrees);
    assert!(
        (sector[0] + 22.5).abs() < 0.5 && (sector[1] - 22.5).abs() < 0.5,
        "{sector:?}"
    );
    Worn::new(&skirt).thighs(1.0);
}

#[test]
fn a_panel_whose_place_cannot_be_told_is_named_with_what_would_be_right() {
    let text = tilted_skirt();
    let loose = text.replace(
        r#""panels":{"#,
        r#""panels":{"pocket":{"translation":[0,-30,40],"vertices":[[0,0],[9,0],[9,9]],
        "edges":[{"endpoints":[0,1]},{"endpoints":[1,2]},{"endpoints":[2,0]}]},"#,
    );
    let e = import(&loose, "pocket").expect_err("a loose pocket");
    assert!(
        e.contains("`pocket`") && e.contains("sewn to no panel") && e.contains("0.79 to 0.88 m"),
        "{e}"
    );

    let inside = text.replace(
        r#""translation":[0,-22,38],"rotation":[-45,0,0]"#,
        r#""translation":[0,-22,0],"rotation":[0,0,0]"#,
    );
    assert_ne!(inside, text);
    let e = import(&inside, "inside").expect_err("in the axis");
    assert!(
        e.contains("`p0`") && e.contains("move it to the front"),
        "{e}"
    );
}
