//! Messages of the wire: every request, bus frames, garment frames, bodies.

use super::{Target, le, text};
use crate::bundle::Bundle;
use crate::execute::Scratch;
use bytes::Bytes;
use std::path::Path;
use tryon::geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use tryon_proto::Message;
use tryon_proto::convert::frame::{Exposure, exposure_from_wire, exposure_to_wire};
use tryon_proto::convert::garment::GarmentReader;
use tryon_proto::convert::{body, request};
use tryon_proto::v1;

/// Requests, with the checks that their services make.
pub(super) const REQUESTS: Target = Target::new(
    "requests",
    "every request of tryon.v1, proto/src/convert/request.rs",
    run_request,
    request_seeds,
)
.words("tshirt front store M ../ \u{1f600} mesh_obj")
// The bar of docs/attack.md: 1 MiB for a request of 10 KiB.
.allow(512 << 10, 50);

/// Frames on the bus.
pub(super) const FRAME: Target = Target::new(
    "frame",
    "proto/src/convert/frame.rs",
    |b, _| {
        let message = v1::RgbdFrame::decode(b.first()).map_err(text)?;
        let exposure = exposure_from_wire(&message).map_err(text)?;
        Ok(exposure.rgbd.depth.data().len())
    },
    || vec![Bundle::of("frame.pb", frame().encode_to_vec())],
)
.words("TDZ1")
// Pixels are a size that the calibration states and zstd reaches; JPEG's tables.
.allow(1 << 20, 60_000);

/// Garment frames, several of one stream.
pub(super) const GARMENTS: Target = Target::new(
    "garments",
    "proto/src/convert/garment.rs",
    |b, _| {
        let mut reader = GarmentReader::default();
        let mut vertices = 0;
        for m in &b.0 {
            let frame = v1::GarmentFrame::decode(&m.bytes[..]).map_err(text)?;
            let placed = reader.read(&frame).map_err(text)?;
            vertices += placed.iter().map(|(_, p)| p.len()).sum::<usize>();
        }
        Ok(vertices)
    },
    garment_seeds,
)
.allow(16 << 20, 60_000);

/// Bodies: a template, then pose and shape of it.
pub(super) const BODY: Target = Target::new(
    "body",
    "proto/src/convert/body.rs",
    |b, _| {
        let wire = v1::BodyTemplate::decode(b.get("template.pb")).map_err(text)?;
        let template = body::template_from_wire(&wire).map_err(text)?;
        let pose = v1::BodyPose::decode(b.get("pose.pb")).map_err(text)?;
        body::pose_from_wire(&pose, template.skeleton().dofs()).map_err(text)?;
        let shape = v1::BodyShape::decode(b.get("shape.pb")).map_err(text)?;
        let known = v1::KnownBody {
            subject: 1,
            shape: Some(shape.clone()),
            template_name: template.name().into(),
            residual_mm: 2.0,
        };
        let shape = body::shape_from_wire(&shape, &template).map_err(text)?;
        // A shape of that template may still be no body.
        let _ = body::known_body_from_wire(&known, &template, "open_session_request");
        Ok(template.personalise(&shape).vertices.len())
    },
    body_seeds,
)
.words("pelvis left_hip");

macro_rules! requests {
    ($($name:ident),* $(,)?) => {
        /// Request messages that [`REQUESTS`] decodes.
        #[cfg(test)]
        const NAMES: &[&str] = &[$(stringify!($name)),*];

        fn decode_other(name: &str, bytes: &[u8]) -> Result<usize, String> {
            match name {
                $(stringify!($name) => v1::$name::decode(bytes).map(|m| m.encoded_len()).map_err(text),)*
                _ => Err("no such request".into()),
            }
        }
    };
}

requests!(
    ListCamerasRequest,
    GetCalibrationRequest,
    StartCameraRequest,
    StopCameraRequest,
    StartRecordingRequest,
    StopRecordingRequest,
    OpenSessionRequest,
    CloseSessionRequest,
    ResetSessionRequest,
    GetBodyTemplateRequest,
    StreamBodyStatesRequest,
    ListGarmentsRequest,
    DressRequest,
    UndressRequest,
    StreamGarmentsRequest,
    StartSimulationRequest,
    FollowSimulationRequest,
    CancelSimulationRequest,
    HoldConsentRequest,
    PublishFramesRequest,
    WithdrawConsentRequest,
    AcknowledgeFramesRequest,
    OfferPhotoRequest,
    RedeemCodeRequest,
    OpenTryOnRequest,
    CloseTryOnRequest,
    ChooseGarmentsRequest,
    ShowFitRequest,
    ListGarmentChoicesRequest,
    StreamFramesRequest,
    TakeSnapshotRequest,
    TakeFinePictureRequest,
);

fn run_request(b: &Bundle, _: &Scratch) -> Result<usize, String> {
    let Some(member) = b.0.first() else {
        return Err("no request".into());
    };
    let (name, bytes) = (member.name.trim_end_matches(".pb"), &member.bytes[..]);
    match name {
        "OpenTryOnRequest" => {
            let r = v1::OpenTryOnRequest::decode(bytes).map_err(text)?;
            request::session_id("open_try_on_request.try_on_id", &r.try_on_id).map_err(text)?;
            request::camera_key("open_try_on_request", &r.store, &r.camera).map_err(text)?;
            let chosen = request::choices("open_try_on_request", &r.garments);
            chosen.map(|c| c.len()).map_err(text)
        }
        "HoldConsentRequest" => {
            let r = v1::HoldConsentRequest::decode(bytes).map_err(text)?;
            request::session_id("hold_consent_request.try_on_id", &r.try_on_id).map_err(text)?;
            Ok(r.encoded_len())
        }
        "OpenSessionRequest" => {
            let r = v1::OpenSessionRequest::decode(bytes).map_err(text)?;
            request::session_id("open_session_request.session_id", &r.session_id).map_err(text)?;
            let key = request::camera_key("open_session_request", &r.store, &r.camera);
            key.map(|k| k.rgbd().len()).map_err(text)
        }
        "DressRequest" => {
            let r = v1::DressRequest::decode(bytes).map_err(text)?;
            request::session_id("dress_request.session_id", &r.session_id).map_err(text)?;
            let chosen = request::choices("dress_request", &r.garments);
            chosen.map(|c| c.len()).map_err(text)
        }
        "ChooseGarmentsRequest" => {
            let r = v1::ChooseGarmentsRequest::decode(bytes).map_err(text)?;
            let chosen = request::choices("choose_garments_request", &r.garments);
            chosen.map(|c| c.len()).map_err(text)
        }
        "StreamFramesRequest" => {
            let r = v1::StreamFramesRequest::decode(bytes).map_err(text)?;
            let format = request::picture_format(&r).map_err(text)?;
            Ok(format.size.map_or(0, |(w, _)| w as usize))
        }
        "StartSimulationRequest" => {
            let r = v1::StartSimulationRequest::decode(bytes).map_err(text)?;
            let Some(v1::start_simulation_request::Start::SceneJson(scene)) = r.start else {
                return Ok(0);
            };
            let at = Path::new("scene_json");
            let scene = tryon::cloth::scene::parse(&scene, at, None).map_err(text)?;
            Ok(scene.faces.len())
        }
        other => decode_other(other, bytes),
    }
}

fn request_seeds() -> Vec<Bundle> {
    let shirt = v1::GarmentChoice {
        garment: "tshirt".into(),
        size: "M".into(),
        color_rgb: Some(0x33_66_99),
        print: None,
    };
    let open = v1::OpenTryOnRequest {
        try_on_id: "abc-1".into(),
        store: "store".into(),
        camera: "front".into(),
        garments: vec![shirt.clone()],
        consent: Some(v1::Consent { given: true }),
    };
    let session = v1::OpenSessionRequest {
        session_id: "abc-1".into(),
        store: "store".into(),
        camera: "front".into(),
        ..Default::default()
    };
    let dress = v1::DressRequest {
        session_id: "abc-1".into(),
        garments: vec![shirt.clone(), shirt.clone()],
        known_sizes: Some(v1::KnownSizes {
            subject: 1,
            sizes: vec!["M".into(), String::new()],
        }),
    };
    let choose = v1::ChooseGarmentsRequest {
        try_on_id: "abc-1".into(),
        garments: vec![shirt],
    };
    let stream = v1::StreamFramesRequest {
        try_on_id: "abc-1".into(),
        width: 640,
        height: 480,
        quality: 80,
        max_rate: 15.0,
        ..Default::default()
    };
    let simulate = v1::StartSimulationRequest {
        start: Some(v1::start_simulation_request::Start::SceneJson(
            super::garments::scene_json(),
        )),
        ..Default::default()
    };
    let hold = v1::HoldConsentRequest {
        store: "store".into(),
        camera: "front".into(),
        try_on_id: "abc-1".into(),
        seconds: 1.5,
    };
    let record = v1::StartRecordingRequest {
        camera: "front".into(),
        consent: true,
    };
    vec![
        Bundle::of("OpenTryOnRequest.pb", open.encode_to_vec()),
        Bundle::of("HoldConsentRequest.pb", hold.encode_to_vec()),
        Bundle::of("OpenSessionRequest.pb", session.encode_to_vec()),
        Bundle::of("DressRequest.pb", dress.encode_to_vec()),
        Bundle::of("ChooseGarmentsRequest.pb", choose.encode_to_vec()),
        Bundle::of("StreamFramesRequest.pb", stream.encode_to_vec()),
        Bundle::of("StartSimulationRequest.pb", simulate.encode_to_vec()),
        Bundle::of("StartRecordingRequest.pb", record.encode_to_vec()),
    ]
}

/// A frame of 16 × 12 pixels with colour.
fn frame() -> v1::RgbdFrame {
    let depth = (0..16 * 12).map(|i| 1000 + i % 37).collect();
    let exposure = Exposure {
        id: v1::FrameId {
            epoch: 7,
            sequence: 3,
            capture_time_ns: 5,
            received_unix_ns: 9,
            trace: 11,
        },
        calibration: Calibration::registered(Intrinsics::KINECT_V1.resized(16, 12)).into(),
        rgbd: RgbdFrame {
            sequence: 3,
            time_ns: 5,
            depth: DepthImage::new(16, 12, depth).unwrap_or(DepthImage::empty(16, 12)),
            color: Some(ColorImage::filled(16, 12, [10, 200, 90])),
        },
        stages: vec![],
    };
    exposure_to_wire(&exposure).unwrap_or_default()
}

fn f32s(values: &[f32]) -> Bytes {
    le(values, f32::to_le_bytes).into()
}

fn f64s(values: &[f64]) -> Bytes {
    le(values, f64::to_le_bytes).into()
}

fn u32s(values: &[u32]) -> Bytes {
    le(values, u32::to_le_bytes).into()
}

/// A keyframe of a flag of four vertices, and two frames coded against it.
fn garment_seeds() -> Vec<Bundle> {
    let topology = v1::GarmentTopology {
        garment: "flag".into(),
        size: "M".into(),
        vertex_count: 4,
        face_count: 2,
        faces: u32s(&[0, 1, 2, 3, 4, 5]),
        uvs: f32s(&[0.0; 12]),
        look: Some(v1::GarmentLook::default()),
        drawn_count: 6,
        drawn: u32s(&[0, 1, 2, 1, 3, 2]),
        texture: Some(v1::GarmentTexture {
            image: super::images::tiny_png().into(),
            metres_per_pixel: 0.01,
        }),
        trims: vec![],
    };
    let mut coder = tryon::formats::PositionCoder::new(4, &[[0, 1, 2], [1, 3, 2]]);
    let mut bundle = Bundle::default();
    for i in 0..3 {
        let p = tryon::geometry::math::P3::new(0.1 * i as f32, 1.0, 2.0);
        let frame = v1::GarmentFrame {
            outfit_revision: 1,
            garments: vec![v1::GarmentMesh {
                topology: (i == 0).then(|| topology.clone()),
                positions: coder.encode(&[p; 4]).unwrap_or_default().into(),
            }],
            ..Default::default()
        };
        bundle = bundle.and(&format!("{i}.pb"), frame.encode_to_vec());
    }
    vec![bundle]
}

/// A body of four vertices and three joints.
fn body_seeds() -> Vec<Bundle> {
    let zero = v1::Vector3::default();
    let up = v1::Vector3 {
        y: 1.0,
        ..Default::default()
    };
    let joint = |name: &str, parent, kind: v1::JointKind, angles: usize| v1::Joint {
        name: name.into(),
        parent,
        rest: Some(up),
        kind: kind as i32,
        axis: Some(up),
        limits: [-1.0, 1.0].repeat(angles),
    };
    let template = v1::BodyTemplate {
        name: "tiny".into(),
        vertex_count: 4,
        face_count: 4,
        vertices: f32s(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]),
        faces: u32s(&[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]),
        joints: vec![
            joint("pelvis", None, v1::JointKind::Ball, 3),
            joint("left_hip", Some(0), v1::JointKind::Hinge, 1),
            joint("left_knee", Some(1), v1::JointKind::Fixed, 0),
        ],
        skin_joints: [0, 1, 2, 0].repeat(4).into(),
        skin_weights: f32s(&[0.5, 0.3, 0.2, 0.0].repeat(4)),
        shape_directions: vec![v1::ShapeDirection {
            name: "tall".into(),
            vertices: f32s(&[0.01; 12]),
            joints: f64s(&[0.01; 9]),
        }],
    };
    let pose = v1::BodyPose {
        camera_from_body: Some(v1::RigidTransform {
            translation: Some(zero),
            rotation: Some(v1::Quaternion {
                w: 1.0,
                ..Default::default()
            }),
        }),
        angles: f64s(&[0.1; 4]),
    };
    let shape = v1::BodyShape {
        coefficients: f64s(&[0.5]),
        bone_scales: f64s(&[1.0, 1.1, 0.9]),
        displacements: [1, 0].repeat(4).into(),
        displacement_unit: 1e-4,
    };
    let bundle = Bundle::of("template.pb", template.encode_to_vec());
    let bundle = bundle.and("pose.pb", pose.encode_to_vec());
    vec![bundle.and("shape.pb", shape.encode_to_vec())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_request_of_the_contracts_has_a_decoder_here() {
        let set = prost_types::FileDescriptorSet::decode(tryon_proto::DESCRIPTOR).expect("a set");
        let messages = set.file.iter().filter(|f| f.package() == "tryon.v1");
        let missing: Vec<&str> = messages
            .flat_map(|f| &f.message_type)
            .map(|m| m.name())
            .filter(|n| n.ends_with("Request") && !NAMES.contains(n))
            .collect();
        assert!(missing.is_empty(), "{missing:?}");
    }
}
