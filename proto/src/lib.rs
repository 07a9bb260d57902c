//! The `tryon.v1` contracts: generated messages and services, and the only conversions between wire and domain.
//!
//! The protos in `proto/tryon/v1` are the reference; `src/gen` is made from them by
//! `cargo run -p tryon-proto-generate` and checked in.
//!
//! # Ideas
//!
//! - Arrays as checked bytes: [`mod@convert::bulk`].
//! - Errors by field path: [`mod@convert::error`].
//! - Names of stores, cameras, sessions: [`mod@keys`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub mod convert;
pub mod keys;

/// Encoding and decoding of messages, so that transports need not name prost.
pub use prost::Message;

/// Messages, clients and servers of package `tryon.v1`.
#[allow(
    missing_docs,
    unreachable_pub,
    clippy::all,
    clippy::too_many_lines,
    clippy::unwrap_used,
    rustdoc::all
)]
pub mod v1 {
    include!("gen/tryon.v1.rs");
}

impl std::fmt::Debug for v1::FrameKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FrameKey").finish_non_exhaustive()
    }
}

/// The descriptor set of the package, for gRPC reflection.
pub const DESCRIPTOR: &[u8] = include_bytes!("gen/descriptor.bin");
