//! `tryon-bench ccd`: continuous collision detection against query sets with truth.

use crate::args::CcdArgs;
use anyhow::Result;
use std::process::ExitCode;
use tryon_bench::ccd::{CcdScore, score_ccd};

/// Runs the command. Exit code 1 when an impact was missed.
pub(crate) fn run(args: &CcdArgs) -> Result<ExitCode> {
    let report = score_ccd(&args.queries)?;
    if args.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        println!(
            "{:32} {:11} {:>8} {:>8} {:>7} {:>7} {:>8} {:>8} {:>10}",
            "group", "kind", "queries", "impacts", "missed", "false", "ns", "mean ns", "step false"
        );
        report.sets.iter().chain([&report.total]).for_each(print);
    }
    let missed = report.total.decision.missed + report.total.step.missed;
    Ok(match missed {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    })
}

fn print(s: &CcdScore) {
    println!(
        "{:32} {:11} {:8} {:8} {:7} {:7} {:8.0} {:8.0} {:10}",
        s.group,
        s.kind,
        s.queries,
        s.impacts,
        s.decision.missed,
        s.decision.false_alarms,
        s.decision.median_ns,
        s.decision.mean_ns,
        s.step.false_alarms
    );
}
