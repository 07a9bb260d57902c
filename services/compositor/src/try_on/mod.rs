//! One try-on: its life, its pictures, its task.

mod drawing;
mod handle;
mod lifecycle;
mod open;
pub(crate) mod task;

pub(crate) use handle::{Command, Handle, Setup};
pub(crate) use open::spawn;
