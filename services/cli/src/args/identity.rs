//! Arguments of `tryon identity`.

use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct IdentityArgs {
    #[command(subcommand)]
    pub(crate) what: IdentityWhat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum IdentityWhat {
    /// Make the authority of a store where there is none yet, for `identity.authority` of all its services.
    Make(IdentityMakeArgs),
    /// Make a certificate for a program that isn't ours, such as the router: ca.pem, certificate.pem and key.pem.
    Issue(IdentityIssueArgs),
}

#[derive(Debug, Args)]
pub(crate) struct IdentityMakeArgs {
    /// File of the authority; one that is there stays, unless it ends soon.
    #[arg(value_name = "FILE")]
    pub(crate) authority: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct IdentityIssueArgs {
    /// Its common name, which is also a name under which it is called.
    #[arg(value_name = "NAME")]
    pub(crate) name: String,
    /// File of the authority, made where there is none.
    #[arg(long, value_name = "FILE")]
    pub(crate) authority: PathBuf,
    /// Folder for the three files; they replace old ones.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Further names and addresses under which it is called; may be repeated.
    #[arg(long = "name", value_name = "HOST")]
    pub(crate) names: Vec<String>,
}
