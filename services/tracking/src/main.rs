//! `tryon-tracking`: body states from frames.

use clap::Parser;
use std::process::ExitCode;
use tryon_kit::process::{self, Args, BusRole, Program};

#[global_allocator]
static ALLOCATOR: tryon_kit::forget::Zeroing = tryon_kit::forget::ZEROING;

fn main() -> ExitCode {
    let program = Program {
        name: "tracking",
        role: BusRole::Connect,
        check: tryon_tracking_service::check,
    };
    process::run(program, Args::parse(), |config, ctx| async move {
        tryon_tracking_service::start(&config, ctx).await
    })
}
