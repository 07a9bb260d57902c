//! Cameras fed by another program: PublishFrames to a source.

mod description;
mod feed;
mod newest;
mod offset;
mod source;

pub use feed::PUSH;
pub(crate) use feed::{Feed, first, is_push, open};
pub(crate) use newest::Newest;
