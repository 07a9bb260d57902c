//! Forgetting: every block of memory that a service frees is zeroed first, so that what a session held is gone with it.
//!
//! One guard below all buffers instead of one in each: images, depth, poses, meshes, messages of the transports, and the
//! copies that nobody thinks of. Not covered: buffers of the kernel and of a graphics card, and those that zstd takes
//! from C.
//!
//! The allocator below returns unused pages to the system: resident memory stays where it is after hundreds of sessions,
//! while the C library's grows by 0.1 MiB a session (docs/decisions/074).

use tikv_jemallocator::Jemalloc;
use zeroizing_alloc::ZeroAlloc;

/// Allocator of the programs that see people.
pub type Zeroing = ZeroAlloc<Jemalloc>;

/// The allocator, for `#[global_allocator]`.
pub const ZEROING: Zeroing = ZeroAlloc(Jemalloc);
