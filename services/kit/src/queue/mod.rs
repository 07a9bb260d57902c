//! Bounded queues whose policy is their type.
//!
//! - [`latest`]: one place; a newer value replaces the one that waits and the loss is counted. Frames, pictures.
//! - [`ordered`]: keyframes are never lost, updates are complete in themselves and the oldest goes first. Garments.
//! - `tokio::sync::watch`: the current value, for any number of readers. Body states, life cycles.

pub mod latest;
pub mod ordered;
