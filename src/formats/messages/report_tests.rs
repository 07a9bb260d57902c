//! Recordings as others write them (`shared/data/reports`), each with its right value.

use crate::recording::{open_as_recorded, open_as_recorded_with};
use crate::{RecordingOptions, RgbdSource, shared_data};
use tryon_geometry::camera::RgbdFrame;

fn frames(source: &mut dyn RgbdSource) -> Vec<RgbdFrame> {
    std::iter::from_fn(|| source.next_frame().expect("reads")).collect()
}

fn report(file: &str) -> Option<(Box<dyn RgbdSource>, Vec<RgbdFrame>)> {
    let path = shared_data(format!("reports/{file}"))?;
    let mut source = open_as_recorded(&path).expect("opens");
    let frames = frames(&mut *source);
    Some((source, frames))
}

#[test]
fn all_compressions_of_chunks_give_the_same_frames() {
    let read = ["plain", "lz4", "zstd"].map(|name| report(&format!("mcap_zstd/{name}.mcap")));
    let [Some((_, plain)), Some((_, lz4)), Some((_, zstd))] = read else {
        return;
    };
    assert_eq!(plain.len(), 6);
    assert!(plain.iter().all(|f| f.color.is_some()));
    assert_eq!(plain, lz4);
    assert_eq!(plain, zstd);
}

#[test]
fn float_depth_is_read_as_metres() {
    let Some((_, frames)) = report("mcap_float_depth/32fc1.mcap") else {
        return;
    };
    for (i, f) in frames.iter().enumerate() {
        let want = 1000 + 10 * i as u16;
        assert!(f.depth.data().iter().all(|d| *d == want), "frame {i}");
    }
    assert_eq!(frames.len(), 6);
}

#[test]
fn every_channel_order_of_raw_color_is_read() {
    for file in ["bgr8", "rgba8"] {
        let Some((source, frames)) = report(&format!("mcap_color_encodings/{file}.mcap")) else {
            return;
        };
        assert!(source.untaken().is_empty(), "{:?}", source.untaken());
        assert_eq!(frames.len(), 6);
        for (i, f) in frames.iter().enumerate() {
            let color = f.color.as_ref().expect("colour");
            let want = 10 + 10 * i as u8;
            assert!(color.data().iter().all(|c| *c == want), "{file} frame {i}");
        }
    }
}

#[test]
fn distortion_is_stated() {
    let Some((source, _)) = report("mcap_distortion/d.mcap") else {
        return;
    };
    let lenses = source.lenses();
    assert_eq!(lenses.depth.distortion.radial[0], -0.25);
    assert_eq!(lenses.depth.distortion.radial[1], 0.06);
    assert_eq!(lenses.depth.intrinsics, source.calibration().depth);
    assert_eq!(lenses.color, None);
}

#[test]
fn a_wished_topic_that_is_missing_lists_the_others() {
    let Some(path) = shared_data("reports/mcap_zstd/zstd.mcap") else {
        return;
    };
    let options = RecordingOptions {
        depth_topic: Some("/no".into()),
        ..RecordingOptions::default()
    };
    let opened = open_as_recorded_with(&path, &options).map(|_| "opened");
    let e = opened.expect_err("no such topic").to_string();
    assert!(
        e.contains("`/no`") && e.contains("`/depth` (16UC1 64×48)"),
        "{e}"
    );
}
