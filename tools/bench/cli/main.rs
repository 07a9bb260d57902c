//! `tryon-bench`: run time against error, and what trains the data that is checked in.
#![allow(
    clippy::print_stdout,
    reason = "tables on standard output are for people and scripts"
)]

mod args;
mod ccd;
mod make_body;
mod measure;
mod progress;
mod render_people;
mod score_parts;
mod turntable;

use args::{Cli, Command};
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Tracking(a) => measure::tracking(&a),
        Command::Cloth(a) => measure::cloth(&a),
        Command::Dance(a) => measure::dance(&a),
        Command::Standing(a) => measure::standing(&a),
        Command::Worn(a) => measure::worn(&a),
        Command::Folds(a) => measure::folds(&a),
        Command::Picture(a) => measure::picture(&a),
        Command::People(a) => measure::people(&a),
        Command::Clothcap(a) => measure::clothcap(&a),
        Command::Ccd(a) => ccd::run(&a),
        Command::MakeBody(a) => make_body::run(&a),
        Command::Turntable(a) => turntable::run(&a),
        Command::ScoreParts(a) => score_parts::run(&a),
        Command::RenderPeople(a) => render_people::run(&a),
    };
    outcome.unwrap_or_else(|e| {
        eprintln!("tryon-bench: {e:#}");
        ExitCode::FAILURE
    })
}
