//! `tryon`: the whole product on the command line.
//!
//! # Ideas
//!
//! Offline cloth:
//!
//! - Commands: [`mod@commands::run_offline`], [`mod@offline_files`].
//! - By a running service: [`mod@commands::fine`].
//!
//! Wire and processes:
//!
//! - Supervision of one box: [`mod@onebox`].
//!
//! Evidence:
//!
//! - Body drawn over its frame: [`mod@overlay`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules
#![allow(
    clippy::print_stdout,
    reason = "this is the one program whose standard output is for people and scripts"
)]

mod args;
mod closed_output;
mod commands;
mod input;
mod interrupt;
mod offline_files;
mod onebox;
mod overlay;
mod preview;
mod recording;
mod report;
mod say;
mod viewer;

use args::{Cli, Command};
use clap::Parser;
use std::process::ExitCode;
use tryon_kit::config::LogConfig;
use tryon_kit::core_dump;
use tryon_kit::process::EXIT_USAGE;
use tryon_kit::telemetry;

#[global_allocator]
static ALLOCATOR: tryon_kit::forget::Zeroing = tryon_kit::forget::ZEROING;

fn main() -> ExitCode {
    core_dump::forbid();
    let cli = Cli::parse();
    closed_output::end_when_closed(&cli.command);
    // `up` logs as its configuration says.
    if !matches!(cli.command, Command::Up(_)) {
        let log = LogConfig {
            level: cli.log.clone().unwrap_or_else(|| "warn".into()),
            ..LogConfig::default()
        };
        if let Err(why) = telemetry::init_logs(&log) {
            eprintln!("tryon: --log: {why}");
            return ExitCode::from(EXIT_USAGE);
        }
    }
    let outcome = match cli.command {
        Command::Demo(a) => commands::demo::run(&a),
        Command::Up(a) => commands::up::run(&a, cli.log),
        Command::Run(a) => commands::run::run(&a),
        Command::Track(a) => commands::track::run(&a),
        Command::Simulate(a) => commands::simulate::run(&a),
        Command::Fine(a) => commands::fine::run(&a),
        Command::Composite(a) => commands::composite::run(&a),
        Command::Clothcap(a) => commands::clothcap::run(&a),
        Command::Import(a) => commands::import::run(&a),
        Command::Export(a) => commands::export::run(&a),
        Command::Record(a) => commands::record::run(&a),
        Command::Replay(a) => commands::replay::run(&a),
        Command::Camera(a) => commands::camera::run(&a),
        Command::Token(a) => commands::token::run(&a),
        Command::Identity(a) => commands::identity::run(&a),
        Command::Doctor(a) => commands::doctor::run(&a),
    };
    match outcome {
        Ok(code) => code,
        Err(e) => {
            // The whole chain of causes on one line: what failed, in which file or field, and why.
            eprintln!("tryon: {e:#}");
            ExitCode::FAILURE
        }
    }
}
