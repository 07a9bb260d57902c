use super::*;
use crate::recording::{open_as_recorded, open_as_recorded_with};
use crate::{FormatError, RecordingOptions, RgbdSource};
use proptest::prelude::*;
use std::fs;
use std::io::Write;

/// An npy array.
fn npy(descr: &str, shape: &str, bytes: &[u8]) -> Vec<u8> {
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    header.push_str(&" ".repeat(117 - header.len()));
    header.push('\n');
    [b"\x93NUMPY\x01\x00\x76\x00", header.as_bytes(), bytes].concat()
}

fn archive(arrays: &[(&str, Vec<u8>)], is_deflated: bool) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let method = match is_deflated {
        true => zip::CompressionMethod::Deflated,
        false => zip::CompressionMethod::Stored,
    };
    let options = zip::write::FileOptions::default().compression_method(method);
    for (name, bytes) in arrays {
        zip.start_file(format!("{name}.npy"), options)
            .expect("entry");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("finished").into_inner()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn k() -> Vec<u8> {
    npy(
        "<f4",
        "3, 3",
        &floats(&[5.0, 0.0, 1.5, 0.0, 6.0, 1.0, 0.0, 0.0, 1.0]),
    )
}

/// Depth of two frames of 2 × 3 millimetres.
fn depth() -> Vec<u8> {
    let mm: Vec<u16> = (0..12).map(|i| 1000 + i).collect();
    npy("<u2", "2, 2, 3", &shorts(&mm))
}

fn color() -> Vec<u8> {
    npy("|u1", "2, 2, 3, 3", &(0..36).collect::<Vec<u8>>())
}

fn open_bytes(bytes: &[u8]) -> (tempfile::TempDir, Result<NpzReader, FormatError>) {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = dir.path().join("a.npz");
    fs::write(&path, bytes).expect("written");
    let reader = NpzReader::open(&path, None);
    (dir, reader)
}

#[test]
fn frames_stream_from_stored_and_deflated_arrays() {
    for is_deflated in [false, true] {
        let arrays = [
            ("K", k()),
            ("poses", depth()),
            ("rgb", color()),
            ("depth", depth()),
        ];
        let (dir, _) = open_bytes(&archive(&arrays, is_deflated));
        let mut source = open_as_recorded(&dir.path().join("a.npz")).expect("opens");
        assert_eq!(
            (source.len(), source.untaken()),
            (Some(2), &["poses: array is not used".to_owned()][..])
        );
        let c = source.calibration().depth;
        assert_eq!(
            (c.width, c.height, c.fx, c.fy, c.cx, c.cy),
            (3, 2, 5.0, 6.0, 1.5, 1.0)
        );
        for _ in 0..2 {
            let first = source.next_frame().expect("reads").expect("a frame");
            let second = source.next_frame().expect("reads").expect("a frame");
            assert_eq!(first.depth.data(), [1000, 1001, 1002, 1003, 1004, 1005]);
            assert_eq!((second.depth.at(0, 0), second.time_ns), (1006, 33_333_333));
            assert_eq!(second.color.map(|c| c.at(0, 0)), Some([18, 19, 20]));
            assert!(source.next_frame().expect("ends").is_none());
            source.rewind().expect("rewinds");
        }
    }
}

/// Files that numpy wrote (`make_tiny.py`): deflated millimetres and stored metres, `K` with its columns first.
#[test]
fn numpys_files_read() {
    for (bytes, has_color) in [
        (&include_bytes!("tiny.npz")[..], true),
        (include_bytes!("tiny_stored.npz"), false),
    ] {
        let (_dir, reader) = open_bytes(bytes);
        let mut reader = reader.expect("opens");
        let c = reader.calibration().depth;
        assert_eq!((c.fx, c.fy, c.cx, c.cy), (5.0, 6.0, 2.0, 1.5));
        for i in 0..2u16 {
            let frame = reader.next_frame().expect("reads").expect("a frame");
            let expected: Vec<u16> = (0..20).map(|p| 1000 + 20 * i + p).collect();
            assert_eq!(frame.depth.data(), expected);
            let color = frame.color.map(|c| c.at(4, 3));
            let last = 60 * (i as u8 + 1);
            assert_eq!(color, has_color.then_some([last - 3, last - 2, last - 1]));
        }
    }
}

#[test]
fn the_type_decides_the_unit() {
    let metres = floats(&[1.5, f32::NAN, 0.0, 70.0, -1.0, 0.001]);
    let (_dir, reader) = open_bytes(&archive(
        &[("K", k()), ("depth", npy("<f4", "2, 3", &metres))],
        true,
    ));
    let mut reader = reader.expect("opens");
    let frame = reader.next_frame().expect("reads").expect("a frame");
    assert_eq!(frame.depth.data(), [1500, 0, 0, 0, 0, 1]);
}

#[test]
fn faults_are_named() {
    let refusal = |arrays: &[(&str, Vec<u8>)]| {
        let (_dir, reader) = open_bytes(&archive(arrays, false));
        reader.expect_err("must be refused").to_string()
    };
    let mm = floats(&[1500.0; 6]);
    let e = refusal(&[("K", k()), ("depth", npy("<f4", "1, 2, 3", &mm))]);
    assert!(
        e.contains("`depth`") && e.contains("save millimetres as uint16"),
        "{e}"
    );
    let e = refusal(&[("K", k()), ("depth", npy("<i4", "1, 2, 3", &mm))]);
    assert!(e.contains("I32") && e.contains("float32 metres"), "{e}");
    let e = refusal(&[("K", k()), ("depth", npy("<f2", "1, 2, 3", &mm[..12]))]);
    assert!(e.contains("`depth`") && e.contains("<f2"), "{e}");
    let e = refusal(&[("K", k()), ("depth", npy("<f4", "9, 2, 3", &mm))]);
    assert!(e.contains("does not match"), "{e}");
    assert!(refusal(&[("K", k())]).contains("`depth`: missing"));
    assert!(refusal(&[("depth", depth())]).contains("--camera"));
    let row = npy("<f4", "9,", &floats(&[0.0; 9]));
    assert!(refusal(&[("K", row), ("depth", depth())]).contains("expected [3, 3]"));
    let flat = npy("<f4", "3, 3", &floats(&[0.0; 9]));
    assert!(refusal(&[("K", flat), ("depth", depth())]).contains("`K`"));
    let both = [
        ("K", k()),
        ("depth", depth()),
        ("rgb", color()),
        ("color", color()),
    ];
    assert!(refusal(&both).contains("`color, rgb`"));
    let small = npy("|u1", "1, 2, 3, 3", &[0; 18]);
    assert!(refusal(&[("K", k()), ("depth", depth()), ("rgb", small)]).contains("`rgb`"));
    let mut nested = npy("<u2", "2, 2, 3", &[0; 24]);
    nested[10..100].fill(b'(');
    assert!(refusal(&[("K", k()), ("depth", nested)]).contains("nests"));
    let (_dir, reader) = open_bytes(b"no zip");
    assert!(reader.expect_err("no zip").to_string().contains("`zip`"));
}

#[test]
fn a_camera_file_stands_in_for_k() {
    let (dir, _) = open_bytes(&archive(&[("depth", depth())], false));
    let camera = dir.path().join("camera.json");
    let text = r#"{"width": 3, "height": 2, "fx": 5, "fy": 5, "cx": 1, "cy": 0.5, "distortion": [0.1, 0, 0, 0]}"#;
    fs::write(&camera, text).expect("written");
    let options = RecordingOptions {
        camera: Some(camera.clone()),
        ..RecordingOptions::default()
    };
    let path = dir.path().join("a.npz");
    let source = open_as_recorded_with(&path, &options).expect("opens");
    assert_eq!(source.lenses().depth.distortion.radial[0], 0.1);
    fs::write(&camera, text.replace("\"width\": 3", "\"width\": 4")).expect("written");
    let e = open_as_recorded_with(&path, &options)
        .err()
        .expect("another size");
    assert!(
        e.to_string().contains("3×2, but the camera says 4×2"),
        "{e}"
    );
}

/// Damaged files a run; thousands with `TRYON_DAMAGE_CASES`.
fn damage_cases() -> u32 {
    let stated = std::env::var("TRYON_DAMAGE_CASES").ok();
    stated.and_then(|n| n.parse().ok()).unwrap_or(300)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(damage_cases()))]
    #[test]
    fn damaged_files_never_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
        is_deflated in any::<bool>(),
    ) {
        let mut bytes = archive(&[("K", k()), ("depth", depth()), ("rgb", color())], is_deflated);
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let (_dir, reader) = open_bytes(&bytes);
        if let Ok(mut reader) = reader {
            while !matches!(reader.next_frame(), Ok(None)) {}
        }
    }
}
