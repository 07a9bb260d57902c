//! Conversion between wire and domain, the only one.
//!
//! Incoming messages are checked here: sizes before allocation, finite numbers, names, ranges. An error names the field
//! by its path, `message.field`, as in the protos.

pub mod body;
pub(crate) mod bulk;
mod codec;
pub(crate) mod error;
pub mod fit;
pub mod frame;
pub mod garment;
pub mod geometry;
pub mod off_person;
mod print;
pub mod request;
pub mod simulation;
mod trim;

pub use error::{WireError, required};
