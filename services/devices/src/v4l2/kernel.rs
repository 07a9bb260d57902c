//! Calls of the kernel for a video node: requests, mapped buffers, waiting.
#![allow(unsafe_code)] // ioctl, mmap and poll: each call has its reason

use super::abi::{
    self, Buffer, CAPTURE, Capability, Format, FormatDescription, FrameInterval, FrameSize,
    MEMORY_MMAP, RequestBuffers, StreamParameters,
};
use std::ffi::{c_int, c_ulong, c_void};
use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::time::Duration;

/// A structure of linux/videodev2.h. All of them are plain numbers, for which zeros are valid.
///
/// # Safety
/// The layout is the kernel's, and `REQUESTS` are those that take the structure.
pub(super) unsafe trait Structure: Copy {
    const REQUESTS: &'static [c_ulong];
}

macro_rules! structures {
    ($($name:ident: $($request:ident)*;)*) => {
        $(
            // SAFETY: the test of this module compares sizes, offsets and numbers with the C header.
            unsafe impl Structure for $name {
                const REQUESTS: &'static [c_ulong] = &[$(abi::$request),*];
            }
        )*
    };
}

structures! {
    Capability: QUERYCAP;
    FormatDescription: ENUM_FMT;
    FrameSize: ENUM_FRAMESIZES;
    FrameInterval: ENUM_FRAMEINTERVALS;
    Format: S_FMT;
    StreamParameters: S_PARM;
    RequestBuffers: REQBUFS;
    Buffer: QUERYBUF QBUF DQBUF;
}

/// A structure of zeros.
pub(super) fn zeroed<T: Structure>() -> T {
    // SAFETY: `Structure` is of plain numbers.
    unsafe { std::mem::zeroed() }
}

/// Sends a request with its structure, which the kernel fills in.
///
/// # Errors
/// The kernel's, and requests of another structure.
pub(super) fn send<T: Structure>(node: &File, request: c_ulong, value: &mut T) -> io::Result<()> {
    if !T::REQUESTS.contains(&request) {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    // SAFETY: the request takes a pointer to this structure, and the descriptor is open.
    check(unsafe { libc::ioctl(node.as_raw_fd(), request as _, std::ptr::from_mut(value)) })
}

/// Starts or stops the images.
///
/// # Errors
/// The kernel's.
pub(super) fn stream(node: &File, is_on: bool) -> io::Result<()> {
    let request = if is_on { abi::STREAMON } else { abi::STREAMOFF };
    let kind = CAPTURE.cast_signed();
    // SAFETY: both requests take a pointer to an int, and the descriptor is open.
    check(unsafe { libc::ioctl(node.as_raw_fd(), request as _, &raw const kind) })
}

fn check(code: c_int) -> io::Result<()> {
    if code < 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(())
}

/// A buffer that the kernel fills, in this process's memory.
pub(super) struct Mapped {
    start: *mut c_void,
    length: usize,
}

// SAFETY: the memory is this process's, and its owner is used by one thread at a time.
unsafe impl Send for Mapped {}

impl Mapped {
    /// Maps the buffer of an index.
    ///
    /// # Errors
    /// The kernel's.
    pub(super) fn new(node: &File, index: u32) -> io::Result<Self> {
        let mut buffer = Buffer {
            index,
            kind: CAPTURE,
            memory: MEMORY_MMAP,
            ..zeroed()
        };
        send(node, abi::QUERYBUF, &mut buffer)?;
        let length = buffer.length as usize;
        // Half of the union on 64 bits.
        let offset = libc::off_t::from(u32::try_from(buffer.offset & 0xffff_ffff).unwrap_or(0));
        let (access, flags) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_SHARED);
        // SAFETY: a new mapping at a place that the kernel chooses.
        let start = unsafe {
            libc::mmap(
                std::ptr::null_mut(),
                length,
                access,
                flags,
                node.as_raw_fd(),
                offset,
            )
        };
        if start == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        Ok(Self { start, length })
    }

    /// Copy of the first bytes. The buffer is not queued, so that the kernel does not write it.
    pub(super) fn copy(&self, bytes: u32) -> Vec<u8> {
        let length = self.length.min(bytes as usize);
        // SAFETY: the mapping has `length` bytes and lives as long as `self`; the driver has given the buffer back.
        unsafe { std::slice::from_raw_parts(self.start.cast::<u8>(), length) }.to_vec()
    }
}

impl Drop for Mapped {
    fn drop(&mut self) {
        // SAFETY: mapped with this length, and nothing refers to it any more.
        unsafe { libc::munmap(self.start, self.length) };
    }
}

/// Waits until one of the nodes has an image or a fault.
///
/// # Errors
/// The kernel's.
pub(super) fn wait(nodes: &[&File], wait: Duration) -> io::Result<()> {
    let entry = |node: &&File| libc::pollfd {
        fd: node.as_raw_fd(),
        events: libc::POLLIN,
        revents: 0,
    };
    let mut entries: Vec<libc::pollfd> = nodes.iter().map(entry).collect();
    let wait = c_int::try_from(wait.as_millis()).unwrap_or(c_int::MAX);
    // SAFETY: the entries are as many as stated, of open descriptors.
    let code = unsafe { libc::poll(entries.as_mut_ptr(), entries.len() as libc::nfds_t, wait) };
    match check(code) {
        Err(e) if e.kind() != io::ErrorKind::Interrupted => Err(e),
        _ => Ok(()),
    }
}
