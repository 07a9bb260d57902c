//! `tryon-cloth`: garment meshes from body states.

use clap::Parser;
use std::process::ExitCode;
use tryon_kit::process::{self, Args, BusRole, Program};

#[global_allocator]
static ALLOCATOR: tryon_kit::forget::Zeroing = tryon_kit::forget::ZEROING;

fn main() -> ExitCode {
    let program = Program {
        name: "cloth",
        role: BusRole::Apart,
        check: tryon_cloth_service::check,
    };
    process::run(program, Args::parse(), |config, ctx| async move {
        tryon_cloth_service::start(&config, ctx).await
    })
}
