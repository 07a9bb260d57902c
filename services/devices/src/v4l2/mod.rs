//! RealSense by Video4Linux: the nodes of depth (Z16) and colour of one USB device.

mod abi;
mod kernel;
mod node;
mod sysfs;

use super::calibration::given;
use super::device::{choose, source_name};
use super::driver::{Driver, Formats, Opened, POLL, SensorImage, StreamFormat};
use super::packed::packed_rows;
use super::{Device, DeviceError, DeviceOptions, Family, Mode, Stream};
use node::{NodeMode, Streaming, VideoNode};
use std::io;
use std::path::PathBuf;
use sysfs::UsbCamera;

/// Images a second that are preferred.
const RATE: f64 = 30.0;

/// Places of the kernel's files.
struct Places {
    class: PathBuf,
    nodes: PathBuf,
}

impl Places {
    fn system() -> Self {
        Self {
            class: Family::V4l2.library().0.into(),
            nodes: "/dev".into(),
        }
    }

    /// USB cameras, those without depth as well.
    fn cameras(&self) -> Result<Vec<UsbCamera>, DeviceError> {
        match sysfs::cameras(&self.class) {
            // The class appears with the first camera.
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(vec![]),
            other => other.map_err(|e| DeviceError::missing(Family::V4l2, e.to_string())),
        }
    }

    /// Nodes that can be opened, with their modes.
    fn nodes(&self, camera: &UsbCamera) -> Vec<(VideoNode, Vec<NodeMode>)> {
        let open = |name: &String| {
            let node = VideoNode::open(&self.nodes.join(name)).ok()?;
            let modes = node.modes();
            Some((node, modes))
        };
        camera.nodes.iter().filter_map(open).collect()
    }

    /// Cameras with a node of depth.
    fn list(&self) -> Result<Vec<Device>, DeviceError> {
        let cameras = self.cameras()?.into_iter();
        let described = cameras.map(|camera| {
            let modes = self.nodes(&camera).into_iter().flat_map(|(_, modes)| modes);
            Device {
                family: Family::V4l2,
                modes: modes.map(|m| described(&m)).collect(),
                serial: camera.serial,
                name: camera.name,
            }
        });
        let has_depth = |d: &Device| d.modes.iter().any(|m| m.stream == Stream::Depth);
        Ok(described.filter(has_depth).collect())
    }

    fn open(&self, serial: Option<&str>, options: &DeviceOptions) -> Result<Opened, DeviceError> {
        let present: Vec<String> = self.list()?.into_iter().map(|d| d.serial).collect();
        let serial = choose(Family::V4l2, serial, &present)?;
        let name = source_name(Family::V4l2, &serial);
        let Some(file) = given(&name, options)? else {
            let why = "V4L2 states no calibration: give a camera.json (`camera = PATH`), for instance of `rs-enumerate-devices -c`";
            return Err(DeviceError::calibration(&name, why));
        };
        let mut cameras = self.cameras()?.into_iter();
        let camera = cameras.find(|c| c.serial == serial);
        let mut nodes = camera.map(|c| self.nodes(&c)).unwrap_or_default();
        let color = file.lenses.color.unwrap_or(file.lenses.depth).intrinsics;
        let depth = file.lenses.depth.intrinsics;
        let depth = start(
            &name,
            Stream::Depth,
            [depth.width, depth.height],
            &mut nodes,
        )?;
        let color = start(
            &name,
            Stream::Color,
            [color.width, color.height],
            &mut nodes,
        )?;
        let formats = Formats {
            depth: depth.1,
            color: Some(color.1),
        };
        Ok(Opened {
            driver: Box::new(V4l2Driver {
                name: name.clone(),
                streams: [(Stream::Depth, depth), (Stream::Color, color)],
            }),
            name,
            formats,
            lenses: file.lenses,
            depth_scale: file.depth_scale,
        })
    }
}

/// Cameras that are plugged in.
///
/// # Errors
/// When the kernel's list cannot be read.
pub(super) fn list() -> Result<Vec<Device>, DeviceError> {
    Places::system().list()
}

/// Opens a camera by its serial number.
///
/// # Errors
/// Without the camera, when it refuses, and without a given calibration.
pub(super) fn open(serial: Option<&str>, options: &DeviceOptions) -> Result<Opened, DeviceError> {
    Places::system().open(serial, options)
}

fn described(mode: &NodeMode) -> Mode {
    Mode {
        stream: mode.stream,
        width: mode.format.width,
        height: mode.format.height,
        rate: mode.format.rate,
    }
}

/// A running stream and its format.
type Running = (Streaming, StreamFormat);

/// Starts a stream in the size of its lens, on the node that has it; the node is taken out of `nodes`.
fn start(
    name: &str,
    stream: Stream,
    [width, height]: [u32; 2],
    nodes: &mut Vec<(VideoNode, Vec<NodeMode>)>,
) -> Result<Running, DeviceError> {
    let fits =
        |m: &&NodeMode| m.stream == stream && (m.format.width, m.format.height) == (width, height);
    let best = |modes: &[NodeMode]| {
        let off = |m: &NodeMode| (m.format.rate - RATE).abs();
        let fitting = modes.iter().filter(fits);
        fitting.copied().min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let found = nodes
        .iter()
        .enumerate()
        .find_map(|(i, (_, modes))| Some((i, best(modes)?)));
    let Some((index, mode)) = found else {
        let offered = nodes
            .iter()
            .flat_map(|(_, modes)| modes)
            .filter(|m| m.stream == stream);
        let mut offered: Vec<String> = offered
            .map(|m| format!("{}×{}", m.format.width, m.format.height))
            .collect();
        offered.dedup();
        let why = format!(
            "no mode of {width}×{height}, the calibration's size; there are {}",
            offered.join(", ")
        );
        return Err(DeviceError::driver(name, stream.name(), why));
    };
    let (node, _) = nodes.swap_remove(index);
    let started = node.start(&mode);
    let fault = |e: io::Error| DeviceError::driver(name, stream.name(), e.to_string());
    Ok((started.map_err(fault)?, mode.format))
}

struct V4l2Driver {
    name: String,
    streams: [(Stream, Running); 2],
}

impl Driver for V4l2Driver {
    fn poll(&mut self, sink: &mut dyn FnMut(SensorImage)) -> Result<(), DeviceError> {
        let fault = |stream: Stream| {
            let name = &self.name;
            move |why: String| DeviceError::driver(name, stream.name(), why)
        };
        let nodes = self.streams.each_ref().map(|(_, (s, _))| s.node.file());
        kernel::wait(&nodes, POLL).map_err(|e| fault(Stream::Depth)(e.to_string()))?;
        for (stream, (streaming, format)) in &self.streams {
            let image = streaming
                .read()
                .map_err(|e| fault(*stream)(e.to_string()))?;
            let Some(image) = image else { continue };
            let bytes = packed_rows(image.bytes, streaming.bytes_per_line as usize, format);
            sink(SensorImage {
                stream: *stream,
                time_ns: image.time_ns,
                bytes: bytes.map_err(fault(*stream))?,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
