use super::*;
use crate::people::unlike_actors;
use std::sync::OnceLock;
use tryon::mirror::Choice;
use tryon_body::embedded;
use tryon_dressing::{MeshGarment, MeshGarmentSettings};
use tryon_formats::scan::{read_scan, scan_files};
use tryon_formats::shared_data;
use tryon_garment::Material;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;
use tryon_geometry::spatial::Bvh;
use tryon_synth::{Actor, Posture, Routine};

/// A quick scene: coarse cloth, a few thousand points, two scans 0.1 s apart.
fn scene() -> ScanScene {
    ScanScene {
        scanner: ScannerSetting {
            points: 8000,
            noise: 0.0,
            ..ScannerSetting::default()
        },
        scans: 2,
        edge: 0.035,
        ..ScanScene::library(&["shorts", "tshirt"]).expect("library")
    }
}

/// The scans of [`scene`], made once.
fn plain() -> &'static [TrueScan] {
    static SCANS: OnceLock<Vec<TrueScan>> = OnceLock::new();
    SCANS.get_or_init(|| scene().scans().expect("scans"))
}

/// A subject without garments: no simulation.
fn bare() -> ScanScene {
    ScanScene {
        garments: Vec::new(),
        scans: 1,
        ..scene()
    }
}

fn share(scan: &TrueScan, label: u8) -> f64 {
    let of = scan.labels.iter().filter(|l| **l == label).count();
    of as f64 / scan.labels.len() as f64
}

fn distance(bvh: &Bvh, x: &[P3], p: &P3) -> f32 {
    bvh.closest(x, p).expect("a surface").distance
}

#[test]
fn noiseless_points_lie_on_the_surface_of_their_label() {
    for scan in plain() {
        assert_eq!(scan.points.len(), 8000);
        let body_faces = embedded::template().mesh().faces().to_vec();
        let mut surfaces: Vec<(&[P3], &[Face])> = vec![(&scan.body, &body_faces)];
        let garments = scan.garments.iter();
        surfaces.extend(garments.map(|g| (&g.vertices[..], &g.faces[..])));
        for (label, (x, faces)) in (0u8..).zip(surfaces) {
            assert!(share(scan, label) > 0.08, "{label}: {}", share(scan, label));
            let bvh = Bvh::new(faces, x);
            for (p, _) in (scan.points.iter().zip(&scan.labels)).filter(|(_, l)| **l == label) {
                let off = distance(&bvh, x, p);
                assert!(off < 1e-4, "{label}: {off} m");
            }
        }
    }
}

#[test]
fn garments_hide_the_skin_below_them_and_move_with_the_body() {
    let [first, second] = plain() else {
        panic!("two scans");
    };
    assert!(first.is_sound() && second.is_sound());
    // No camera sees the skin of the chest through the shirt.
    let chest = |p: &P3| p.x.abs() < 0.1 && (1.0..1.25).contains(&p.y);
    let points = first.points.iter().zip(&first.labels);
    let of_chest: Vec<u8> = points.filter(|(p, _)| chest(p)).map(|(_, l)| *l).collect();
    let skin = of_chest.iter().filter(|l| **l == SKIN_LABEL).count();
    assert!(
        of_chest.len() > 300 && skin * 200 < of_chest.len(),
        "{skin}"
    );
    let moved = first.body.iter().zip(&second.body);
    let moved = moved.map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
    assert!(moved > 1e-3, "{moved} m");
    assert_eq!(first.garments[0].faces, second.garments[0].faces);
}

#[test]
fn same_scene_gives_the_same_bits_and_another_seed_does_not() {
    let scan = |seed| {
        let scene = ScanScene { seed, ..bare() };
        scene.scans().expect("scans").remove(0)
    };
    let (a, b, c) = (scan(5), scan(5), scan(6));
    assert_eq!(
        (&a.points, &a.colors, &a.labels),
        (&b.points, &b.colors, &b.labels)
    );
    assert_ne!(a.points, c.points);
    assert_eq!(a.body, c.body);
}

#[test]
fn measured_noise_is_the_one_asked_for() {
    let clean = bare();
    let mut noisy = clean.clone();
    noisy.scanner.noise = 1.5e-3;
    let [clean, noisy] = [clean, noisy].map(|s| s.scans().expect("scans").remove(0));
    let offsets = clean
        .points
        .iter()
        .zip(&noisy.points)
        .map(|(a, b)| (b - a).norm_squared());
    let deviation = (offsets.sum::<f32>() / clean.points.len() as f32).sqrt();
    assert!((deviation - 1.5e-3).abs() < 5e-5, "{deviation} m");
}

#[test]
fn holes_take_the_share_asked_for() {
    for holes in [0.2, 0.6] {
        let mut scene = bare();
        scene.defects.holes = holes;
        let scan = scene.scans().expect("scans").remove(0);
        let left = ((1.0 - holes) * 8000.0).round() as usize;
        assert_eq!(scan.points.len(), left);
        assert_eq!(scan.labels.len(), left);
    }
}

#[test]
fn defects_are_in_the_scan_and_survive_the_file() {
    let mut scene = bare();
    scene.defects = ScanDefects {
        floor_points: 400,
        has_object: true,
        non_finite: 0.01,
        lost_colors: 0.02,
        flipped_normals: 0.03,
        duplicates: 0.05,
        ..ScanDefects::default()
    };
    let dir = tempfile::tempdir().expect("a folder");
    assert_eq!(write_scan_folder(dir.path(), &scene).expect("written"), 1);
    let scan = scene.scans().expect("scans").remove(0);
    let rows = 8400 + 420;
    assert_eq!(scan.points.len(), rows);
    assert!(
        share(&scan, STRAY_LABEL) > 0.055,
        "{}",
        share(&scan, STRAY_LABEL)
    );
    let broken = scan
        .points
        .iter()
        .filter(|p| !p.iter().all(|c| c.is_finite()));
    assert_eq!(broken.count(), 84);
    assert!(
        (168..=190).contains(&scan.uncolored.len()),
        "{}",
        scan.uncolored.len()
    );
    let files = scan_files(dir.path()).expect("scans");
    assert_eq!(files.len(), 1);
    let read = read_scan(&files[0]).expect("readable");
    assert_eq!(read.points.len(), rows);
    assert_eq!(read.colors.len(), rows);
    for file in ["0000.ply", "0000.body.ply", "0000.pose.npy", "shape.npy"] {
        assert!(dir.path().join("truth").join(file).exists(), "{file}");
    }
}

#[test]
fn meshed_scan_has_the_visible_triangles() {
    let mut scene = bare();
    scene.scanner.is_meshed = true;
    scene.defects.holes = 0.1;
    let scan = scene.scans().expect("scans").remove(0);
    let all = scene.actor.template.mesh().faces().len();
    assert!(scan.faces.len() > all / 2 && scan.faces.len() < all);
    let last = scan.points.len() as u32;
    assert!(scan.faces.iter().flatten().all(|v| *v < last));
    assert_eq!(scan.labels.len(), scan.points.len());
}

#[test]
fn motions_start_without_a_calibration_pose_and_turn_on_the_spot() {
    let track = |motion: ScanMotion| {
        motion::PoseTrack::new(&Actor::default(), &motion, 60.0).expect("a routine")
    };
    let routine = Routine::Hold(Posture::Standing);
    let turn = track(ScanMotion::TurnOnSpot {
        routine,
        speed: 1.0,
    });
    let (a, b) = (turn.pose(0), turn.pose(60));
    assert_eq!(a.angles, b.angles);
    let angle = a.root.iso().rotation.angle_to(&b.root.iso().rotation);
    assert!((angle - 1.0).abs() < 1e-9, "{angle}");
    let held = ScanMotion::Play {
        routine,
        start: 0.0,
    };
    assert_eq!(track(held.clone()).pose(0).angles, a.angles);
    assert_ne!(track(ScanMotion::default()).pose(0).angles, a.angles);
    assert_eq!(track(held).pose(30).angles, a.angles);
}

#[test]
fn clothes_by_others_are_worn_on_bodies_by_others() {
    let Some(data) = shared_data("") else {
        return;
    };
    let base = data.join("body/makehuman_hm08_cc0/makehuman_app/3dobjs/base.obj");
    let suit = "garments/makehuman_clothes_cc0/male_casualsuit04/male_casualsuit04.mhclo";
    if !base.exists() || !data.join(suit).exists() {
        return;
    }
    let cotton = Material::preset("cotton").expect("a preset");
    let settings = MeshGarmentSettings::with_edge(0.03);
    let mesh = MeshGarment::read(&data.join(suit), Some(&base), &cotton, &settings);
    let mesh = mesh.expect("a suit");
    let actors = unlike_actors(&data).expect("bodies");
    assert!(actors.iter().all(|(name, _)| name != "wide_coat"));
    let (_, actor) = (actors.into_iter().find(|(name, _)| name == "muscular")).expect("a body");
    let scene = ScanScene {
        actor,
        garments: vec![Choice::mesh(mesh, None).into()],
        ..bare()
    };
    let scan = scene.scans().expect("scans").remove(0);
    assert!(scan.is_sound(), "{}", scan.strain);
    assert_eq!(scan.garments.len(), 2);
    assert!(share(&scan, 1) > 0.15 && share(&scan, 2) > 0.15);
}
