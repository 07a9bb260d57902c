//! A whole capture of a synthetic scan: found, aligned, segmented, fitted, undressed, retargeted.

use super::archive::{CaptureArchive, CaptureHeader, FrameDisplacements, FrameRecord};
use super::segment::Slot;
use super::test_scans::{TestScan, f1};
use super::*;
use tryon_body::{BodyShape, embedded};
use tryon_geometry::math::P3;
use tryon_geometry::spatial::Bvh;

const BLUE: [u8; 3] = [60, 90, 190];
const GREY: [u8; 3] = [70, 70, 75];

fn capture(config: OutfitCaptureConfig) -> OutfitCapture {
    OutfitCapture::new(embedded::template(), config).expect("a capture")
}

/// Largest distance between corresponding vertices of all garments, metres.
fn worst(a: &[Vec<P3>], b: &[Vec<P3>]) -> f32 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(p, q)| (p - q).norm()).fold(0.0, f32::max)
}

/// Mean distance of points from the surface of a posed template, metres.
fn mean_distance(points: &[P3], surface: &[P3]) -> f64 {
    let bvh = Bvh::new(embedded::template().mesh().faces(), surface);
    let found = points.iter().filter_map(|p| bvh.closest(surface, p));
    found.map(|f| f64::from(f.distance)).sum::<f64>() / points.len() as f64
}

#[test]
fn an_outfit_is_captured_and_fits_its_own_body_exactly() {
    let template = embedded::template();
    let truth = TestScan::new(0.6, BLUE, GREY);
    let scan = truth.scan();
    let mut capture = capture(OutfitCaptureConfig::default());
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
    let pose = &frame.undressed.body.pose;
    let own = dresser.dress(&body, &displacements, pose);
    let own = own.expect("dressed");
    let moved = worst(&own.garments, &frame.garments);
    assert!(moved < 1e-4, "{moved}");

    // Its textures show the colours of the scan, but for its shades of 15 %.
    for (texture, wanted) in capture.textures().iter().zip([BLUE, GREY]) {
        let seen = (0..).zip(texture.image().data().chunks(3));
        let seen = seen.filter(|(i, _)| texture.is_seen(*i));
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for (_, c) in seen {
            count += 1.0;
            (0..3).for_each(|k| sum[k] += f64::from(c[k]));
        }
        for (sum, wanted) in sum.iter().zip(wanted) {
            let mean = sum / count;
            let off = (mean - f64::from(wanted)).abs();
            assert!(off < 12.0, "{mean} for {wanted}");
        }
    }

    // No vertex is inside any of some other bodies.
    for shape in population(&template, 4, 3) {
        let body = template.personalise(&shape);
        let dressed = dresser.dress(&body, &displacements, pose).expect("dressed");
        let inside: usize = dressed.reports.iter().map(|r| r.inside).sum();
        assert_eq!(inside, 0, "inside {shape:?}");
    }
}

#[test]
fn a_stopped_capture_continues_where_it_ended() {
    let template = embedded::template();
    let scans = [0.6, 0.7].map(|yaw| TestScan::new(yaw, BLUE, GREY).scan());
    let mut whole = capture(OutfitCaptureConfig::default());
    let first = whole.frame(&scans[0]).expect("captured");
    let textures = whole.textures().to_vec();
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
    archive.write_textures(&textures).expect("written");
    archive.write_header(&header).expect("written");
    let record = FrameRecord {
        scan: "a".into(),
        body: first.undressed.body.clone(),
        report: first.report.clone(),
    };
    let displacements = FrameDisplacements::of(&template, &first);
    let written = archive.write_frame(&record, &displacements);
    written.expect("written");

    let (archive, header) = CaptureArchive::open(folder.path(), &template).expect("a capture");
    let record = |name| archive.record(name, &template).expect("readable");
    assert!(record("b").is_none());
    let record = record("a").expect("done");
    let read = |header: &CaptureHeader| archive.displacements("a", header, &template);
    assert_eq!(read(&header).expect("readable"), displacements);
    // A skirt's clothed template has more vertices than the body.
    let mut joined = header.clone();
    joined.clothed.rest.push(P3::origin());
    assert_eq!(read(&joined).expect("readable"), displacements);
    let refused = |damage: &dyn Fn(&mut CapturedOutfit), field: &str| {
        let mut damaged = header.clone();
        damage(&mut damaged.outfit);
        archive.write_header(&damaged).expect("written");
        let fault = archive.header(&template).expect_err("damaged");
        assert!(fault.to_string().contains(field), "{fault}");
    };
    refused(&|o| o.cloth.parts[0].nodes.push(u32::MAX), "parts[0].nodes");
    refused(&|o| o.atlases[0].uv[0] = [0.5, 1.5], "atlases[0].uv");
    let textures = archive.textures(&header).expect("readable");
    let (config, outfit) = (OutfitCaptureConfig::default(), header.outfit);
    let mut resumed = OutfitCapture::resume(template, config, outfit, header.clothed, record.body)
        .expect("a capture")
        .with_textures(textures);
    let again = resumed.frame(&scans[1]).expect("captured");
    assert_eq!(again.labels, second.labels);
    let moved = worst(&again.garments, &second.garments);
    assert!(moved < 1e-5, "{moved}");
    assert_eq!(resumed.textures(), whole.textures());
}

#[test]
fn displacements_of_another_outfit_are_refused() {
    let template = embedded::template();
    let cloth = multi::MultiCloth::default();
    let mut dresser = BodyDresser::new(template.clone(), &cloth).expect("a dresser");
    let body = template.personalise(&BodyShape::default());
    let pose = tryon_body::Pose::rest(template.skeleton(), tryon_geometry::math::Rigid::identity());
    let refused = dresser.dress(&body, &FrameDisplacements::default(), &pose);
    assert!(matches!(refused, Err(CaptureError::Displacements { .. })));
}

/// Mean distance between corresponding vertices of all garments, metres.
fn mean_change(a: &FrameCapture, b: &FrameCapture) -> f64 {
    let pairs = a.garments.iter().flatten().zip(b.garments.iter().flatten());
    let (sum, n) = pairs.fold((0.0, 0), |(s, n), (p, q)| {
        (s + f64::from((p - q).norm()), n + 1)
    });
    sum / f64::from(n)
}

#[test]
fn skipping_is_counted_and_changes_garments_by_a_third_of_a_millimetre_at_most() {
    let scans = [0.6, 0.7].map(|yaw| TestScan::new(yaw, BLUE, GREY).scan());
    let captured = |without_skips| {
        let mut capture = capture(OutfitCaptureConfig {
            without_skips,
            ..OutfitCaptureConfig::default()
        });
        let frame = |scan| capture.frame(scan).expect("captured");
        scans.each_ref().map(frame)
    };
    let (whole, some) = (captured(true), captured(false));
    // Nothing is skipped in the first scan.
    assert_eq!(whole[0].garments, some[0].garments);
    assert_eq!(some[0].report.queries.skipped, 0);
    let change = mean_change(&whole[1], &some[1]);
    assert!(change < 3.3e-4, "{change}");
    assert_eq!(whole[1].report.queries.skipped, 0);
    assert_eq!(whole[1].report.alignment.queries.skipped, 0);
    let report = &some[1].report;
    let (parts, single) = (report.queries, report.alignment.queries);
    assert!(parts.skipped > 0 && single.skipped > 0, "{report:?}");
    assert!(parts.near > 0 && single.near > 0, "{report:?}");
    for counts in [report.vertices, report.alignment.vertices] {
        assert!(counts.settled > 0 && counts.solved > 0, "{report:?}");
    }
    for frame in [&whole[0], &whole[1], &some[0]] {
        for counts in [frame.report.vertices, frame.report.alignment.vertices] {
            assert!(counts.settled == 0 && counts.unseen == 0 && counts.solved > 0);
        }
    }
}

#[test]
fn an_unchanged_scan_repeats_what_its_capture_would_give() {
    let scans = [0.6, 0.7].map(|yaw| TestScan::new(yaw, BLUE, GREY).scan());
    let mut noisy = scans[1].clone();
    for (k, p) in noisy.points.iter_mut().enumerate() {
        p.x += 5e-5 * (k as f32).sin();
    }
    assert!(noisy.is_unchanged(&scans[1]) && !noisy.is_unchanged(&scans[0]));
    let mut recoloured = scans[1].clone();
    recoloured.colors[0] = [1, 2, 3];
    assert!(!recoloured.is_unchanged(&scans[1]));
    let mut capture = capture(OutfitCaptureConfig::default());
    capture.frame(&scans[0]).expect("captured");
    let second = capture.frame(&scans[1]).expect("captured");
    let third = capture.frame(&noisy).expect("captured");
    // Poses converge to half a millimetre from wherever they start, here from that of the second scan.
    let change = mean_change(&second, &third);
    assert!(change < 5e-4, "{change}");
}

#[test]
fn several_scans_give_one_shape_and_a_minimal_scan_overrides_them() {
    let truths = [0.6, 0.7, 0.8].map(|yaw| TestScan::new(yaw, BLUE, GREY));
    let scans = truths.each_ref().map(TestScan::scan);
    let mut several = capture(OutfitCaptureConfig::default());
    (1..3).for_each(|k| several.add_shape_scan(scans[k].clone()));
    let frame = several.frame(&scans[0]).expect("captured");
    let off = mean_distance(&frame.undressed.vertices, &truths[0].body);
    assert!(off < 0.008, "body under cloth: {off:.4} m");

    let shape = BodyShape {
        coefficients: vec![0.7, -0.4, 0.6],
        ..BodyShape::default()
    };
    let mut capture = capture(OutfitCaptureConfig {
        minimal: Some(shape.clone()),
        ..OutfitCaptureConfig::default()
    });
    let known = capture.frame(&scans[0]).expect("captured");
    assert_eq!(known.undressed.body.shape, shape);
    let less = mean_distance(&known.undressed.vertices, &truths[0].body);
    assert!(less < off, "{less} {off}");
}
