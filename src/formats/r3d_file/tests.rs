use super::*;
use crate::{FormatError, RgbdSource};
use proptest::prelude::*;
use std::fs;

/// Three frames of own content, their depth compressed by Apple's library (`make_tiny.py`).
const TINY: &[u8] = include_bytes!("tiny.r3d");

fn open_bytes(bytes: &[u8]) -> (tempfile::TempDir, Result<R3dReader, FormatError>) {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = dir.path().join("a.r3d");
    fs::write(&path, bytes).expect("written");
    let reader = R3dReader::open(&path);
    (dir, reader)
}

#[test]
fn apples_bytes_are_read() {
    let (dir, _) = open_bytes(TINY);
    let mut source = crate::open_recording(&dir.path().join("a.r3d")).expect("opens");
    let k = source.calibration().clone();
    assert_eq!(
        (k.depth.width, k.depth.height, k.depth.fx, k.depth.fy),
        (48, 64, 60.0, 62.0)
    );
    assert_eq!((k.depth.cx, k.depth.cy), (23.5, 31.5));
    assert_eq!(k.color.map(|c| (c.width, c.fx)), Some((96, 120.0)));
    let notes = source.untaken().join("\n");
    assert!(
        notes.contains("poses") && notes.contains("by up to 1.0 %"),
        "{notes}"
    );
    assert!(notes.contains("confidence"), "{notes}");
    for i in 0..3u16 {
        let frame = source.next_frame().expect("reads").expect("a frame");
        assert_eq!(frame.time_ns, [0, 16_600_000, 33_300_000][usize::from(i)]);
        for v in 0..64u16 {
            for u in 0..48u16 {
                let mm = frame.depth.at(i32::from(u), i32::from(v));
                let none = u == 0 && v < 3;
                let expected = if none { 0 } else { 1000 + 2 * v + u + 100 * i };
                assert_eq!(mm, expected, "frame {i}, pixel {u}, {v}");
            }
        }
        let color = frame.color.expect("colour").at(50, 50);
        assert!(color[0].abs_diff(40 * i as u8 + 20) <= 3 && color[2].abs_diff(200) <= 3);
    }
    assert!(source.next_frame().expect("ends").is_none());
    source.rewind().expect("rewinds");
    assert!(source.next_frame().expect("reads").is_some());
}

/// A stored archive with `metadata` and one depth.
fn archive(metadata: &str, depth: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let stored =
        zip::write::FileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in [("metadata", metadata.as_bytes()), ("rgbd/0.depth", depth)] {
        zip.start_file(name, stored).expect("entry");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("finished").into_inner()
}

/// An LZFSE stream of one uncompressed block.
fn uncompressed(bytes: &[u8]) -> Vec<u8> {
    [
        b"bvx-",
        &(bytes.len() as u32).to_le_bytes()[..],
        bytes,
        b"bvx$",
    ]
    .concat()
}

const METADATA: &str =
    r#"{"w": 2, "h": 2, "dw": 2, "dh": 2, "K": [2, 0, 0, 0, 2, 0, 0.5, 0.5, 1], "fps": 30}"#;

#[test]
fn faults_are_named() {
    let refusal = |bytes: &[u8]| {
        let (_dir, reader) = open_bytes(bytes);
        match reader {
            Err(e) => e.to_string(),
            Ok(mut r) => r.next_frame().expect_err("must be refused").to_string(),
        }
    };
    let depth = uncompressed(&[0; 8]);
    let (_dir, reader) = open_bytes(&archive(METADATA, &depth));
    let mut reader = reader.expect("opens");
    assert!(reader.calibration().color.is_none() && reader.untaken().is_empty());
    assert!(
        reader
            .next_frame()
            .expect("reads")
            .is_some_and(|f| f.color.is_none())
    );
    for (from, to, field) in [
        ("0.5, 0.5, 1", "1", "`K`"),
        ("0, 0.5, 0.5", "0.5, 0.5, 0", "`K`"),
        ("\"w\": 2", "\"w\": 2.5", "`w`"),
        ("\"w\": 2", "\"v\": 2", "`w`"),
        ("\"dw\": 2", "\"dw\": -1", "`dw`"),
        (
            "\"dw\": 2, \"dh\": 2",
            "\"dw\": 16000, \"dh\": 16000",
            "`width, height`",
        ),
        ("{", "", "`metadata`"),
    ] {
        let e = refusal(&archive(&METADATA.replacen(from, to, 1), &depth));
        assert!(e.contains(field), "{to}: {e}");
    }
    let e = refusal(&archive(METADATA, &uncompressed(&[0; 6])));
    assert!(
        e.contains("rgbd/0.depth") && e.contains("6 bytes for 2×2"),
        "{e}"
    );
    // A stream that expands without end stops one byte after the image.
    let e = refusal(&archive(METADATA, &uncompressed(&[0; 3000])));
    assert!(e.contains("17 bytes"), "{e}");
    assert!(refusal(&archive(METADATA, b"no lzfse")).contains("LZFSE"));
    assert!(refusal(b"no zip").contains("`zip`"));
}

/// Damaged files a run; thousands with `TRYON_DAMAGE_CASES`.
fn damage_cases() -> u32 {
    let stated = std::env::var("TRYON_DAMAGE_CASES").ok();
    stated.and_then(|n| n.parse().ok()).unwrap_or(300)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(damage_cases()))]

    #[test]
    fn damaged_archives_never_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = TINY.to_vec();
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

    /// The archive's own checksums catch most damage: here the streams themselves are damaged.
    #[test]
    fn damaged_streams_never_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        frame in 0..3u64,
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let metadata = METADATA.replace("\"dw\": 2, \"dh\": 2", "\"dw\": 48, \"dh\": 64");
        let (dir, _) = open_bytes(TINY);
        let path = dir.path().join("a.r3d");
        let mut zip = crate::zip_entries::open_zip(&path).expect("opens");
        let name = format!("rgbd/{frame}.depth");
        let read = crate::zip_entries::read_entry(&path, &mut zip, &name, 1 << 20);
        let mut stream = read.expect("read");
        for (at, value) in flips {
            let at = at.index(stream.len());
            stream[at] = value;
        }
        if let Some(cut) = cut {
            stream.truncate(cut.index(stream.len()));
        }
        let (_dir, reader) = open_bytes(&archive(&metadata, &stream));
        let _ = reader.expect("opens").next_frame();
    }
}
