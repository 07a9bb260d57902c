use super::*;
use crate::{RgbdSource, open_recording};
use nalgebra::{UnitQuaternion, Vector3};
use std::fs;
use std::path::Path;
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::Rigid;

const TINY: Intrinsics = Intrinsics {
    width: 32,
    height: 24,
    fx: 30.0,
    fy: 31.0,
    cx: 15.5,
    cy: 11.5,
};

fn frame(i: u64, color: bool) -> RgbdFrame {
    let depth = (0..32 * 24)
        .map(|k| ((k * 7 + i * 13) % 4000) as u16)
        .collect();
    RgbdFrame {
        sequence: 100 + i,
        time_ns: 1_700_000_000_123_456_789 + i * 33_333_333,
        depth: DepthImage::new(32, 24, depth).expect("sizes"),
        color: color.then(|| ColorImage::filled(32, 24, [200, i as u8 * 9, 30])),
    }
}

fn written(dir: &Path, calibration: &Calibration, frames: &[RgbdFrame]) -> std::path::PathBuf {
    let path = dir.join("r.mcap");
    let mut w = McapWriter::create(&path, calibration).expect("created");
    frames.iter().for_each(|f| w.write(f).expect("written"));
    w.finish().expect("finished");
    path
}

fn all(mut r: Box<dyn RgbdSource>) -> Vec<RgbdFrame> {
    std::iter::from_fn(|| r.next_frame().expect("reads")).collect()
}

#[test]
fn written_frames_read_back() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let calibration = Calibration {
        depth: TINY,
        color: Some(TINY),
        color_from_depth: Rigid::from_parts(
            Vector3::new(0.025, 0.001, 0.0),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.02, 0.0)),
        ),
    };
    let frames: Vec<_> = (0..5).map(|i| frame(i, i != 3)).collect();
    let path = written(dir.path(), &calibration, &frames);
    assert!(
        McapWriter::create(&path, &calibration).is_err(),
        "never writes over a recording"
    );
    let r = open_recording(&path).expect("opens");
    let back = r.calibration().clone();
    assert_eq!((back.depth, back.color), (TINY, Some(TINY)));
    let off = (back.color_from_depth.inverse() * calibration.color_from_depth)
        .iso()
        .translation
        .vector
        .norm();
    assert!(off < 1e-9, "{off}");
    let got = all(r);
    assert_eq!(got.len(), frames.len());
    for (g, f) in got.iter().zip(&frames) {
        assert_eq!(
            (g.sequence, g.time_ns, &g.depth),
            (f.sequence, f.time_ns, &f.depth)
        );
        assert_eq!(g.color.is_some(), f.color.is_some());
        if let (Some(a), Some(b)) = (&g.color, &f.color) {
            assert!(
                a.data()
                    .iter()
                    .zip(b.data())
                    .all(|(x, y)| x.abs_diff(*y) < 8)
            );
        }
    }
}

#[test]
fn registered_colour_has_one_calibration_and_rewind_restarts() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = written(
        dir.path(),
        &Calibration::registered(TINY),
        &[frame(0, true), frame(1, true)],
    );
    let mut r = open_recording(&path).expect("opens");
    assert_eq!(r.calibration(), &Calibration::registered(TINY));
    let first = r.next_frame().expect("reads");
    r.rewind().expect("rewinds");
    assert_eq!(r.next_frame().expect("reads"), first);
    assert!(r.next_frame().expect("reads").is_some() && r.next_frame().expect("ends").is_none());
}

/// A writer states the lengths of a chunk when it is whole: on a full disk they stay unknown.
#[test]
fn a_chunk_that_was_never_finished_ends_the_file() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let frames: Vec<RgbdFrame> = (0..3).map(|i| frame(i, true)).collect();
    let path = written(dir.path(), &Calibration::registered(TINY), &frames);
    let mut bytes = fs::read(&path).expect("read");
    let data_end = bytes
        .windows(9)
        .rposition(|w| w[0] == 0x0f && w[1..] == 4u64.to_le_bytes());
    bytes.truncate(data_end.expect("the end of the data"));
    bytes.push(0x06);
    bytes.extend([0xff; 8]);
    bytes.extend([0; 28]);
    bytes.extend(3u32.to_le_bytes());
    bytes.extend(*b"lz4");
    bytes.extend([0xff; 8]);
    bytes.extend([1; 100]);
    fs::write(&path, bytes).expect("written");
    assert_eq!(all(open_recording(&path).expect("opens")).len(), 3);
}

#[test]
fn a_truncated_file_keeps_all_whole_frames() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let frames: Vec<_> = (0..4).map(|i| frame(i, i % 2 == 0)).collect();
    let path = written(dir.path(), &Calibration::registered(TINY), &frames);
    let bytes = fs::read(&path).expect("read");
    // Sizes of the file after each frame.
    let mut ends = Vec::new();
    for n in 1..=frames.len() {
        let sub = tempfile::tempdir().expect("temporary folder");
        let path = sub.path().join("p.mcap");
        let mut w = McapWriter::create(&path, &Calibration::registered(TINY)).expect("created");
        frames[..n]
            .iter()
            .for_each(|f| w.write(f).expect("written"));
        std::mem::forget(w.finish());
        let p = fs::read(&path).expect("read");
        ends.push(p.iter().zip(&bytes).take_while(|(a, b)| a == b).count());
    }
    let cut = dir.path().join("cut.mcap");
    for at in (0..bytes.len()).step_by(7) {
        fs::write(&cut, &bytes[..at]).expect("written");
        let whole = ends.iter().filter(|e| **e <= at).count();
        match open_recording(&cut) {
            Err(e) => assert!(
                whole == 0 && e.to_string().contains("cut.mcap"),
                "cut at {at}: {e}"
            ),
            Ok(r) => {
                let got = all(r);
                assert!(
                    got.len() >= whole,
                    "cut at {at}: {} of {whole} frames",
                    got.len()
                );
                assert!(got.iter().zip(&frames).all(|(g, f)| g.depth == f.depth));
            }
        }
    }
}

#[test]
fn false_lengths_and_noise_are_errors() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = dir.path().join("bad.mcap");
    let refuse = |bytes: &[u8]| {
        fs::write(&path, bytes).expect("written");
        let opened = open_recording(&path).map(|_| "opened");
        opened.expect_err("must be refused").to_string()
    };
    // A record of 4 GiB.
    let mut lie = mcap::MAGIC.to_vec();
    lie.push(0x05);
    lie.extend(u64::from(u32::MAX).to_le_bytes());
    let e = refuse(&lie);
    assert!(e.contains("bad.mcap") && e.contains("exceeds limit"), "{e}");
    assert!(refuse(b"RIFFxxxx").contains("magic"));
    assert!(!refuse(b"").is_empty());
    let good = fs::read(written(
        dir.path(),
        &Calibration::registered(TINY),
        &[frame(0, true)],
    ))
    .expect("read");
    let mut x = 0x9e37_79b9u32;
    for _ in 0..300 {
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        let mut bytes = good.clone();
        let n = bytes.len();
        bytes[x as usize % n] ^= (x >> 24) as u8 | 1;
        fs::write(&path, &bytes).expect("written");
        // No panic; a file with a damaged frame may still open.
        if let Ok(mut r) = open_recording(&path) {
            while let Ok(Some(_)) = r.next_frame() {}
        }
    }
}

/// A file cut anywhere and continued is the file of one writer, byte for byte.
#[test]
fn a_stopped_recording_continues() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let calibration = Calibration {
        color: Some(TINY),
        ..Calibration::registered(TINY)
    };
    let frames: Vec<_> = (0..5).map(|i| frame(i, i != 3)).collect();
    let path = written(dir.path(), &calibration, &frames);
    let whole = fs::read(&path).expect("read");
    let (part, next) = (dir.path().join("part.mcap"), dir.path().join("next.mcap"));
    let mut most = 0;
    for share in 0..64 {
        let cut = 8 + share * (whole.len() - 8) / 63;
        fs::write(&part, &whole[..cut]).expect("written");
        let resumed = McapWriter::resume(&next, &part, &calibration, 4);
        let mut writer = resumed.expect("resumes");
        let there = writer.frames();
        most = most.max(there);
        let rest = &frames[there..];
        rest.iter().for_each(|f| writer.write(f).expect("written"));
        writer.finish().expect("finished");
        assert!(
            fs::read(&next).expect("read") == whole,
            "cut at {cut}, {there} frames"
        );
        fs::remove_file(&next).expect("removed");
    }
    assert_eq!(most, 4, "no more than asked for");
}
