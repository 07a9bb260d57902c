//! `tryon-bench make-body`: the embedded body, from its anatomy tables.

use crate::args::MakeBodyArgs;
use anyhow::{Context, Result};
use std::process::ExitCode;
use tryon_bench::made_body::generate;

/// Runs the command.
pub(crate) fn run(args: &MakeBodyArgs) -> Result<ExitCode> {
    let body = generate()?;
    let bytes = body.to_bytes();
    std::fs::write(&args.out, &bytes)
        .with_context(|| format!("cannot write {}", args.out.display()))?;
    println!(
        "{}: {} vertices, {} bytes",
        args.out.display(),
        body.mesh().vertices().len(),
        bytes.len()
    );
    Ok(ExitCode::SUCCESS)
}
