//! Foxglove's protobuf messages of images, cameras and transforms.

use super::camera_info::CameraInfo;
use super::fault::MessageFault;
use super::image_layout::ImageLayout;
use super::image_message::ImageMessage;
use super::message_item::MessageItem;
use super::transforms::{FrameEdge, pose};
use crate::foxglove::{
    CameraCalibration, CompressedImage, FoxgloveMessage, FrameTransform, FrameTransforms, RawImage,
    decode as decode_protobuf, nanoseconds,
};

/// Schemas that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FoxgloveKind {
    /// `foxglove.RawImage`.
    RawImage,
    /// `foxglove.CompressedImage`.
    CompressedImage,
    /// `foxglove.CameraCalibration`.
    CameraCalibration,
    /// `foxglove.FrameTransform`.
    FrameTransform,
    /// `foxglove.FrameTransforms`.
    FrameTransforms,
}

impl FoxgloveKind {
    /// Schema by its name.
    pub(super) fn of(schema: &str) -> Option<Self> {
        Some(match schema.strip_prefix("foxglove.")? {
            "RawImage" => Self::RawImage,
            "CompressedImage" => Self::CompressedImage,
            "CameraCalibration" => Self::CameraCalibration,
            "FrameTransform" => Self::FrameTransform,
            "FrameTransforms" => Self::FrameTransforms,
            _ => return None,
        })
    }
    /// True for images, raw or compressed.
    pub(super) fn is_image(self) -> bool {
        matches!(self, Self::RawImage | Self::CompressedImage)
    }
}

fn message<M: FoxgloveMessage>(data: &[u8]) -> Result<M, MessageFault> {
    decode_protobuf(data).ok_or_else(|| MessageFault::new("data", "not a message of this schema"))
}

/// Decodes a message.
///
/// # Errors
/// Bytes that are no message of the schema.
pub(super) fn decode<'a>(kind: FoxgloveKind, data: &[u8]) -> Result<MessageItem<'a>, MessageFault> {
    Ok(match kind {
        FoxgloveKind::RawImage => MessageItem::Image(raw_image(message(data)?)),
        FoxgloveKind::CompressedImage => MessageItem::Image(compressed_image(message(data)?)),
        FoxgloveKind::CameraCalibration => MessageItem::Camera(camera_info(message(data)?)),
        FoxgloveKind::FrameTransform => {
            MessageItem::Transforms(vec![frame_edge(&message::<FrameTransform>(data)?)?])
        }
        FoxgloveKind::FrameTransforms => {
            let all: FrameTransforms = message(data)?;
            let edges: Result<_, _> = all.transforms.iter().map(frame_edge).collect();
            MessageItem::Transforms(edges?)
        }
    })
}

fn raw_image<'a>(m: RawImage) -> ImageMessage<'a> {
    ImageMessage {
        frame_id: m.frame_id,
        stamp_ns: m.timestamp.as_ref().and_then(nanoseconds),
        sequence: None,
        layout: ImageLayout::Raw {
            width: m.width,
            height: m.height,
            encoding: m.encoding,
            is_big_endian: false,
            step: m.step,
        },
        depth_unit: None,
        data: m.data.into(),
    }
}

fn compressed_image<'a>(m: CompressedImage) -> ImageMessage<'a> {
    ImageMessage {
        frame_id: m.frame_id,
        stamp_ns: m.timestamp.as_ref().and_then(nanoseconds),
        sequence: None,
        layout: ImageLayout::Compressed { format: m.format },
        depth_unit: None,
        data: m.data.into(),
    }
}

fn camera_info(m: CameraCalibration) -> CameraInfo {
    CameraInfo {
        frame_id: m.frame_id,
        width: m.width,
        height: m.height,
        distortion_model: m.distortion_model,
        d: m.d,
        k: m.k,
        r: m.r,
        p: m.p,
    }
}

fn frame_edge(m: &FrameTransform) -> Result<FrameEdge, MessageFault> {
    let t = m.translation.unwrap_or_default();
    let q = m
        .rotation
        .map_or([0.0, 0.0, 0.0, 1.0], |q| [q.x, q.y, q.z, q.w]);
    Ok(FrameEdge {
        parent: m.parent_frame_id.clone(),
        child: m.child_frame_id.clone(),
        pose: pose([t.x, t.y, t.z], q)?,
    })
}
