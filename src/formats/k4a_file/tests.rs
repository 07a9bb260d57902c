use super::*;
use crate::{FormatError, RgbdSource};
use nalgebra::Point3;
use proptest::prelude::*;
use std::fs;
use std::path::Path;
use tryon_geometry::camera::RgbdFrame;

/// An element with a size of eight bytes.
fn element(id: u32, payload: &[u8]) -> Vec<u8> {
    let bytes = id.to_be_bytes();
    let mut out = bytes[bytes.iter().take_while(|b| **b == 0).count()..].to_vec();
    out.extend((payload.len() as u64 | 1 << 56).to_be_bytes());
    out.extend(payload);
    out
}

fn unsigned(id: u32, value: u64) -> Vec<u8> {
    element(id, &value.to_be_bytes())
}

fn track(number: u64, name: &str, code: &[u8; 4], (w, h): (u64, u64)) -> Vec<u8> {
    let mut bitmap = [0; 40];
    bitmap[16..20].copy_from_slice(code);
    let parts = [
        unsigned(0xd7, number),
        element(0x536e, name.as_bytes()),
        element(0x86, b"V_MS/VFW/FOURCC"),
        element(0x63a2, &bitmap),
        unsigned(0x23_e383, 33_333_333),
        element(0xe0, &[unsigned(0xb0, w), unsigned(0xba, h)].concat()),
    ];
    element(0xae, &parts.concat())
}

fn tag(name: &str, value: &str) -> Vec<u8> {
    let simple = [
        element(0x45a3, name.as_bytes()),
        element(0x4487, value.as_bytes()),
    ];
    element(0x7373, &element(0x67c8, &simple.concat()))
}

fn block(track: u8, milliseconds: i16, frame: &[u8]) -> Vec<u8> {
    let [high, low] = milliseconds.to_be_bytes();
    element(0xa3, &[&[0x80 | track, high, low, 0x80], frame].concat())
}

const CALIBRATION: &str = r#"{"CalibrationInformation": {"Cameras": [
  {"Intrinsics": {"ModelParameters": [0.5, 0.5, 0.49, 0.49, 0.1, 0, 0, 0, 0, 0, 0, 0, 0.002, 0.001],
    "ModelType": "CALIBRATION_LensDistortionModelBrownConrady"}, "Location": "CALIBRATION_CameraLocationD0",
   "Rt": {"Rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "Translation": [0, 0, 0]}, "SensorHeight": 1024, "SensorWidth": 1024},
  {"Intrinsics": {"ModelParameters": [0.5, 0.5, 0.48, 0.64, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    "ModelType": "CALIBRATION_LensDistortionModelBrownConrady"}, "Location": "CALIBRATION_CameraLocationPV0",
   "Rt": {"Rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "Translation": [-0.032, 0, 0.004]}, "SensorHeight": 3072, "SensorWidth": 4096}
]}}"#;

/// A recording: tracks of 320 × 288 depth and 16 × 9 colour, tags, and two clusters of their blocks.
fn file_of(tracks: &[Vec<u8>], tags: &[Vec<u8>], clusters: &[Vec<Vec<u8>>]) -> Vec<u8> {
    let attached = [
        element(0x466e, b"calibration.json"),
        element(0x465c, CALIBRATION.as_bytes()),
    ];
    let attached = element(0x61a7, &attached.concat());
    let mut segment = [
        element(0x1549_a966, &unsigned(0x2a_d7b1, 1_000_000)),
        element(0x1654_ae6b, &tracks.concat()),
        element(0x1941_a469, &attached),
        element(0x1254_c367, &tags.concat()),
    ]
    .concat();
    for (i, blocks) in clusters.iter().enumerate() {
        let time = unsigned(0xe7, 1000 * i as u64);
        segment.extend(element(0x1f43_b675, &[time, blocks.concat()].concat()));
    }
    [
        element(0x1a45_dfa3, &element(0x4282, b"matroska")),
        element(0x1853_8067, &segment),
    ]
    .concat()
}

const DEPTH_BYTES: usize = 2 * 320 * 288;

fn depth_frame(mm: u16) -> Vec<u8> {
    mm.to_be_bytes().repeat(DEPTH_BYTES / 2)
}

fn bgra_frame(grey: u8) -> Vec<u8> {
    vec![grey; 4 * 16 * 9]
}

fn recording() -> Vec<u8> {
    let tracks = [
        track(1, "COLOR", b"BGRA", (16, 9)),
        track(2, "DEPTH", b"b16g", (320, 288)),
        track(3, "IR", b"b16g", (320, 288)),
    ];
    let tags = [
        tag("K4A_DEPTH_DELAY_NS", "0"),
        tag("K4A_START_OFFSET_NS", "5000000"),
    ];
    let clusters = [
        vec![
            block(1, 0, &bgra_frame(10)),
            block(2, 1, &depth_frame(1000)),
            block(3, 1, &depth_frame(7)),
            block(2, 34, &depth_frame(1001)),
            block(1, 35, &bgra_frame(11)),
        ],
        vec![block(2, 0, &depth_frame(1002))],
    ];
    file_of(&tracks, &tags, &clusters)
}

fn open_bytes(bytes: &[u8]) -> (tempfile::TempDir, Result<K4aReader, FormatError>) {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = dir.path().join("a.mkv");
    fs::write(&path, bytes).expect("written");
    let reader = K4aReader::open(&path);
    (dir, reader)
}

fn refusal(bytes: &[u8]) -> String {
    open_bytes(bytes)
        .1
        .expect_err("must be refused")
        .to_string()
}

fn all(source: &mut dyn RgbdSource) -> Vec<RgbdFrame> {
    std::iter::from_fn(|| source.next_frame().expect("reads")).collect()
}

/// Frames and errors until the end.
fn drain(source: &mut dyn RgbdSource) -> (usize, usize) {
    let mut counts = (0, 0);
    loop {
        match source.next_frame() {
            Ok(None) => return counts,
            Ok(Some(_)) => counts.0 += 1,
            Err(_) => counts.1 += 1,
        }
        assert!(counts.0 + counts.1 < 10_000, "no end");
    }
}

#[test]
fn frames_pair_and_rewind() {
    let (_dir, reader) = open_bytes(&recording());
    let mut reader = reader.expect("opens");
    assert_eq!(reader.untaken(), ["IR: infrared is not used"]);
    let lenses = reader.lenses();
    assert_eq!(lenses.depth.distortion.tangential, [0.001, 0.002]);
    let k = reader.calibration().depth;
    assert_eq!((k.width, k.fx, k.cx, k.cy), (320, 250.88, 159.5, 165.5));
    let frames = all(&mut reader);
    let summary: Vec<_> = frames
        .iter()
        .map(|f| {
            (
                f.time_ns,
                f.depth.at(9, 9),
                f.color.as_ref().map(|c| c.at(3, 3)[0]),
            )
        })
        .collect();
    let expected = [
        (6_000_000, 1000, Some(10)),
        (39_000_000, 1001, Some(11)),
        (1_005_000_000, 1002, None),
    ];
    assert_eq!(summary, expected);
    reader.rewind().expect("rewinds");
    assert_eq!(all(&mut reader), frames);
}

#[test]
fn groups_and_unknown_sizes_are_read() {
    let depth = block(2, 5, &depth_frame(900));
    let payload = &depth[9..];
    let group = element(0xa0, &element(0xa1, payload));
    let tracks = [track(2, "DEPTH", b"b16g", (320, 288))];
    let mut bytes = file_of(&tracks, &[], &[vec![group]]);
    for id in [&[0x18, 0x53, 0x80, 0x67][..], &[0x1f, 0x43, 0xb6, 0x75]] {
        let at = bytes.windows(4).position(|w| w == id).expect("an element");
        bytes[at + 4..at + 12].copy_from_slice(&[1, 255, 255, 255, 255, 255, 255, 255]);
    }
    let (_dir, reader) = open_bytes(&bytes);
    let frames = all(&mut reader.expect("opens"));
    assert_eq!((frames.len(), frames[0].depth.at(0, 0)), (1, 900));
}

#[test]
fn other_files_are_refused_by_name() {
    assert!(refusal(b"no matroska").contains("`EBML`"));
    let film = [track(1, "", b"H264", (320, 288))];
    let cluster = vec![vec![block(1, 0, &[1])]];
    let e = refusal(&file_of(&film, &[], &cluster));
    assert!(
        e.contains("`tracks`") && e.contains("not a recording of an Azure Kinect"),
        "{e}"
    );
    let off = [track(1, "COLOR", b"MJPG", (1280, 720))];
    assert!(refusal(&file_of(&off, &[], &cluster)).contains("depth switched off"));
    let odd = [track(2, "DEPTH", b"b16g", (640, 480))];
    assert!(refusal(&file_of(&odd, &[], &cluster)).contains("640×480 is no mode"));
    let coded = [track(2, "DEPTH", b"FFV1", (320, 288))];
    assert!(refusal(&file_of(&coded, &[], &cluster)).contains("codec FFV1"));
    let depth = [track(2, "DEPTH", b"b16g", (320, 288))];
    assert!(refusal(&file_of(&depth, &[], &[])).contains("no frame"));
    let tags = [tag("K4A_START_OFFSET_NS", "soon")];
    assert!(refusal(&file_of(&depth, &tags, &cluster)).contains("K4A_START_OFFSET_NS"));
    let nameless = file_of(&depth, &[tag("K4A_CALIBRATION_FILE", "b.json")], &cluster);
    assert!(refusal(&nameless).contains("without the device's calibration"));
    let colored = [depth[0].clone(), track(1, "COLOR", b"H264", (1280, 720))];
    let (_dir, reader) = open_bytes(&file_of(&colored, &[], &cluster));
    let reader = reader.expect("opens");
    assert_eq!(reader.untaken(), ["COLOR: codec H264 is not decoded"]);
}

#[test]
fn a_camera_file_stands_in_for_a_missing_calibration() {
    let tracks = [track(2, "DEPTH", b"b16g", (320, 288))];
    let blocks = vec![block(2, 0, &depth_frame(5))];
    let nameless = file_of(&tracks, &[tag("K4A_CALIBRATION_FILE", "b.json")], &[blocks]);
    let (dir, reader) = open_bytes(&nameless);
    assert!(reader.is_err());
    let camera = dir.path().join("camera.json");
    let text = r#"{"width": 320, "height": 288, "fx": 250, "fy": 250, "cx": 160, "cy": 144}"#;
    fs::write(&camera, text).expect("written");
    let open = || K4aReader::open_with(&dir.path().join("a.mkv"), Some(&camera));
    assert_eq!(open().expect("opens").calibration().depth.fx, 250.0);
    fs::write(&camera, text.replace("288", "240")).expect("written");
    let e = open().expect_err("another size").to_string();
    assert!(e.contains("`DEPTH`: 320×288, but"), "{e}");
}

#[test]
fn reading_continues_after_damage() {
    let mut bytes = recording();
    let second = bytes
        .windows(4)
        .rposition(|w| w == [0x1f, 0x43, 0xb6, 0x75])
        .expect("a cluster");
    // The header of a block in the first cluster.
    let damaged = second - 2 * (4 * 16 * 9) - DEPTH_BYTES - 26;
    bytes[damaged..damaged + 600].fill(0);
    let (_dir, reader) = open_bytes(&bytes);
    let mut reader = reader.expect("opens");
    let (frames, errors) = drain(&mut reader);
    assert!(
        (2..=3).contains(&frames) && errors >= 1,
        "{frames} frames, {errors} errors"
    );
    // A recording that was cut off: whole frames, one error, the end.
    let whole = recording();
    let (_dir, reader) = open_bytes(&whole[..whole.len() - 1000]);
    assert_eq!(drain(&mut reader.expect("opens")), (2, 1));
    // A frame of another size.
    let tracks = [track(2, "DEPTH", b"b16g", (320, 288))];
    let blocks = vec![block(2, 0, &[0; 8]), block(2, 33, &depth_frame(5))];
    let (_dir, reader) = open_bytes(&file_of(&tracks, &[], &[blocks]));
    let mut reader = reader.expect("opens");
    let e = reader.next_frame().expect_err("short").to_string();
    assert!(
        e.contains("`DEPTH, frame 0`") && e.contains("expected 184320"),
        "{e}"
    );
    assert_eq!(drain(&mut reader), (1, 0));
}

/// Focal lengths and principal points of the recording, pixels.
const DEPTH_K: [f64; 4] = [
    504.607_635_498,
    504.732_513_428,
    332.781_066_895,
    348.829_711_914,
];
const COLOR_K: [f64; 4] = [
    611.795_349_121,
    611.926_975_25,
    639.304_344_177,
    365.852_901_459,
];
/// Point (0.3, −0.2, 1.5) of the depth camera in the colour camera, metres.
const COLOR_POINT: [f64; 3] = [0.267_007_78, -0.072_562_63, 1.515_701_94];

/// Values of the device's formula, worked out in Python from the attached file.
#[test]
fn a_recording_of_a_device_reads() {
    let Some(path) = crate::shared_data("rgbd/k4a_recording/recording.mkv") else {
        return;
    };
    let mut reader = crate::recording::open_as_recorded(&path).expect("opens");
    let lenses = reader.lenses();
    let k = lenses.depth.intrinsics;
    let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
    assert_eq!((k.width, k.height), (640, 576));
    assert!(near(k.fx, DEPTH_K[0]) && near(k.fy, DEPTH_K[1]), "{k:?}");
    assert!(near(k.cx, DEPTH_K[2]) && near(k.cy, DEPTH_K[3]), "{k:?}");
    let k = lenses.color.expect("colour").intrinsics;
    assert_eq!((k.width, k.height), (1280, 720));
    assert!(near(k.fx, COLOR_K[0]) && near(k.fy, COLOR_K[1]), "{k:?}");
    assert!(near(k.cx, COLOR_K[2]) && near(k.cy, COLOR_K[3]), "{k:?}");
    assert!(near(
        lenses.depth.distortion.tangential[1],
        -7.210_415_787_994_862e-5
    ));
    assert!(near(
        lenses.depth.distortion.radial[3],
        0.889_679_074_287_414_6
    ));
    let p = lenses.color_from_depth.point(&Point3::new(0.3, -0.2, 1.5));
    let expected = Point3::from(COLOR_POINT);
    assert!((p - expected).norm() < 1e-6, "{p}");
    let frame = reader.next_frame().expect("reads").expect("a frame");
    // FFmpeg's pixels (gray16be, yuvj422p to RGB).
    assert_eq!(frame.time_ns, 463_945_000 + 336_277_000);
    let bytes: Vec<u8> = frame
        .depth
        .data()
        .iter()
        .flat_map(|d| d.to_le_bytes())
        .collect();
    let mut crc = flate2::Crc::new();
    crc.update(&bytes);
    assert_eq!((crc.sum(), frame.depth.at(320, 288)), (1_717_812_445, 1939));
    let color = frame.color.expect("colour");
    let mean = |c: usize| {
        color
            .data()
            .iter()
            .skip(c)
            .step_by(3)
            .map(|v| f64::from(*v))
            .sum::<f64>()
            / 921_600.0
    };
    for (c, expected) in [134.006, 133.422, 128.091].into_iter().enumerate() {
        assert!((mean(c) - expected).abs() < 1.0, "{c}: {}", mean(c));
    }
    for (c, expected) in [118u8, 102, 101].into_iter().enumerate() {
        assert!(
            color.at(640, 360)[c].abs_diff(expected) <= 4,
            "{:?}",
            color.at(640, 360)
        );
    }
    assert!(reader.next_frame().expect("ends").is_none());
}

/// Reads a file to its end, whatever it holds.
fn read_all(path: &Path) {
    if let Ok(mut reader) = K4aReader::open(path) {
        drain(&mut reader);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(damage_cases()))]
    #[test]
    fn damaged_files_never_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut bytes = structure();
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let dir = tempfile::tempdir().expect("temporary folder");
        let path = dir.path().join("a.mkv");
        fs::write(&path, &bytes).expect("written");
        read_all(&path);
    }
}

/// A device's recording with damage in its structure: headers, calibration, and the starts of blocks.
#[test]
fn a_damaged_recording_of_a_device_never_panics() {
    let Some(path) = crate::shared_data("rgbd/k4a_recording/recording.mkv") else {
        return;
    };
    let whole = fs::read(path).expect("read");
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = dir.path().join("a.mkv");
    let mut seed = 1u64;
    let mut next = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) as usize
    };
    for case in 0..damage_cases() / 10 {
        let mut bytes = whole.clone();
        for _ in 0..1 + next() % 8 {
            bytes[next() % 7000] = next() as u8;
        }
        if case % 4 == 0 {
            bytes.truncate(next() % whole.len());
        }
        fs::write(&path, &bytes).expect("written");
        read_all(&path);
    }
}

/// A recording whose frames are too short, so that most of its bytes are structure.
fn structure() -> Vec<u8> {
    let tracks = [
        track(1, "COLOR", b"YUY2", (16, 9)),
        track(2, "DEPTH", b"b16g", (320, 288)),
    ];
    let tags = [tag("K4A_DEPTH_DELAY_NS", "-10")];
    let blocks = |n: i16| (0..n).flat_map(|i| [block(1, i, &[0; 288]), block(2, i, &[0; 9])]);
    file_of(&tracks, &tags, &[blocks(3).collect(), blocks(2).collect()])
}

/// Damaged files a run; thousands with `TRYON_DAMAGE_CASES`.
fn damage_cases() -> u32 {
    let stated = std::env::var("TRYON_DAMAGE_CASES").ok();
    stated.and_then(|n| n.parse().ok()).unwrap_or(300)
}
