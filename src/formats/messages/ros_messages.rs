//! ROS messages of images, cameras and transforms (`sensor_msgs`, `tf2_msgs`, `geometry_msgs`), ROS 1 and ROS 2.

use super::camera_info::CameraInfo;
use super::fault::MessageFault;
use super::image_layout::ImageLayout;
use super::image_message::ImageMessage;
use super::message_item::MessageItem;
use super::realsense;
use super::transforms::{FrameEdge, pose};
use super::wire_reader::{RosWire, WireReader};

/// Most transforms of a message; robots publish some hundred.
const MOST_TRANSFORMS: u32 = 4096;

/// Message types that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RosKind {
    /// `sensor_msgs/Image`.
    Image,
    /// `sensor_msgs/CompressedImage`.
    CompressedImage,
    /// `sensor_msgs/CameraInfo`.
    CameraInfo,
    /// `tf2_msgs/TFMessage`, `tf/tfMessage`.
    Transforms,
    /// `geometry_msgs/Transform`: extrinsics in a bag of the RealSense SDK.
    Extrinsics,
    /// `std_msgs/Float32`: an option in a bag of the RealSense SDK.
    Number,
    /// `std_msgs/String`: an option in a database of the RealSense SDK.
    NumberText,
}

impl RosKind {
    /// Type by its name: `sensor_msgs/Image`, `sensor_msgs/msg/Image` or `sensor_msgs::msg::dds_::Image_`.
    pub(super) fn of(schema: &str) -> Option<Self> {
        let mut parts = schema.split(['/', ':']).filter(|p| !p.is_empty());
        let package = parts.next()?;
        let name = parts.next_back()?.trim_end_matches('_');
        Some(match (package, name) {
            ("sensor_msgs", "Image") => Self::Image,
            ("sensor_msgs", "CompressedImage") => Self::CompressedImage,
            ("sensor_msgs", "CameraInfo") => Self::CameraInfo,
            ("tf2_msgs", "TFMessage") | ("tf", "tfMessage") => Self::Transforms,
            ("geometry_msgs", "Transform") => Self::Extrinsics,
            ("std_msgs", "Float32") => Self::Number,
            ("std_msgs", "String") => Self::NumberText,
            _ => return None,
        })
    }
    /// True for images, raw or compressed.
    pub(super) fn is_image(self) -> bool {
        matches!(self, Self::Image | Self::CompressedImage)
    }
    /// True where messages of the type under a topic have a part in RGBD frames.
    pub(super) fn has_part(self, topic: &str) -> bool {
        match self {
            Self::Extrinsics => realsense::is_extrinsics(topic),
            Self::Number | Self::NumberText => realsense::is_depth_unit(topic),
            _ => true,
        }
    }
}

/// Decodes a message.
///
/// # Errors
/// The field that is cut short or no text.
pub(super) fn decode(
    wire: RosWire,
    kind: RosKind,
    data: &[u8],
) -> Result<MessageItem<'_>, MessageFault> {
    let mut r = WireReader::new(wire, data)?;
    Ok(match kind {
        RosKind::Image => MessageItem::Image(image(&mut r)?),
        RosKind::CompressedImage => MessageItem::Image(compressed_image(&mut r)?),
        RosKind::CameraInfo => MessageItem::Camera(camera_info(&mut r)?),
        RosKind::Transforms => MessageItem::Transforms(transforms(&mut r)?),
        RosKind::Extrinsics => {
            let pose = transform(&mut r)?;
            let (parent, child) = (String::new(), String::new());
            MessageItem::Transforms(vec![FrameEdge {
                parent,
                child,
                pose,
            }])
        }
        RosKind::Number => MessageItem::DepthUnit(f64::from(r.f32("data")?)),
        RosKind::NumberText => MessageItem::DepthUnit(number(r.text("data")?)?),
    })
}

fn number(text: &str) -> Result<f64, MessageFault> {
    let why = |_| MessageFault::new("data", format!("`{text}`, expected a number"));
    text.trim().parse().map_err(why)
}

/// `std_msgs/Header`.
struct RosHeader<'a> {
    /// ROS 1 only.
    sequence: Option<u32>,
    /// Nanoseconds; `None` where it is zero.
    stamp_ns: Option<u64>,
    frame_id: &'a str,
}

fn header<'a>(r: &mut WireReader<'a>) -> Result<RosHeader<'a>, MessageFault> {
    const SECOND: u64 = 1_000_000_000;
    let sequence = match r.is_ros1() {
        true => Some(r.u32("header.seq")?),
        false => None,
    };
    let seconds = u64::from(r.u32("header.stamp")?);
    let stamp = seconds * SECOND + u64::from(r.u32("header.stamp")?);
    Ok(RosHeader {
        sequence,
        stamp_ns: (stamp != 0).then_some(stamp),
        frame_id: r.text("header.frame_id")?,
    })
}

fn image<'a>(r: &mut WireReader<'a>) -> Result<ImageMessage<'a>, MessageFault> {
    let header = header(r)?;
    let (height, width) = (r.u32("height")?, r.u32("width")?);
    let encoding = r.text("encoding")?.to_owned();
    let is_big_endian = r.u8("is_bigendian")? != 0;
    let step = r.u32("step")?;
    let data = r.bytes("data")?;
    // A field that the RealSense SDK appends.
    let depth_unit = match r.is_ros1() && !r.is_done() {
        true => Some(f64::from(r.f32("depth_units")?)),
        false => None,
    };
    Ok(ImageMessage {
        frame_id: header.frame_id.to_owned(),
        stamp_ns: header.stamp_ns,
        sequence: header.sequence,
        layout: ImageLayout::Raw {
            width,
            height,
            encoding,
            is_big_endian,
            step,
        },
        depth_unit,
        data: data.into(),
    })
}

fn compressed_image<'a>(r: &mut WireReader<'a>) -> Result<ImageMessage<'a>, MessageFault> {
    let header = header(r)?;
    let format = r.text("format")?.to_owned();
    Ok(ImageMessage {
        frame_id: header.frame_id.to_owned(),
        stamp_ns: header.stamp_ns,
        sequence: header.sequence,
        layout: ImageLayout::Compressed { format },
        depth_unit: None,
        data: r.bytes("data")?.into(),
    })
}

fn camera_info(r: &mut WireReader<'_>) -> Result<CameraInfo, MessageFault> {
    let frame_id = header(r)?.frame_id.to_owned();
    let (height, width) = (r.u32("height")?, r.u32("width")?);
    Ok(CameraInfo {
        frame_id,
        width,
        height,
        distortion_model: r.text("distortion_model")?.to_owned(),
        d: r.f64_sequence("D")?,
        k: r.f64s::<9>("K")?.to_vec(),
        r: r.f64s::<9>("R")?.to_vec(),
        p: r.f64s::<12>("P")?.to_vec(),
    })
}

fn transform(r: &mut WireReader<'_>) -> Result<nalgebra::Isometry3<f64>, MessageFault> {
    let translation = r.f64s("transform.translation")?;
    let [x, y, z, w] = r.f64s("transform.rotation")?;
    pose(translation, [x, y, z, w])
}

fn transforms(r: &mut WireReader<'_>) -> Result<Vec<FrameEdge>, MessageFault> {
    let count = r.u32("transforms")?;
    if count > MOST_TRANSFORMS {
        let why = format!("{count}, expected at most {MOST_TRANSFORMS}");
        return Err(MessageFault::new("transforms", why));
    }
    let mut edges = Vec::new();
    for _ in 0..count {
        edges.push(FrameEdge {
            parent: header(r)?.frame_id.to_owned(),
            child: r.text("child_frame_id")?.to_owned(),
            pose: transform(r)?,
        });
    }
    Ok(edges)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_both_generations_are_known() {
        for name in [
            "sensor_msgs/Image",
            "sensor_msgs/msg/Image",
            "sensor_msgs::msg::dds_::Image_",
        ] {
            assert_eq!(RosKind::of(name), Some(RosKind::Image), "{name}");
        }
        assert_eq!(RosKind::of("my_msgs/msg/Image"), None);
        assert_eq!(RosKind::of("Image"), None);
        assert_eq!(RosKind::of(""), None);
    }
}
