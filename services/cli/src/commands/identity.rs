//! `tryon identity`: the authority of a store's services (decision 075).

use crate::args::{IdentityArgs, IdentityIssueArgs, IdentityMakeArgs, IdentityWhat};
use crate::say::say;
use anyhow::{Context, Result};
use std::path::Path;
use std::process::ExitCode;
use tryon_kit::auth::replace_secret;
use tryon_kit::identity::Authority;

/// Runs the command.
///
/// # Errors
/// When a file cannot be read or written, or holds no authority.
pub(crate) fn run(args: &IdentityArgs) -> Result<ExitCode> {
    match &args.what {
        IdentityWhat::Make(a) => make(a),
        IdentityWhat::Issue(a) => issue(a),
    }?;
    Ok(ExitCode::SUCCESS)
}

fn open(file: &Path) -> Result<Authority> {
    Authority::open(file)
        .map_err(anyhow::Error::msg)
        .with_context(|| file.display().to_string())
}

fn make(args: &IdentityMakeArgs) -> Result<()> {
    let authority = open(&args.authority)?;
    say(format_args!(
        "{} is the store's authority until {}: whoever reads it is of the store",
        args.authority.display(),
        authority.end().map_err(anyhow::Error::msg)?
    ));
    Ok(())
}

fn issue(args: &IdentityIssueArgs) -> Result<()> {
    let names: Vec<String> = std::iter::once(&args.name)
        .chain(&args.names)
        .cloned()
        .collect();
    let leaf = open(&args.authority)?.issue(&args.name, &names);
    let leaf = leaf.map_err(anyhow::Error::msg)?;
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    for (name, text) in [
        ("ca.pem", &leaf.authorities),
        ("certificate.pem", &leaf.certificate),
        ("key.pem", &*leaf.key),
    ] {
        let file = args.out.join(name);
        replace_secret(&file, text).with_context(|| file.display().to_string())?;
    }
    Ok(())
}
