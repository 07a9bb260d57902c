//! Captured garments as garments: their sizes, dressed in layers on other bodies, and captures that are damaged.

use std::path::Path;
use tryon::body::measure::measure;
use tryon::body::{BodyShape, Pose, embedded};
use tryon::clothcap::align::find_frame;
use tryon::clothcap::archive::{CaptureArchive, CaptureHeader, FrameDisplacements, FrameRecord};
use tryon::clothcap::scan::BodyScan;
use tryon::clothcap::segment::{LabelConfig, Slot};
use tryon::clothcap::{OutfitCapture, OutfitCaptureConfig};
use tryon::dressing::{DressOptions, FitProbe, GarmentSource, dress_all};
use tryon::formats::scan::ScanMesh;
use tryon::garment::{Material, Size};
use tryon::geometry::math::{Body, Rigid, World};
use tryon::mirror::{CapturedWardrobe, Choice};
use tryon_bench::garment_capture::capture_scenes;

const HEAVY: &[f64] = &[0.3, 2.0, 1.2, -0.2, 0.2, 0.3, 0.0, 0.6, 0.0];

/// Captures a T-shirt and trousers into a folder.
fn capture(folder: &Path) {
    let template = embedded::template();
    let mut scene = capture_scenes().expect("scenes").remove(0).scene;
    (scene.scans, scene.scanner.points) = (1, 30_000);
    let scan = scene.scans().expect("a scan").remove(0);
    let file = ScanMesh {
        points: scan.points,
        faces: Vec::new(),
        normals: scan.normals,
        colors: scan.colors,
        ..ScanMesh::default()
    };
    let (frame, start) = find_frame(&template, &file).expect("a person");
    let labels = LabelConfig {
        slots: Some(vec![Slot::Top, Slot::Bottom]),
        ..LabelConfig::default()
    };
    let config = OutfitCaptureConfig {
        labels,
        ..OutfitCaptureConfig::default()
    };
    let mut job = OutfitCapture::new(template.clone(), config).expect("a job");
    job.start_at(start);
    let scan = BodyScan::new(&file, &frame).expect("a scan");
    let captured = job.frame(&scan).expect("captured");
    let archive = CaptureArchive::new(folder).expect("a folder");
    let header = CaptureHeader {
        version: 0,
        template: template.name().to_owned(),
        frame,
        outfit: job.outfit().expect("an outfit").clone(),
        clothed: job.clothed().expect("a template").clone(),
        scans: vec!["first".into()],
    };
    archive.write_textures(job.textures()).expect("written");
    archive.write_header(&header).expect("written");
    let record = FrameRecord {
        scan: "first".into(),
        body: captured.undressed.body.clone(),
        report: captured.report.clone(),
    };
    let displacements = FrameDisplacements::of(&template, &captured);
    archive
        .write_frame(&record, &displacements)
        .expect("written");
}

fn worn_on(coefficients: &[f64], captured: &CapturedWardrobe) -> Vec<Size> {
    let template = embedded::template();
    let cotton = Material::preset("cotton").expect("a preset");
    let rest = template.personalise(&BodyShape {
        coefficients: coefficients.to_vec(),
        ..BodyShape::default()
    });
    let body = measure(&template, &rest).expect("a body");
    let pose = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
    let garments: Vec<_> = (captured.names().iter().enumerate())
        .map(|(k, name)| {
            let garment = captured.garment(k, name, &cotton, 0.021).expect("cloth");
            let sized = Choice::mesh(garment.clone(), None).sized(&body);
            let finished = sized.expect("sized").finished().expect("in sizes");
            garment.in_size(finished.size).expect("a size")
        })
        .collect();
    let sources: Vec<_> = garments.iter().map(GarmentSource::Mesh).collect();
    let options = DressOptions::default();
    let d = dress_all(&template, &rest, &pose, &sources, &options).expect("dressed");
    println!("{:?}", d.report);
    assert_eq!(d.report.crossings, 0);
    assert!(d.report.p99_strain < 0.15, "{}", d.report.p99_strain);
    assert!(d.report.penetration < 0.005, "{}", d.report.penetration);

    // Each is drawn with an image that holds all of its texture coordinates.
    for worn in &d.model.outfit.garments {
        let garment = garments.iter().find(|g| g.name == worn.name);
        let garment = garment.expect("known by its name");
        let image = garment.image.as_ref().expect("an image");
        let size = [image.pixels.width(), image.pixels.height()];
        let size = size.map(|n| n as f32 * image.metres_per_pixel);
        let inside = |t: &[f32; 2]| (0..2).all(|k| (0.0..=size[k]).contains(&t[k]));
        assert!(worn.render.uv.iter().all(inside));
        assert_eq!(worn.render.faces.len(), worn.faces.len());
        for (drawn, own) in worn.render.faces.iter().zip(&worn.faces) {
            assert_eq!(drawn.map(|v| worn.render.vertex[v as usize]), *own);
        }
    }

    let mut probe = FitProbe::new(&template, &d.model).expect("a probe");
    let body = d.state.collision_body().vertices().to_vec();
    let fits = probe.measure(&d.model, &d.state, &body).expect("a fit");
    assert!(fits.iter().all(|f| !f.regions.is_empty()));
    garments
        .iter()
        .filter_map(|g| Some(g.finished()?.size))
        .collect()
}

#[test]
fn a_captured_outfit_is_worn_in_sizes_on_other_bodies() {
    let folder = tempfile::tempdir().expect("a folder");
    capture(folder.path());
    let captured = CapturedWardrobe::read(folder.path(), &embedded::template()).expect("read");
    let mut names = captured.names().to_vec();
    names.sort();
    assert_eq!(names, ["bottom", "top"]);
    let average = worn_on(&[], &captured);
    let heavy = worn_on(HEAVY, &captured);
    println!("{average:?} {heavy:?}");
    assert_eq!((average.len(), heavy.len()), (2, 2));
    assert!(average.iter().zip(&heavy).all(|(a, h)| a < h));

    // A fault is named by its file and field.
    let fault = |file: &str, change: fn(Vec<u8>) -> Vec<u8>| {
        let path = folder.path().join(file);
        let whole = std::fs::read(&path).expect("a file");
        std::fs::write(&path, change(whole.clone())).expect("written");
        let read = CapturedWardrobe::read(folder.path(), &embedded::template());
        std::fs::write(&path, whole).expect("written");
        read.expect_err("damaged").to_string()
    };
    let why = fault("frames/first.garment0.npy", |b| b[..b.len() - 12].to_vec());
    assert!(why.contains("first.garment0.npy"), "{why}");
    let why = fault("capture.json", |b| {
        let text = String::from_utf8(b).expect("text");
        text.replacen("\"label\":2", "\"label\":77", 1).into_bytes()
    });
    assert!(
        why.contains("capture.json") && why.contains("parts[0].label"),
        "{why}"
    );
}
