//! `tryon-capture`: cameras and recordings onto the bus.

use clap::Parser;
use std::process::ExitCode;
use tryon_kit::process::{self, Args, BusRole};

#[global_allocator]
static ALLOCATOR: tryon_kit::forget::Zeroing = tryon_kit::forget::ZEROING;

fn main() -> ExitCode {
    process::run(
        "capture",
        BusRole::Listen,
        Args::parse(),
        |config, ctx| async move { tryon_capture::start(&config, ctx).await },
    )
}
