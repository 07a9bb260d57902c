//! A whole capture of a synthetic scan: found, aligned, segmented, fitted, undressed, retargeted.

use super::archive::{CaptureArchive, CaptureHeader, FrameDisplacements, FrameRecord};
use super::segment::{LabelConfig, Slot};
use super::test_scans::{TestScan, f1};
use super::*;
use crate::body::{BodyShape, embedded};
use crate::math::P3;
use crate::spatial::Bvh;

const BLUE: [u8; 3] = [60, 90, 190];
const GREY: [u8; 3] = [70, 70, 75];

/// Mean distance of points from the surface of a posed template, metres.
fn mean_distance(points: &[P3], surface: &[P3]) -> f64 {
    let bvh = Bvh::new(embedded::template().mesh().faces(), surface);
    let distance = |p: &P3| {
        bvh.closest(surface, p)
            .map_or(0.0, |f| f64::from(f.distance))
    };
    points.iter().map(distance).sum::<f64>() / points.len() as f64
}

#[test]
fn an_outfit_is_captured_and_fits_its_own_body_exactly() {
    let template = embedded::template();
    let truth = TestScan::new(0.6, BLUE, GREY);
    let scan = truth.scan();
    let mut capture =
        OutfitCapture::new(template.clone(), CaptureConfig::default()).expect("a capture");
    let frame = capture.frame(&scan).expect("a person in clothes");
    let outfit = capture.outfit().expect("an outfit");

    let slots: Vec<Slot> = outfit.cloth.parts.iter().map(|p| p.slot).collect();
    assert_eq!(slots, [Slot::Top, Slot::Bottom, Slot::Shoes]);
    for (label, least) in [(1, 0.95), (2, 0.95), (3, 0.8)] {
        let score = f1(&truth.labels, &frame.labels, label);
        assert!(score > least, "label {label}: F1 {score:.3}");
    }
    let report = &frame.report;
    assert!(report.alignment.surface_error < 0.002, "{report:?}");
    assert!(report.part_errors.iter().all(|e| *e < 0.002), "{report:?}");
    let off = mean_distance(&frame.undressed.vertices, &truth.body);
    assert!(off < 0.008, "body under cloth: {off:.4} m");

    // Retargeted onto its own body it is where it was captured.
    let displacements = FrameDisplacements::of(&template, &frame);
    let body = template.personalise(&outfit.body.shape);
    let mut dresser = BodyDresser::new(template.clone(), &outfit.cloth).expect("a dresser");
    let own = dresser
        .dress(&body, &displacements, &frame.undressed.body.pose)
        .expect("dressed");
    for (a, b) in own.garments.iter().zip(&frame.garments) {
        let worst = a
            .iter()
            .zip(b)
            .map(|(p, q)| (p - q).norm())
            .fold(0.0, f32::max);
        assert!(worst < 1e-4, "{worst}");
    }

    // No vertex is inside any of some other bodies.
    for shape in population(&template, 4, 3) {
        let body = template.personalise(&shape);
        let pose = &frame.undressed.body.pose;
        let dressed = dresser.dress(&body, &displacements, pose).expect("dressed");
        let inside: Vec<usize> = dressed.reports.iter().map(|r| r.inside).collect();
        assert!(
            inside.iter().all(|n| *n == 0),
            "{inside:?} inside {shape:?}"
        );
    }
}

#[test]
fn a_stopped_capture_continues_where_it_ended() {
    let template = embedded::template();
    let scans = [
        TestScan::new(0.6, BLUE, GREY).scan(),
        TestScan::new(0.7, BLUE, GREY).scan(),
    ];
    let mut whole =
        OutfitCapture::new(template.clone(), CaptureConfig::default()).expect("a capture");
    let first = whole.frame(&scans[0]).expect("captured");
    let second = whole.frame(&scans[1]).expect("captured");

    let folder = tempfile::tempdir().expect("a folder");
    let archive = CaptureArchive::new(folder.path()).expect("an archive");
    assert!(archive.header(&template).expect("readable").is_none());
    let header = CaptureHeader {
        version: 0,
        template: template.name().into(),
        frame: scan::ScanFrame::default(),
        outfit: whole.outfit().expect("an outfit").clone(),
        clothed: whole.clothed().expect("aligned").clone(),
        scans: vec!["a".into(), "b".into()],
    };
    archive.write_header(&header).expect("written");
    let record = FrameRecord {
        scan: "a".into(),
        body: first.undressed.body.clone(),
        report: first.report.clone(),
    };
    let displacements = FrameDisplacements::of(&template, &first);
    archive
        .write_frame(&record, &displacements)
        .expect("written");

    let (archive, header) = CaptureArchive::open(folder.path(), &template).expect("a capture");
    let record = archive
        .record("a", &template)
        .expect("readable")
        .expect("done");
    assert!(archive.record("b", &template).expect("readable").is_none());
    assert_eq!(
        archive.displacements("a", &header).expect("readable"),
        displacements
    );
    let mut damaged = header.clone();
    damaged.outfit.cloth.parts[0].nodes.push(u32::MAX);
    archive.write_header(&damaged).expect("written");
    let refused = archive
        .header(&template)
        .expect_err("a vertex out of range");
    assert!(refused.to_string().contains("parts[0].nodes"), "{refused}");
    let state = (header.clothed, record.body);
    let mut resumed =
        OutfitCapture::resume(template, CaptureConfig::default(), header.outfit, state)
            .expect("a capture");
    let again = resumed.frame(&scans[1]).expect("captured");
    assert_eq!(again.labels, second.labels);
    for (a, b) in again.garments.iter().zip(&second.garments) {
        let worst = a
            .iter()
            .zip(b)
            .map(|(p, q)| (p - q).norm())
            .fold(0.0, f32::max);
        assert!(worst < 1e-5, "{worst}");
    }
}

#[test]
fn a_given_prior_overrides_the_number_of_garments() {
    let template = embedded::template();
    let scan = TestScan::new(0.0, BLUE, GREY).scan();
    let labels = LabelConfig {
        slots: Some(vec![Slot::Top, Slot::Bottom]),
        ..LabelConfig::default()
    };
    let mut segmenter = ScanSegmenter::new(template, labels).expect("a segmenter");
    let found = segmenter.step(&scan).expect("segmented");
    assert_eq!(found.parts().iter().max(), Some(&2));
}

#[test]
fn displacements_of_another_outfit_are_refused() {
    let template = embedded::template();
    let cloth = multi::MultiCloth::default();
    let mut dresser = BodyDresser::new(template.clone(), &cloth).expect("a dresser");
    let body = template.personalise(&BodyShape::default());
    let pose = crate::body::Pose::rest(template.skeleton(), crate::math::Rigid::identity());
    let refused = dresser.dress(&body, &FrameDisplacements::default(), &pose);
    assert!(matches!(refused, Err(CaptureError::Displacements { .. })));
}
