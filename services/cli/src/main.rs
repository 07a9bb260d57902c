//! `tryon`: the whole product on the command line.
#![allow(
    clippy::print_stdout,
    reason = "this is the one program whose standard output is for people and scripts"
)]

mod args;
mod commands;
mod input;
mod interrupt;
mod offline_files;
mod onebox;
mod preview;
mod report;
mod say;
mod viewer;

use args::{Cli, Command};
use clap::Parser;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: tryon_kit::forget::Zeroing = tryon_kit::forget::ZEROING;

fn main() -> ExitCode {
    let cli = Cli::parse();
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::new(&cli.log))
        .with_writer(std::io::stderr)
        .init();
    let outcome = match cli.command {
        Command::Demo(a) => commands::demo::run(&a),
        Command::Up(a) => commands::up::run(&a),
        Command::Run(a) => commands::run::run(&a),
        Command::Track(a) => commands::track::run(&a),
        Command::Simulate(a) => commands::simulate::run(&a),
        Command::Fine(a) => commands::fine::run(&a),
        Command::Composite(a) => commands::composite::run(&a),
        Command::Ccd(a) => commands::ccd::run(&a),
        Command::Clothcap(a) => commands::clothcap::run(&a),
        Command::Import(a) => commands::import::run(&a),
        Command::Export(a) => commands::export::run(&a),
        Command::Record(a) => commands::record::run(&a),
        Command::Replay(a) => commands::replay::run(&a),
        Command::TrainParts(a) => commands::train_parts::run(&a),
        Command::Bench(a) => commands::bench::run(&a),
        Command::Token(a) => commands::token::run(&a),
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
