//! Mesh garments on bodies that they were not made on, and sizes that cannot be worn.

use crate::common::{posed, step_on};
use std::path::{Path, PathBuf};
use tryon::body::{BodyShape, Pose, RestBody, Template, embedded};
use tryon::cloth::{Config, Workspace};
use tryon::dressing::{
    DressError, DressOptions, Dressed, GarmentFile, GarmentSource, MeshGarment,
    MeshGarmentSettings, SourceBody, dress, dress_all,
};
use tryon::formats::gltf::{GlbMesh, write_glb};
use tryon::formats::shared_data;
use tryon::garment::{GarmentKind, Material, Size, library};
use tryon::geometry::math::{Body, Rigid, World, log_so3};

const AVERAGE: &[f64] = &[];
const HEAVY: &[f64] = &[0.3, 2.0, 1.2, -0.2, 0.2, 0.3, 0.0, 0.6, 0.0];

fn person(shape: &[f64]) -> (std::sync::Arc<Template>, RestBody) {
    let t = embedded::template();
    let rest = t.personalise(&BodyShape {
        coefficients: shape.to_vec(),
        ..BodyShape::default()
    });
    (t, rest)
}

/// A standing pose; `down`: arms below the horizontal, radians.
fn standing(template: &Template, rest: &RestBody, down: f64) -> Pose<World> {
    let sk = template.skeleton();
    let mut p = Pose::rest(sk, Rigid::<World, Body>::identity());
    for (side, s) in [("left", 1.0), ("right", -1.0)] {
        let joint = |n: &str| sk.index(&format!("{side}_{n}")).expect("joint");
        let (j, c) = (joint("shoulder"), joint("elbow"));
        let wanted = nalgebra::Vector3::new(s * f64::cos(down), -f64::sin(down), 0.0);
        let q =
            nalgebra::UnitQuaternion::rotation_between(&(rest.joints[c] - rest.joints[j]), &wanted)
                .expect("turn");
        p.set(sk, &format!("{side}_shoulder"), log_so3(&q).as_slice());
    }
    p
}

fn clothes(file: &str) -> Option<PathBuf> {
    shared_data(format!("garments/makehuman_clothes_cc0/{file}.mhclo"))
}

fn read(file: &Path, body: Option<SourceBody>) -> MeshGarment {
    let w = MeshGarment::read_on(
        GarmentFile::new(file, body),
        &Material::preset("cotton").expect("preset"),
        &MeshGarmentSettings::default(),
    )
    .expect("wearable");
    println!("{}: {}", w.name, w.notes.join("; "));
    w
}

fn worn(shape: &[f64], wear: &MeshGarment) -> Dressed {
    let (t, rest) = person(shape);
    let pose = standing(&t, &rest, 1.3);
    dress_all(
        &t,
        &rest,
        &pose,
        &[GarmentSource::Mesh(wear)],
        &DressOptions::default(),
    )
    .expect("dressed")
}

/// Heights of the lowest and highest vertex [m], and area in space over area at rest.
fn extent_and_area(d: &Dressed, k: usize) -> ([f32; 2], f64) {
    let (g, x) = (&d.model.outfit.garments[k], &d.state.garments[k].positions);
    let (mut now, mut flat) = (0.0, 0.0);
    for (f, r) in g.faces.iter().zip(&g.rest) {
        let p = f.map(|v| x[v as usize].cast::<f64>());
        now += 0.5 * (p[1] - p[0]).cross(&(p[2] - p[0])).norm();
        flat += tryon::garment::rest_area(r);
    }
    (
        x.iter()
            .fold([f32::MAX, f32::MIN], |[l, h], p| [l.min(p.y), h.max(p.y)]),
        now / flat,
    )
}

fn shirt_and_trousers(body: Option<SourceBody>) {
    let Some(file) = clothes("male_casualsuit02/male_casualsuit02") else {
        return;
    };
    let wear = read(&file, body);
    for (name, shape) in [("average", AVERAGE), ("heavy man", HEAVY)] {
        let d = worn(shape, &wear);
        let kinds: Vec<GarmentKind> = d.model.outfit.garments.iter().map(|g| g.kind).collect();
        assert_eq!(kinds.len(), 2, "{name}: {kinds:?}");
        println!(
            "{name}: p99 stretch {:.3}, {:.1} mm deep",
            d.report.p99_strain,
            d.report.penetration * 1e3
        );
        assert!(
            d.report.p99_strain < 0.2 && d.report.penetration < 0.04,
            "{name}: {:?}",
            d.report
        );
        for (k, kind) in kinds.iter().enumerate() {
            let ([low, high], area) = extent_and_area(&d, k);
            println!("  {kind:?}: from {low:.2} to {high:.2} m, area {area:.3}");
            assert!((0.93..1.08).contains(&area), "{name} {kind:?}: area {area}");
            match kind {
                GarmentKind::Trousers => assert!(
                    low < 0.2 && (0.85..1.2).contains(&high),
                    "{name}: {low} {high}"
                ),
                _ => assert!(
                    (0.7..1.1).contains(&low) && high > 1.35,
                    "{name}: {low} {high}"
                ),
            }
        }
    }
}

#[test]
fn makehuman_clothes_are_retargeted_to_bodies_of_ours() {
    let Some(base) = shared_data("body/makehuman_hm08_cc0/makehuman_app/3dobjs/base.obj") else {
        return;
    };
    shirt_and_trousers(Some(SourceBody::read(&base).expect("a body")));
}

#[test]
fn a_guessed_source_body_suffices() {
    shirt_and_trousers(None);
}

#[test]
fn hats_follow_the_head_rigidly() {
    let (Some(base), Some(hat)) = (
        shared_data("body/makehuman_hm08_cc0/makehuman_app/3dobjs/base.obj"),
        clothes("fedora01/fedora"),
    ) else {
        return;
    };
    let wear = read(&hat, Some(SourceBody::read(&base).expect("a body")));
    let mut d = worn(AVERAGE, &wear);
    let (t, rest) = person(AVERAGE);
    let top = rest.vertices.iter().map(|p| p.y).fold(0.0, f32::max);
    let before = d.state.garments[0].positions.clone();
    let ([low, high], _) = extent_and_area(&d, 0);
    assert!(
        low > top - 0.2 && high > top,
        "{low} to {high} on a head that ends at {top}"
    );
    // The body walks half a metre in half a second: the hat follows the head and keeps its shape.
    let mut work = Workspace::default();
    for i in 1..=15 {
        let body: Vec<_> = posed(&t, &rest, &standing(&t, &rest, 1.3))
            .iter()
            .map(|p| p + nalgebra::Vector3::new(0.0, 0.0, 0.033 * i as f32))
            .collect();
        step_on(&d.model, &mut d.state, &body, &mut work).expect("a step");
    }
    for (a, b) in before.iter().zip(&d.state.garments[0].positions) {
        let moved = b - a;
        assert!(
            (moved - nalgebra::Vector3::new(0.0, 0.0, 0.495)).norm() < 3e-3,
            "{moved}"
        );
    }
}

#[test]
fn a_size_that_cannot_be_closed_is_refused_with_the_missing_girth() {
    let (t, rest) = person(HEAVY);
    let pose = standing(&t, &rest, 1.3);
    let put_on = |size, any_size| {
        let options = DressOptions {
            any_size,
            config: Config::default(),
            ..DressOptions::default()
        };
        dress(
            &t,
            &rest,
            &pose,
            &[library::pattern("tshirt", size).expect("pattern")],
            &options,
        )
    };
    let e = put_on(Size::Xs, false).expect_err("far too small");
    assert!(matches!(e, DressError::Misfit(_)), "{e}");
    let text = e.to_string();
    println!("{text}");
    assert!(
        text.contains("tshirt XS cannot be closed: at the chest it lacks")
            && text.contains("can be worn"),
        "{text}"
    );
    assert!(
        put_on(Size::Xs, true).is_ok(),
        "any_size dresses it all the same"
    );
    // Worn tight: the hem stays where a hem is.
    let d = put_on(Size::M, false).expect("tight");
    let ([low, high], _) = extent_and_area(&d, 0);
    println!("M from {low:.2} to {high:.2} m");
    assert!(low < 1.0 && high > 1.35, "rolled up: {low} to {high}");
}

#[test]
fn our_own_gltf_is_retargeted_from_any_place_in_a_room() {
    let (t, rest) = person(AVERAGE);
    let pattern = library::pattern("tshirt", Size::M).expect("pattern");
    let pose = standing(&t, &rest, 0.9);
    let first = dress(
        &t,
        &rest,
        &pose,
        std::slice::from_ref(&pattern),
        &DressOptions::default(),
    )
    .expect("dressed");
    let g = &first.model.outfit.garments[0];
    let (mut drawn, folder) = (Vec::new(), tempfile::tempdir().expect("a folder"));
    g.render_positions(&first.state.garments[0].positions, &mut drawn);
    let worn_from = |aside: [f32; 3]| {
        let vertices: Vec<_> = drawn
            .iter()
            .map(|p| p + nalgebra::Vector3::from(aside))
            .collect();
        let file = folder.path().join("shirt.glb");
        let color = [200, 40, 40];
        let mesh = GlbMesh {
            name: "shirt",
            vertices: &vertices,
            faces: &g.render.faces,
            uv: &g.render.uv,
            color,
            texture: &[],
        };
        write_glb(&file, &[mesh]).expect("written");
        MeshGarment::read_on(
            GarmentFile::new(&file, None),
            &Material::preset("cotton").expect("preset"),
            &MeshGarmentSettings::default(),
        )
    };
    let before = extent_and_area(&first, 0).0;
    for aside in [[0.0; 3], [0.3, 0.0, -2.4], [0.0, 4.0, 0.0]] {
        let d = worn(AVERAGE, &worn_from(aside).expect("wearable"));
        let (after, area) = extent_and_area(&d, 0);
        println!("{aside:?}: {before:?} before, {after:?} after, area {area:.3}");
        assert!((0.93..1.08).contains(&area), "{area}");
        for (a, b) in before.iter().zip(after) {
            assert!(
                (a - b).abs() < 0.06,
                "{aside:?}: {before:?} before, {after:?} after"
            );
        }
    }
}
