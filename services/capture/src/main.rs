//! `tryon-capture`: cameras and recordings onto the bus.

use clap::Parser;
use std::process::ExitCode;
use tryon_kit::process::{self, Args, BusRole, Program};

#[global_allocator]
static ALLOCATOR: tryon_kit::forget::Zeroing = tryon_kit::forget::ZEROING;

fn main() -> ExitCode {
    let program = Program {
        name: "capture",
        role: BusRole::Listen,
        check: tryon_capture_service::check_process,
    };
    process::run(program, Args::parse(), |config, ctx| async move {
        tryon_capture_service::start(&config, ctx).await
    })
}
