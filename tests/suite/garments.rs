//! Garments of the library on bodies: faults that an eye sees at once, as numbers.

use super::common::{arms_down, posed, step_on};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use tryon::body::measure::measure;
use tryon::body::{BodyShape, BoneTransforms, RestBody, Template, embedded};
use tryon::cloth::Workspace;
use tryon::dressing::{DressOptions, Dressed, FitClass, FitProbe, dress, suggest};
use tryon::formats::fabric_json::read_fabric;
use tryon::formats::garmentcode::parse_garmentcode;
use tryon::formats::mhclo::read_mhclo;
use tryon::formats::obj::read_obj;
use tryon::formats::sewn_obj::read_sewn_obj;
use tryon::formats::shared_data;
use tryon::garment::import::{from_garmentcode, from_mesh};
use tryon::garment::{GarmentKind, Material, Pattern, Size, Triangulation, library};
use tryon::geometry::math::log_so3;

/// Stature, girth, sex and so on in standard deviations.
const BODIES: [(&str, &[f64]); 3] = [
    (
        "slim woman",
        &[-0.4, -1.0, -1.2, 0.2, 0.0, -0.2, 0.0, -0.3, 0.1],
    ),
    ("average", &[]),
    ("heavy man", &[0.3, 2.0, 1.2, -0.2, 0.2, 0.3, 0.0, 0.6, 0.0]),
];

fn person(template: &Template, coefficients: &[f64]) -> RestBody {
    template.personalise(&BodyShape {
        coefficients: coefficients.to_vec(),
        ..BodyShape::default()
    })
}

fn wear(coefficients: &[f64], patterns: &dyn Fn(&Template, &RestBody) -> Vec<Pattern>) -> Dressed {
    let t = embedded::template();
    let rest = person(&t, coefficients);
    let list = patterns(&t, &rest);
    dress(
        &t,
        &rest,
        &arms_down(&t, &rest),
        &list,
        &DressOptions::default(),
    )
    .expect("dressed")
}

fn suggested(name: &'static str) -> impl Fn(&Template, &RestBody) -> Vec<Pattern> {
    move |t, rest| {
        let size = suggest(name, &measure(t, rest).expect("measurable"))
            .expect("size")
            .size;
        vec![library::pattern(name, size).expect("pattern")]
    }
}

#[test]
fn every_garment_is_neither_torn_nor_crumpled_on_three_bodies() {
    for name in library::names() {
        for (body, shape) in BODIES {
            let d = wear(shape, &suggested(name));
            let (g, x) = (&d.model.outfit.garments[0], &d.state.garments[0].positions);
            // Neither torn nor crumpled: the area of the cloth in space is that of its panels. Crumpling shows in edges
            // much shorter than on paper.
            let (mut flat, mut now, mut short) = (0.0, 0.0, 0usize);
            for (f, r) in g.faces.iter().zip(&g.rest) {
                let p = f.map(|v| x[v as usize].cast::<f64>());
                let area = 0.5 * (p[1] - p[0]).cross(&(p[2] - p[0])).norm();
                let rest = tryon::garment::rest_area(r);
                flat += rest;
                now += area;
                short += usize::from(area < 0.5 * rest);
            }
            let (ratio, crumpled) = (now / flat, short as f64 / g.faces.len() as f64);
            let (low, high) = x
                .iter()
                .fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p.y), h.max(p.y)));
            eprintln!(
                "{name} {} on {body}: area {ratio:.3}, crumpled {crumpled:.4}, under the skin {:.1} mm, p99 stretch {:.3}, from {low:.2} to {high:.2} m",
                g.size,
                d.report.penetration * 1e3,
                d.report.p99_strain
            );
            assert!(
                (0.93..1.10).contains(&ratio),
                "{name} on {body}: area {ratio}"
            );
            assert!(
                crumpled < 0.02,
                "{name} on {body}: {crumpled} of the triangles are crumpled"
            );
            assert_eq!(
                d.report.crossings, 0,
                "{name} on {body} passes through itself"
            );
            assert!(
                d.report.penetration < 0.004,
                "{name} on {body}: {} m under the skin",
                d.report.penetration
            );
            assert!(
                d.report.p99_strain < 0.15,
                "{name} on {body}: stretch {}",
                d.report.p99_strain
            );
            let hem: std::ops::Range<f32> = match g.kind {
                GarmentKind::Top => 0.60..1.0,
                GarmentKind::Skirt | GarmentKind::Dress => 0.30..0.75,
                GarmentKind::Trousers if *name == "shorts" => 0.45..0.75,
                GarmentKind::Trousers => 0.02..0.12,
            };
            assert!(hem.contains(&low), "{name} on {body}: the hem is at {low}");
            // The hem that the suggestion predicts.
            if !matches!(g.kind, GarmentKind::Skirt) {
                let t = embedded::template();
                let rest = person(&t, shape);
                let said = suggest(name, &measure(&t, &rest).expect("measurable"))
                    .expect("size")
                    .hem;
                // Over a belly or a bust a top hangs shorter than its back is long.
                let off = match g.kind {
                    GarmentKind::Top => 0.13,
                    GarmentKind::Trousers => 0.05,
                    _ => 0.09,
                };
                assert!(
                    (said - f64::from(low)).abs() < off,
                    "{name} on {body}: {said} said, {low} hangs"
                );
            }
        }
    }
}

#[test]
fn a_fine_hood_on_a_thick_neck_has_no_crossing() {
    let t = embedded::template();
    let rest = person(&t, BODIES[2].1);
    let options = DressOptions {
        triangulation: Triangulation {
            edge_length: 0.0155,
            ..Triangulation::default()
        },
        ..DressOptions::default()
    };
    let worn = dress(
        &t,
        &rest,
        &arms_down(&t, &rest),
        &suggested("hoodie")(&t, &rest),
        &options,
    )
    .expect("dressed");
    assert!(worn.model.outfit.garments[0].corners.len() > 5000);
    assert_eq!(worn.report.crossings, 0);
    assert!(
        worn.report.penetration < 0.004 && worn.report.p99_strain < 0.15,
        "{:?}",
        worn.report
    );
}

#[test]
fn wide_hoods_have_no_crossing() {
    let t = embedded::template();
    for (body, shape) in BODIES {
        let rest = person(&t, shape);
        for size in [Size::L, Size::Xl] {
            let hoodie = [library::pattern("hoodie", size).expect("pattern")];
            let options = DressOptions {
                any_size: true,
                ..DressOptions::default()
            };
            let r = dress(&t, &rest, &arms_down(&t, &rest), &hoodie, &options)
                .expect("dressed")
                .report;
            assert_eq!(r.crossings, 0, "{size} on {body}");
        }
    }
}

/// Widest angle about the middle of a forearm without cloth, degrees; cloth counts within 3 cm along the bone and 20 cm
/// beside it.
fn bare(d: &Dressed, joints: [Point3<f64>; 2]) -> f64 {
    let along = (joints[1] - joints[0]).normalize();
    let middle = joints[0] + (joints[1] - joints[0]) * 0.5;
    let u = along.cross(&Vector3::new(0.31, 0.52, 0.79)).normalize();
    let v = along.cross(&u);
    let mut turns: Vec<f64> = d.state.garments[0]
        .positions
        .iter()
        .map(|p| p.cast::<f64>() - middle)
        .filter(|r| r.dot(&along).abs() < 0.03 && r.norm() < 0.20)
        .map(|r| r.dot(&v).atan2(r.dot(&u)).to_degrees())
        .collect();
    turns.sort_unstable_by(f64::total_cmp);
    let Some((first, last)) = turns.first().zip(turns.last()) else {
        return 360.0;
    };
    turns
        .windows(2)
        .map(|w| w[1] - w[0])
        .fold(first + 360.0 - last, f64::max)
}

#[test]
fn bent_arms_are_in_their_sleeves() {
    let t = embedded::template();
    let sk = t.skeleton();
    let mut lost = Vec::new();
    for (body, shape) in &BODIES[1..] {
        let rest = person(&t, shape);
        let pattern = suggested("longsleeve")(&t, &rest);
        for k in 0..9 {
            let mut pose = arms_down(&t, &rest);
            for (side, k) in [("left", k), ("right", 8 - k)] {
                let s = if side == "left" { 1.0 } else { -1.0 };
                let (out, bend): (f64, f64) = ([0.1, 0.5, 1.1][k % 3], [1.0, 1.75, 2.2][k / 3]);
                let joint = |n: &str| sk.index(&format!("{side}_{n}")).expect("joint");
                let at = sk.dof_offset(joint("shoulder"));
                let arm = rest.joints[joint("elbow")] - rest.joints[joint("shoulder")];
                let wanted = Vector3::new(s * out.sin(), -out.cos(), 0.3);
                let turn = UnitQuaternion::rotation_between(&arm, &wanted).expect("turn");
                // The elbow bends to the front or outwards: inwards the forearm is in the belly.
                let twist = UnitQuaternion::from_axis_angle(
                    &Unit::new_normalize(arm),
                    s * [0.0, -0.3, -0.6][(k + k / 3) % 3],
                );
                pose.angles[at..at + 3].copy_from_slice(log_so3(&(turn * twist)).as_slice());
                pose.set(sk, &format!("{side}_elbow"), &[bend]);
            }
            let d = dress(&t, &rest, &pose, &pattern, &DressOptions::default()).expect("dressed");
            let mut bones = BoneTransforms::default();
            pose.bones(sk, &rest, &mut bones);
            for side in ["left", "right"] {
                let at = ["elbow", "wrist"]
                    .map(|n| bones.joints[sk.index(&format!("{side}_{n}")).expect("joint")]);
                let gap = bare(&d, at);
                eprintln!(
                    "{body} {k} {side}: {gap:.0}°, stretch {:.3}",
                    d.report.p99_strain
                );
                if gap > 90.0 {
                    lost.push(format!("{body} {k} {side}: {gap:.0}°"));
                }
            }
        }
    }
    assert!(lost.is_empty(), "{lost:?}");
}

#[test]
fn an_outer_layer_lies_outside_the_inner_one() {
    let untucked = |_: &Template, _: &RestBody| {
        ["tshirt", "skirt"]
            .map(|n| library::pattern(n, Size::M).expect("pattern"))
            .to_vec()
    };
    let names = |d: Dressed| -> Vec<String> {
        let garments = d.model.outfit.garments.iter();
        garments.map(|g| g.name.clone()).collect()
    };
    assert_eq!(names(wear(&[], &untucked)), ["skirt", "tshirt"]);
    let tucked = |t: &Template, r: &RestBody| {
        let mut p = untucked(t, r);
        p[0].layer = 0;
        p[1].layer = 1;
        p
    };
    assert_eq!(names(wear(&[], &tucked)), ["tshirt", "skirt"]);
}

fn garmentcode() -> Option<Vec<std::path::PathBuf>> {
    let folder = shared_data("garments/garmentcode_mit/Patterns")?;
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .flatten()
        .map(|e| e.path())
        .collect();
    files.sort();
    Some(files)
}

#[test]
fn every_garmentcode_pattern_is_imported_and_worn() {
    let Some(files) = garmentcode() else { return };
    assert!(files.len() >= 4);
    for path in files {
        let text = std::fs::read_to_string(&path).expect("read");
        let raw = parse_garmentcode(&text, &path).expect("a pattern");
        let name = path
            .file_stem()
            .and_then(|s| s.to_str())
            .unwrap_or("garment");
        let fabric = Material::preset("cotton").expect("preset");
        let p =
            from_garmentcode(&raw, name, Size::M, fabric).unwrap_or_else(|e| panic!("{name}: {e}"));
        let round = Pattern::from_json(&p.to_json()).expect("our own JSON");
        assert_eq!(round.panels.len(), raw.panels.len());
        // Edges of a few millimetres are left out, with their stitches.
        assert!(
            p.seams.len() + 10 >= raw.stitches.len(),
            "{name}: {} of {}",
            p.seams.len(),
            raw.stitches.len()
        );
        let d = wear(&[], &|_, _| vec![p.clone()]);
        let (g, x) = (&d.model.outfit.garments[0], &d.state.garments[0].positions);
        let (mut flat, mut now) = (0.0, 0.0);
        for (f, r) in g.faces.iter().zip(&g.rest) {
            let q = f.map(|v| x[v as usize].cast::<f64>());
            now += 0.5 * (q[1] - q[0]).cross(&(q[2] - q[0])).norm();
            flat += tryon::garment::rest_area(r);
        }
        eprintln!(
            "{name}: {} vertices, smallest angle {:.1}, area {:.3}, p99 stretch {:.3}, {:?} finished {:?}",
            g.vertices,
            g.min_angle,
            now / flat,
            d.report.p99_strain,
            p.kind,
            p.finished
        );
        assert!(
            (0.9..1.15).contains(&(now / flat)),
            "{name}: area {}",
            now / flat
        );
    }
}

#[test]
fn damaged_garmentcode_files_are_refused_or_read_but_never_panic() {
    let Some(files) = garmentcode() else { return };
    let text = std::fs::read_to_string(&files[0]).expect("text");
    let at = std::path::Path::new("p.json");
    // Cut at many places, and digits replaced: indices and coordinates that do not fit.
    for cut in (0..text.len())
        .step_by(97)
        .filter(|c| text.is_char_boundary(*c))
    {
        assert!(parse_garmentcode(&text[..cut], at).is_err(), "cut at {cut}");
    }
    let digits: Vec<usize> = text
        .bytes()
        .enumerate()
        .filter(|(_, b)| b.is_ascii_digit())
        .map(|(i, _)| i)
        .collect();
    for k in 0..200 {
        let mut bytes = text.clone().into_bytes();
        bytes[digits[(k * 7919) % digits.len()]] = b'9';
        let damaged = String::from_utf8(bytes).expect("ASCII stays ASCII");
        if let Ok(raw) = parse_garmentcode(&damaged, at) {
            let p = from_garmentcode(
                &raw,
                "damaged",
                Size::M,
                Material::preset("cotton").expect("preset"),
            );
            if let Ok(p) = p {
                let how = Triangulation {
                    edge_length: 0.05,
                    min_angle: 0.0,
                    ..Triangulation::default()
                };
                let _ = tryon::garment::GarmentMesh::sew(&p, &how);
            }
        }
    }
}

#[test]
fn the_stitched_dress_becomes_one_surface() {
    let Some(path) = shared_data("garments/cipc_apache2/dress_knife/stage.obj") else {
        return;
    };
    let sewn = read_sewn_obj(&path).expect("read");
    assert_eq!(sewn.stitches.len(), 851);
    let g = from_mesh(
        &sewn,
        "dress",
        GarmentKind::Dress,
        Material::preset("cotton").expect("preset"),
    )
    .expect("sewn");
    assert_eq!(g.garment.panels.len(), 14);
    let (flat, kept) = (sewn.obj.mesh.faces().len(), g.garment.faces.len());
    let open = g.open;
    eprintln!(
        "{} vertices of 15,656, {kept} of {flat} triangles, {} closed, {open} open",
        g.garment.vertices, g.closed
    );
    // Fourteen panels become few pieces of cloth: pleats sewn three layers deep stay open.
    let pieces = g.garment.topology().expect("proper").components().1;
    eprintln!("{pieces} pieces");
    assert!(pieces <= 3 && g.closed < 10 && open < 200 && g.garment.vertices < 15_656 - 600);
}

#[test]
fn a_fit_map_separates_a_tight_size_from_a_loose_one() {
    let worn = |size| {
        let mut d = wear(&[], &|_, _| {
            vec![library::pattern("tank", size).expect("pattern")]
        });
        let t = embedded::template();
        let rest = t.personalise(&BodyShape::default());
        let body = posed(&t, &rest, &arms_down(&t, &rest));
        // Pressure is of cloth at rest: half a second and more to settle.
        let mut work = Workspace::default();
        for _ in 0..30 {
            step_on(&d.model, &mut d.state, &body, &mut work).expect("a step");
        }
        let mut probe = FitProbe::new(&t, &d.model).expect("probe");
        let map = probe
            .measure(&d.model, &d.state, &body)
            .expect("fit")
            .remove(0);
        assert!(
            probe.measure(&d.model, &d.state, &body[1..]).is_err(),
            "a body of another size is refused"
        );
        map
    };
    let (small, large) = (worn(Size::S), worn(Size::Xxl));
    let chest = |m: &tryon::dressing::FitMap| {
        m.regions
            .iter()
            .find(|r| r.name == "chest")
            .expect("a chest")
            .clone()
    };
    let (s, l) = (chest(&small), chest(&large));
    eprintln!("S {s:?}\nXXL {l:?}");
    assert!(s.stretch[0] > l.stretch[0] + 0.01 && s.gap < l.gap && s.pressure[0] > l.pressure[0]);
    assert_eq!(s.fit, FitClass::Tight);
    assert_ne!(l.fit, FitClass::Tight);
}

#[test]
fn measured_fabrics_become_materials() {
    let Some(folder) = shared_data("materials/wang2011_arcsim_NONCOMMERCIAL") else {
        return;
    };
    let mut seen = 0;
    for e in std::fs::read_dir(folder).expect("a folder").flatten() {
        if e.path().extension().is_some_and(|x| x == "json") {
            let f = read_fabric(&e.path()).expect("a fabric");
            let m = Material::from_measured("measured", &f).expect("usable");
            assert!(
                m.area_density == f.density
                    && m.stretch_warp > m.shear * 0.05
                    && m.bending.mean() < 1e-3,
                "{m:?}"
            );
            seen += 1;
        }
    }
    assert_eq!(seen, 10);
}

#[test]
fn makehuman_clothes_fit_their_base_mesh() {
    let (Some(folder), Some(base)) = (
        shared_data("garments/makehuman_clothes_cc0"),
        shared_data("body/makehuman_hm08_cc0/makehuman_app/3dobjs/base.obj"),
    ) else {
        return;
    };
    let body = read_obj(&base).expect("base").mesh.vertices().to_vec();
    let mut seen = 0;
    for dir in std::fs::read_dir(folder)
        .expect("a folder")
        .flatten()
        .filter(|e| e.path().is_dir())
    {
        for file in std::fs::read_dir(dir.path())
            .expect("a folder")
            .flatten()
            .map(|e| e.path())
        {
            if file.extension().is_none_or(|x| x != "mhclo") {
                continue;
            }
            let m = read_mhclo(&file).expect("read");
            let mesh = read_obj(&file.with_file_name(&m.obj_file))
                .expect("its OBJ")
                .mesh;
            assert_eq!(
                m.bindings.len(),
                mesh.vertices().len(),
                "{}",
                file.display()
            );
            let fitted = m.fit(&body, &file).expect("fits");
            // Bound vertices lie near the body they hang on: within 3 dm, the unit of MakeHuman being dm.
            for (p, b) in fitted.iter().zip(&m.bindings) {
                assert!(
                    (p - body[b.vertices[0] as usize]).norm() < 3.0,
                    "{}",
                    file.display()
                );
            }
            seen += 1;
        }
    }
    assert!(seen >= 18, "{seen}");
}

#[test]
fn dressing_repeats_its_bits() {
    let a = wear(&[], &suggested("tank"));
    let b = wear(&[], &suggested("tank"));
    assert_eq!(a.state, b.state);
}
