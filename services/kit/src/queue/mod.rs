//! Bounded queues whose policy is their type.
//!
//! - [`latest`]: one slot; a newer value replaces a waiting one and the loss is counted. Frames, pictures.
//! - [`ordered`]: keyframes are never lost; when full, the oldest update is dropped. Garments.
//! - [`pace`]: values on the way to a reader that acknowledges nothing, bounded by what its transport reports. Pictures.
//! - `tokio::sync::watch`: the current value, for any number of readers. Body states, life cycles.

pub mod consumption;
pub mod latest;
pub mod ordered;
pub mod pace;
