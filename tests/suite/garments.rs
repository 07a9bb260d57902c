//! Garments of the library on bodies: what an eye would see at once, as numbers.

use tryon::body::measure::measure;
use tryon::body::{BodyShape, Pose, RestBody, Template, embedded};
use tryon::dressing::{DressOptions, Dressed, dress, suggest};
use tryon::garment::{GarmentKind, Pattern, Size, library};
use tryon::math::{Body, Rigid, World, log_so3};

/// Stature, girth, sex and so on in standard deviations.
const BODIES: [(&str, &[f64]); 3] = [
    ("slim woman", &[-0.4, -1.0, -1.2, 0.2, 0.0, -0.2, 0.0, -0.3, 0.1]),
    ("average", &[]),
    ("heavy man", &[0.3, 2.0, 1.2, -0.2, 0.2, 0.3, 0.0, 0.6, 0.0]),
];

fn arms_down(template: &Template, rest: &RestBody) -> Pose<World> {
    let sk = template.skeleton();
    let mut p = Pose::rest(sk, Rigid::<World, Body>::identity());
    for (side, s) in [("left", 1.0), ("right", -1.0)] {
        let joint = |n: &str| sk.index(&format!("{side}_{n}")).expect("joint");
        let (j, c) = (joint("shoulder"), joint("elbow"));
        let wanted = nalgebra::Vector3::new(s * 1.3f64.cos(), -1.3f64.sin(), 0.0);
        let q = nalgebra::UnitQuaternion::rotation_between(&(rest.joints[c] - rest.joints[j]), &wanted).expect("turn");
        let at = sk.dof_offset(j);
        p.angles[at..at + 3].copy_from_slice(log_so3(&q).as_slice());
    }
    p
}

fn wear(coefficients: &[f64], patterns: &dyn Fn(&Template, &RestBody) -> Vec<Pattern>) -> Dressed {
    let t = embedded::template();
    let rest = t.personalise(&BodyShape { coefficients: coefficients.to_vec(), ..BodyShape::default() });
    let list = patterns(&t, &rest);
    dress(&t, &rest, &arms_down(&t, &rest), &list, &DressOptions::default()).expect("dressed")
}

fn suggested(name: &'static str) -> impl Fn(&Template, &RestBody) -> Vec<Pattern> {
    move |t, rest| {
        let size = suggest(name, &measure(t, rest).expect("measurable")).expect("size").size;
        vec![library::pattern(name, size).expect("pattern")]
    }
}

#[test]
fn every_garment_hangs_on_three_bodies() {
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
                let rest = tryon::garment::mesh_area(r);
                flat += rest;
                now += area;
                short += usize::from(area < 0.5 * rest);
            }
            let (ratio, crumpled) = (now / flat, short as f64 / g.faces.len() as f64);
            let (low, high) = x.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p.y), h.max(p.y)));
            eprintln!(
                "{name} {} on {body}: area {ratio:.3}, crumpled {crumpled:.4}, under the skin {:.1} mm, p99 stretch {:.3}, from {low:.2} to {high:.2} m",
                g.size,
                d.report.penetration * 1e3,
                d.report.p99_strain
            );
            assert!((0.93..1.10).contains(&ratio), "{name} on {body}: area {ratio}");
            assert!(crumpled < 0.02, "{name} on {body}: {crumpled} of the triangles are crumpled");
            assert!(d.report.p99_strain < 0.20, "{name} on {body}: stretch {}", d.report.p99_strain);
            let hem: std::ops::Range<f32> = match g.kind {
                GarmentKind::Top => 0.60..1.0,
                GarmentKind::Skirt | GarmentKind::Dress => 0.30..0.75,
                GarmentKind::Trousers if *name == "shorts" => 0.45..0.75,
                GarmentKind::Trousers => -0.01..0.12,
            };
            assert!(hem.contains(&low), "{name} on {body}: the hem is at {low}");
            // The suggestion's sentence says where the hem will be.
            if !matches!(g.kind, GarmentKind::Skirt) {
                let t = embedded::template();
                let rest = t.personalise(&BodyShape { coefficients: shape.to_vec(), ..BodyShape::default() });
                let said = suggest(name, &measure(&t, &rest).expect("measurable")).expect("size").hem;
                assert!((said - f64::from(low)).abs() < 0.07, "{name} on {body}: {said} said, {low} hangs");
            }
        }
    }
}

#[test]
fn an_outer_layer_lies_outside_the_inner_one() {
    let untucked = |_: &Template, _: &RestBody| {
        ["tshirt", "skirt"].map(|n| library::pattern(n, Size::M).expect("pattern")).to_vec()
    };
    let d = wear(&[], &untucked);
    assert_eq!(d.model.outfit.garments.iter().map(|g| g.name.as_str()).collect::<Vec<_>>(), ["skirt", "tshirt"]);
    let tucked = |t: &Template, r: &RestBody| {
        let mut p = untucked(t, r);
        p[0].layer = 0;
        p[1].layer = 1;
        p
    };
    let d = wear(&[], &tucked);
    assert_eq!(d.model.outfit.garments.iter().map(|g| g.name.as_str()).collect::<Vec<_>>(), ["tshirt", "skirt"]);
}

#[test]
fn dressing_is_the_same_twice() {
    let a = wear(&[], &suggested("tank"));
    let b = wear(&[], &suggested("tank"));
    assert_eq!(a.state, b.state);
}
