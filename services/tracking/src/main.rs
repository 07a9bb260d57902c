//! `tryon-tracking`: body states from frames.

use clap::Parser;
use std::process::ExitCode;
use tryon_kit::process::{self, Args, BusRole};

#[global_allocator]
static ALLOCATOR: tryon_kit::forget::Zeroing = tryon_kit::forget::ZEROING;

fn main() -> ExitCode {
    process::run(
        "tracking",
        BusRole::Connect,
        Args::parse(),
        |config, ctx| async move { tryon_tracking::start(&config, ctx).await },
    )
}
