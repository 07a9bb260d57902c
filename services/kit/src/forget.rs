//! Forgetting: every block of memory that a service frees is zeroed first, so that what a session held is gone with it.
//!
//! One guard below all buffers instead of one in each: images, depth, poses, meshes, messages of the transports, and the
//! copies that nobody thinks of. Not covered: buffers of the kernel and of a graphics card, and those that zstd takes
//! from C.

use std::alloc::System;

/// Allocator of the programs that see people.
pub type Zeroing = zeroizing_alloc::ZeroAlloc<System>;

/// The allocator, for `#[global_allocator]`.
pub const ZEROING: Zeroing = zeroizing_alloc::ZeroAlloc(System);
