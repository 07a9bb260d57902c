//! Foxglove messages of a recording, field for field, and their descriptors.
//!
//! Field numbers as in the foxglove protobuf schemas; Foxglove and rerun read them by these names.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, Timestamp,
};

/// Nanoseconds since the epoch as a protobuf timestamp.
pub(super) fn timestamp(time_ns: u64) -> Option<Timestamp> {
    const SECOND: u64 = 1_000_000_000;
    Some(Timestamp {
        seconds: (time_ns / SECOND) as i64,
        nanos: (time_ns % SECOND) as i32,
    })
}

/// Nanoseconds since the epoch of a protobuf timestamp; `None` where it is zero or no time.
pub(super) fn nanoseconds(time: &Timestamp) -> Option<u64> {
    const SECOND: u64 = 1_000_000_000;
    let seconds = u64::try_from(time.seconds).ok()?.checked_mul(SECOND)?;
    let time = seconds.checked_add(u64::try_from(time.nanos).ok()?)?;
    (time != 0).then_some(time)
}

/// `foxglove.CameraCalibration`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct CameraCalibration {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(fixed32, tag = "2")]
    pub(super) width: u32,
    #[prost(fixed32, tag = "3")]
    pub(super) height: u32,
    #[prost(string, tag = "4")]
    pub(super) distortion_model: String,
    #[prost(double, repeated, tag = "5")]
    pub(super) d: Vec<f64>,
    #[prost(double, repeated, tag = "6")]
    pub(super) k: Vec<f64>,
    #[prost(double, repeated, tag = "7")]
    pub(super) r: Vec<f64>,
    #[prost(double, repeated, tag = "8")]
    pub(super) p: Vec<f64>,
    #[prost(string, tag = "9")]
    pub(super) frame_id: String,
}

/// `foxglove.RawImage`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct RawImage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(fixed32, tag = "2")]
    pub(super) width: u32,
    #[prost(fixed32, tag = "3")]
    pub(super) height: u32,
    #[prost(string, tag = "4")]
    pub(super) encoding: String,
    #[prost(fixed32, tag = "5")]
    pub(super) step: u32,
    #[prost(bytes = "vec", tag = "6")]
    pub(super) data: Vec<u8>,
    #[prost(string, tag = "7")]
    pub(super) frame_id: String,
}

/// `foxglove.CompressedImage`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct CompressedImage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(bytes = "vec", tag = "2")]
    pub(super) data: Vec<u8>,
    #[prost(string, tag = "3")]
    pub(super) format: String,
    #[prost(string, tag = "4")]
    pub(super) frame_id: String,
}

/// `foxglove.Vector3`.
#[derive(Clone, Copy, PartialEq, Message)]
pub(super) struct Vector3 {
    #[prost(double, tag = "1")]
    pub(super) x: f64,
    #[prost(double, tag = "2")]
    pub(super) y: f64,
    #[prost(double, tag = "3")]
    pub(super) z: f64,
}

/// `foxglove.Quaternion`.
#[derive(Clone, Copy, PartialEq, Message)]
pub(super) struct Quaternion {
    #[prost(double, tag = "1")]
    pub(super) x: f64,
    #[prost(double, tag = "2")]
    pub(super) y: f64,
    #[prost(double, tag = "3")]
    pub(super) z: f64,
    #[prost(double, tag = "4")]
    pub(super) w: f64,
}

/// `foxglove.FrameTransform`: pose of the child in the parent.
#[derive(Clone, PartialEq, Message)]
pub(super) struct FrameTransform {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    pub(super) parent_frame_id: String,
    #[prost(string, tag = "3")]
    pub(super) child_frame_id: String,
    #[prost(message, optional, tag = "4")]
    pub(super) translation: Option<Vector3>,
    #[prost(message, optional, tag = "5")]
    pub(super) rotation: Option<Quaternion>,
}

/// `foxglove.FrameTransforms`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct FrameTransforms {
    #[prost(message, repeated, tag = "1")]
    pub(super) transforms: Vec<FrameTransform>,
}

/// Name, number and type of a field; a type that starts with a dot names a message.
type Field = (&'static str, i32, &'static str);

const CALIBRATION: &[Field] = &[
    ("timestamp", 1, ".google.protobuf.Timestamp"),
    ("frame_id", 9, "string"),
    ("width", 2, "fixed32"),
    ("height", 3, "fixed32"),
    ("distortion_model", 4, "string"),
    ("D", 5, "doubles"),
    ("K", 6, "doubles"),
    ("R", 7, "doubles"),
    ("P", 8, "doubles"),
];
const RAW_IMAGE: &[Field] = &[
    ("timestamp", 1, ".google.protobuf.Timestamp"),
    ("frame_id", 7, "string"),
    ("width", 2, "fixed32"),
    ("height", 3, "fixed32"),
    ("encoding", 4, "string"),
    ("step", 5, "fixed32"),
    ("data", 6, "bytes"),
];
const COMPRESSED_IMAGE: &[Field] = &[
    ("timestamp", 1, ".google.protobuf.Timestamp"),
    ("frame_id", 4, "string"),
    ("data", 2, "bytes"),
    ("format", 3, "string"),
];
const VECTOR3: &[Field] = &[("x", 1, "double"), ("y", 2, "double"), ("z", 3, "double")];
const QUATERNION: &[Field] = &[
    ("x", 1, "double"),
    ("y", 2, "double"),
    ("z", 3, "double"),
    ("w", 4, "double"),
];
const FRAME_TRANSFORM: &[Field] = &[
    ("timestamp", 1, ".google.protobuf.Timestamp"),
    ("parent_frame_id", 2, "string"),
    ("child_frame_id", 3, "string"),
    ("translation", 4, ".foxglove.Vector3"),
    ("rotation", 5, ".foxglove.Quaternion"),
];
const TIMESTAMP: &[Field] = &[("seconds", 1, "int64"), ("nanos", 2, "int32")];

/// Descriptor of a file with one message.
fn file(
    name: &str,
    package: &str,
    message: &str,
    fields: &[Field],
    imports: &[&str],
) -> FileDescriptorProto {
    let field = |(name, number, type_name): &Field| {
        let (kind, label) = match *type_name {
            "doubles" => (Type::Double, Label::Repeated),
            "double" => (Type::Double, Label::Optional),
            "fixed32" => (Type::Fixed32, Label::Optional),
            "string" => (Type::String, Label::Optional),
            "bytes" => (Type::Bytes, Label::Optional),
            "int64" => (Type::Int64, Label::Optional),
            "int32" => (Type::Int32, Label::Optional),
            _ => (Type::Message, Label::Optional),
        };
        FieldDescriptorProto {
            name: Some((*name).into()),
            number: Some(*number),
            label: Some(label.into()),
            r#type: Some(kind.into()),
            type_name: (kind == Type::Message).then(|| (*type_name).to_owned()),
            ..Default::default()
        }
    };
    FileDescriptorProto {
        name: Some(name.into()),
        package: Some(package.into()),
        dependency: imports.iter().map(|i| (*i).to_owned()).collect(),
        message_type: vec![DescriptorProto {
            name: Some(message.into()),
            field: fields.iter().map(field).collect(),
            ..Default::default()
        }],
        syntax: Some("proto3".into()),
        ..Default::default()
    }
}

/// Schema of a message for MCAP: a FileDescriptorSet with all its imports.
pub(super) fn schema(message: &str) -> Vec<u8> {
    const TIME: &str = "google/protobuf/timestamp.proto";
    const VECTOR: &str = "foxglove/Vector3.proto";
    const ROTATION: &str = "foxglove/Quaternion.proto";
    let mut files = vec![file(TIME, "google.protobuf", "Timestamp", TIMESTAMP, &[])];
    let (fields, imports): (&[Field], &[&str]) = match message {
        "CameraCalibration" => (CALIBRATION, &[TIME]),
        "RawImage" => (RAW_IMAGE, &[TIME]),
        "CompressedImage" => (COMPRESSED_IMAGE, &[TIME]),
        _ => {
            files.push(file(VECTOR, "foxglove", "Vector3", VECTOR3, &[]));
            files.push(file(ROTATION, "foxglove", "Quaternion", QUATERNION, &[]));
            (FRAME_TRANSFORM, &[TIME, VECTOR, ROTATION])
        }
    };
    files.push(file(
        &format!("foxglove/{message}.proto"),
        "foxglove",
        message,
        fields,
        imports,
    ));
    FileDescriptorSet { file: files }.encode_to_vec()
}

/// Encodes one of these messages.
pub(super) fn encode(message: &impl Message) -> Vec<u8> {
    message.encode_to_vec()
}

/// Messages that [`decode`] returns.
pub(super) trait FoxgloveMessage: Message + Default {}
impl<M: Message + Default> FoxgloveMessage for M {}

/// Decodes a message; `None` for invalid bytes.
pub(super) fn decode<M: FoxgloveMessage>(bytes: &[u8]) -> Option<M> {
    M::decode(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_those_of_the_schema() {
        // Hand-encoded: field 3 (fixed32) height = 2, field 4 string "16UC1", field 6 bytes.
        let m = RawImage {
            height: 2,
            encoding: "16UC1".into(),
            data: vec![7, 8],
            ..Default::default()
        };
        let want = [
            0x1d, 2, 0, 0, 0, 0x22, 5, b'1', b'6', b'U', b'C', b'1', 0x32, 2, 7, 8,
        ];
        assert_eq!(encode(&m), want);
        assert_eq!(decode::<RawImage>(&want), Some(m));
        assert_eq!(decode::<RawImage>(&[0x32, 200]), None);
    }

    #[test]
    fn descriptors_contain_their_imports() {
        for name in [
            "CameraCalibration",
            "RawImage",
            "CompressedImage",
            "FrameTransform",
        ] {
            let set = FileDescriptorSet::decode(schema(name).as_slice()).expect("decodes");
            let names: Vec<_> = set.file.iter().filter_map(|f| f.name.clone()).collect();
            let last = set.file.last().expect("files");
            assert!(last.dependency.iter().all(|d| names.contains(d)), "{name}");
            assert_eq!(last.message_type[0].name.as_deref(), Some(name));
            assert!(
                last.message_type[0]
                    .field
                    .iter()
                    .all(|f| f.r#type() != Type::Message || f.type_name.is_some())
            );
        }
    }
}
