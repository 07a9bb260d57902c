//! Structures and requests of Video4Linux (linux/videodev2.h), checked against the C header by a test.

use std::ffi::{c_int, c_long, c_ulong};

/// `V4L2_BUF_TYPE_VIDEO_CAPTURE` and `V4L2_MEMORY_MMAP`.
pub(super) const CAPTURE: u32 = 1;
pub(super) const MEMORY_MMAP: u32 = 1;
/// `V4L2_CAP_VIDEO_CAPTURE`, `V4L2_CAP_STREAMING` and `V4L2_CAP_DEVICE_CAPS`.
pub(super) const CAP_CAPTURE: u32 = 1;
pub(super) const CAP_STREAMING: u32 = 0x0400_0000;
pub(super) const CAP_DEVICE_CAPS: u32 = 0x8000_0000;
/// `V4L2_FRMSIZE_TYPE_DISCRETE` and `V4L2_FRMIVAL_TYPE_DISCRETE`.
pub(super) const DISCRETE: u32 = 1;
/// `V4L2_BUF_FLAG_ERROR`.
pub(super) const BUFFER_ERROR: u32 = 0x40;

/// Code of four characters.
pub(super) const fn fourcc(code: &[u8; 4]) -> u32 {
    u32::from_le_bytes(*code)
}

/// `struct v4l2_capability`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct Capability {
    pub(super) driver: [u8; 16],
    pub(super) card: [u8; 32],
    pub(super) bus_info: [u8; 32],
    pub(super) version: u32,
    pub(super) capabilities: u32,
    pub(super) device_caps: u32,
    pub(super) reserved: [u32; 3],
}

/// `struct v4l2_fmtdesc`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct FormatDescription {
    pub(super) index: u32,
    pub(super) kind: u32,
    pub(super) flags: u32,
    pub(super) description: [u8; 32],
    pub(super) pixel_format: u32,
    pub(super) mbus_code: u32,
    pub(super) reserved: [u32; 3],
}

/// `struct v4l2_frmsizeenum`; of stepwise sizes the first is the smallest.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct FrameSize {
    pub(super) index: u32,
    pub(super) pixel_format: u32,
    pub(super) kind: u32,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) stepwise_rest: [u32; 4],
    pub(super) reserved: [u32; 2],
}

/// `struct v4l2_frmivalenum`; of stepwise intervals the first is the shortest.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct FrameInterval {
    pub(super) index: u32,
    pub(super) pixel_format: u32,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) kind: u32,
    pub(super) numerator: u32,
    pub(super) denominator: u32,
    pub(super) stepwise_rest: [u32; 4],
    pub(super) reserved: [u32; 2],
}

/// `struct v4l2_format` of `struct v4l2_pix_format`.
#[repr(C, align(8))]
#[derive(Clone, Copy)]
pub(super) struct Format {
    pub(super) kind: u32,
    padding: u32,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) pixel_format: u32,
    pub(super) field: u32,
    pub(super) bytes_per_line: u32,
    pub(super) size_image: u32,
    rest: [u32; 44],
}

/// `struct v4l2_streamparm` of `struct v4l2_captureparm`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct StreamParameters {
    pub(super) kind: u32,
    pub(super) capability: u32,
    pub(super) mode: u32,
    pub(super) numerator: u32,
    pub(super) denominator: u32,
    rest: [u32; 46],
}

/// `struct v4l2_requestbuffers`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct RequestBuffers {
    pub(super) count: u32,
    pub(super) kind: u32,
    pub(super) memory: u32,
    pub(super) capabilities: u32,
    pub(super) flags: [u8; 4],
}

/// `struct v4l2_buffer`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct Buffer {
    pub(super) index: u32,
    pub(super) kind: u32,
    pub(super) bytes_used: u32,
    pub(super) flags: u32,
    pub(super) field: u32,
    /// Capture time on the system's monotonic clock.
    pub(super) seconds: c_long,
    pub(super) microseconds: c_long,
    pub(super) timecode: [u32; 4],
    pub(super) sequence: u32,
    pub(super) memory: u32,
    /// Of the buffer in the node's memory; the upper half is of other memories.
    pub(super) offset: c_ulong,
    pub(super) length: u32,
    pub(super) reserved: u32,
    pub(super) request: u32,
}

/// Directions of a request: to the kernel, from it, both.
const WRITE: u64 = 1;
const READ: u64 = 2;

/// Number of a request on group `V`.
const fn request<T>(direction: u64, number: u64) -> c_ulong {
    ((direction << 30) | ((size_of::<T>() as u64) << 16) | ((b'V' as u64) << 8) | number) as c_ulong
}

pub(super) const QUERYCAP: c_ulong = request::<Capability>(READ, 0);
pub(super) const ENUM_FMT: c_ulong = request::<FormatDescription>(READ | WRITE, 2);
pub(super) const S_FMT: c_ulong = request::<Format>(READ | WRITE, 5);
pub(super) const REQBUFS: c_ulong = request::<RequestBuffers>(READ | WRITE, 8);
pub(super) const QUERYBUF: c_ulong = request::<Buffer>(READ | WRITE, 9);
pub(super) const QBUF: c_ulong = request::<Buffer>(READ | WRITE, 15);
pub(super) const DQBUF: c_ulong = request::<Buffer>(READ | WRITE, 17);
pub(super) const STREAMON: c_ulong = request::<c_int>(WRITE, 18);
pub(super) const STREAMOFF: c_ulong = request::<c_int>(WRITE, 19);
pub(super) const S_PARM: c_ulong = request::<StreamParameters>(READ | WRITE, 22);
pub(super) const ENUM_FRAMESIZES: c_ulong = request::<FrameSize>(READ | WRITE, 74);
pub(super) const ENUM_FRAMEINTERVALS: c_ulong = request::<FrameInterval>(READ | WRITE, 75);
