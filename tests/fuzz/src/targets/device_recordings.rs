//! Recordings of one maker each: Azure Kinect's Matroska files, Record3D's archives, and NumPy's arrays.

use super::recordings::frames;
use super::{Target, packed};
use crate::bundle::Bundle;
use crate::pack;

/// Bytes of a depth image of the smallest mode, 320 × 288.
const DEPTH_BYTES: usize = 2 * 320 * 288;
/// Parts of a packed Matroska file: header and tracks, the attached calibration, and a cluster up to its depth image.
const PARTS: [&str; 3] = ["0.head.bin", "1.calibration.json", "2.cluster.bin"];

/// Azure Kinect: structure and calibration before one depth image that no mutation wastes itself on, or a raw file.
pub(super) const KINECT: Target = Target {
    longest: 256 << 10,
    ..Target::new(
        "k4a",
        "src/formats/k4a_file",
        |b, scratch| {
            let file = packed(b, "a.mkv", || Ok(matroska(b)))?;
            frames(&scratch.file("a.mkv", &file)?)
        },
        || {
            let parts = kinect_parts();
            let whole = matroska(&parts);
            vec![parts, Bundle::of("a.mkv", whole)]
        },
    )
    .words("CalibrationInformation Cameras Intrinsics ModelParameters Rt Rotation MetricRadius SensorWidth DEPTH b16g")
    .allow(4 << 20, 60_000)
};

/// Record3D: entries packed anew, or a raw file.
pub(super) const RECORD3D: Target = Target::new(
    "r3d",
    "src/formats/r3d_file",
    |b, scratch| {
        let file = packed(b, "a.r3d", || pack::zip(&b.0))?;
        frames(&scratch.file("a.r3d", &file)?)
    },
    || {
        let file = include_bytes!("../../../../src/formats/r3d_file/tiny.r3d");
        let entries = pack::unpack_zip(file).unwrap_or_default();
        vec![Bundle::of("a.r3d", *file), entries]
    },
)
.words("w h dw dh fps K frameTimestamps perFrameIntrinsicCoeffs poses bvx2 bvxn bvx- bvx$")
.allow(4 << 20, 60_000);

/// Arrays of depth and `K`: entries packed anew, or a raw file.
pub(super) const ARRAYS: Target = Target::new(
    "npz-recording",
    "src/formats/npz_recording",
    |b, scratch| {
        let file = packed(b, "a.npz", || pack::zip(&b.0))?;
        frames(&scratch.file("a.npz", &file)?)
    },
    || {
        let files = [
            &include_bytes!("../../../../src/formats/npz_recording/tiny.npz")[..],
            include_bytes!("../../../../src/formats/npz_recording/tiny_stored.npz"),
        ];
        let raw = files.map(|file| Bundle::of("a.npz", file));
        let entries = files.map(|file| pack::unpack_zip(file).unwrap_or_default());
        raw.into_iter().chain(entries).collect()
    },
)
.words("descr fortran_order shape False True <u2 <f4 <f8 |u1 >u2 depth K rgb color")
.allow(4 << 20, 60_000);

/// Matroska file of [`PARTS`]; the attachment has the right length.
fn matroska(parts: &Bundle) -> Vec<u8> {
    let [head, calibration, cluster] = PARTS.map(|name| parts.get(name));
    let attached = [
        element(0x466e, b"calibration.json"),
        element(0x465c, calibration),
    ];
    let attachments = element(0x1941_a469, &element(0x61a7, &attached.concat()));
    let depth = 1234u16.to_be_bytes().repeat(DEPTH_BYTES / 2);
    [head, &attachments, cluster, &depth].concat()
}

/// Element of EBML, with a size of eight bytes.
fn element(id: u32, payload: &[u8]) -> Vec<u8> {
    [element_head(id, payload.len() as u64), payload.to_vec()].concat()
}

fn element_head(id: u32, size: u64) -> Vec<u8> {
    let bytes = id.to_be_bytes();
    let id = bytes.iter().copied().skip_while(|b| *b == 0);
    id.chain((size | 1 << 56).to_be_bytes()).collect()
}

fn unsigned(id: u32, value: u64) -> Vec<u8> {
    element(id, &value.to_be_bytes())
}

fn track(number: u64, name: &str, code: &[u8; 4], (width, height): (u64, u64)) -> Vec<u8> {
    let bitmap = [&[0; 16][..], code, &[0; 20]].concat();
    let size = [unsigned(0xb0, width), unsigned(0xba, height)].concat();
    let parts = [
        unsigned(0xd7, number),
        element(0x536e, name.as_bytes()),
        element(0x86, b"V_MS/VFW/FOURCC"),
        element(0x63a2, &bitmap),
        unsigned(0x23_e383, 33_333_333),
        element(0xe0, &size),
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

/// Parts of a recording of one frame: 320 × 288 depth with 4 × 3 colour.
fn kinect_parts() -> Bundle {
    const UNKNOWN: u64 = (1 << 56) - 1;
    let tracks = [
        track(1, "COLOR", b"BGRA", (4, 3)),
        track(2, "DEPTH", b"b16g", (320, 288)),
    ];
    let tags = [
        tag("K4A_DEPTH_DELAY_NS", "0"),
        tag("K4A_START_OFFSET_NS", "5000000"),
    ];
    let head = [
        element(0x1a45_dfa3, &element(0x4282, b"matroska")),
        element_head(0x1853_8067, UNKNOWN),
        element(0x1549_a966, &unsigned(0x2a_d7b1, 1_000_000)),
        element(0x1654_ae6b, &tracks.concat()),
        element(0x1254_c367, &tags.concat()),
    ];
    let cluster = [
        element_head(0x1f43_b675, UNKNOWN),
        unsigned(0xe7, 1000),
        element(0xa3, &[&[0x81, 0, 0, 0x80][..], &[90; 48]].concat()),
        element_head(0xa3, 4 + DEPTH_BYTES as u64),
        vec![0x82, 0, 1, 0x80],
    ];
    let camera = |location: &str, height: f64, translation: f64| {
        let model = "CALIBRATION_LensDistortionModelBrownConrady";
        let p = [
            0.5, 0.5, 0.49, 0.49, 0.1, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.002, 0.001,
        ];
        serde_json::json!({
            "Intrinsics": {"ModelParameters": p, "ModelType": model},
            "Location": location, "MetricRadius": 1.74,
            "Rt": {"Rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "Translation": [translation, 0, 0]},
            "SensorHeight": height, "SensorWidth": 1024,
        })
    };
    let cameras = [
        camera("CALIBRATION_CameraLocationD0", 1024.0, 0.0),
        camera("CALIBRATION_CameraLocationPV0", 768.0, -0.032),
    ];
    let file = serde_json::json!({"CalibrationInformation": {"Cameras": cameras}});
    Bundle::of(PARTS[0], head.concat())
        .and(PARTS[1], file.to_string())
        .and(PARTS[2], cluster.concat())
}
