use super::*;
use std::sync::OnceLock;
use tryon_body::embedded;
use tryon_formats::scan::{read_scan, scan_files};
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
    // Nothing is caught or torn: dances reach a quarter for a frame.
    assert!(first.strain < 0.25 && second.strain < 0.25);
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
fn scans_survive_their_files() {
    let dir = tempfile::tempdir().expect("a folder");
    write_scan_folder(dir.path(), &bare()).expect("written");
    let files = scan_files(dir.path()).expect("scans");
    assert_eq!(files.len(), 1);
    let read = read_scan(&files[0]).expect("readable");
    assert_eq!((read.points.len(), read.colors.len()), (8000, 8000));
}

#[test]
fn motions_start_without_a_calibration_pose_and_turn_on_the_spot() {
    let track = |motion: ScanMotion| {
        motion::PoseTrack::new(&Actor::default(), &motion, 60.0).expect("a routine")
    };
    let (routine, start) = (Routine::Hold(Posture::Standing), 0.0);
    let turn = track(ScanMotion::Turn {
        routine,
        start,
        delay: 0.0,
        speed: 1.0,
    });
    let (a, b) = (turn.pose(0), turn.pose(60));
    assert_eq!(a.angles, b.angles);
    let angle = a.root.iso().rotation.angle_to(&b.root.iso().rotation);
    assert!((angle - 1.0).abs() < 1e-9, "{angle}");
    let held = track(ScanMotion::Play { routine, start });
    assert_eq!(held.pose(0).angles, a.angles);
    assert_ne!(track(ScanMotion::default()).pose(0).angles, a.angles);
    assert_eq!(held.pose(30).angles, a.angles);
}
