//! Findings as commands print them.

use anyhow::Result;
use std::process::ExitCode;
use tryon::inspection::{Finding, Rating};

/// Prints findings, a line each.
pub(crate) fn print(findings: &[Finding]) {
    for f in findings {
        let mark = match f.verdict {
            Rating::Good => "ok  ",
            Rating::Note => "note",
            Rating::Bad => "BAD ",
        };
        println!("{mark} {:14} {}", f.what, f.detail);
    }
}

/// Prints a value as indented JSON.
///
/// # Errors
/// A value that is no JSON.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<()> {
    println!("{}", serde_json::to_string_pretty(value)?);
    Ok(())
}

/// Exit code 1 where something will fail.
pub(crate) fn exit_code(findings: &[Finding]) -> ExitCode {
    if findings.iter().any(|f| f.verdict == Rating::Bad) {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
