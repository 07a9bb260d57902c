//! The only place where wire becomes domain, and back.
//!
//! Everything that arrives is checked here: sizes before allocation, numbers for being finite, names, ranges.
//! An error names the field by its path, `message.field`, as in the protos.

pub mod body;
mod bulk;
mod codec;
mod error;
pub mod fit;
pub mod frame;
pub mod garment;
pub mod geometry;
pub mod request;

pub use error::{WireError, required};
