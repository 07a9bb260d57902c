//! Arguments of `tryon token`.

use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct TokenArgs {
    #[command(subcommand)]
    pub(crate) what: TokenWhat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum TokenWhat {
    /// Make an issuer's key pair: issuer.pem to sign tokens with, issuer.pub.pem for `auth.keys` of the services.
    Key(TokenKeyArgs),
    /// Sign a token and print it; its identity, for `revoke`, goes to standard error.
    Issue(TokenIssueArgs),
    /// Add tokens to the list of `auth.revoked`: services refuse them and end their streams within a second.
    Revoke(TokenRevokeArgs),
    /// Draw a code that a kiosk trades for its own token: of one use, for ten minutes.
    Enrol(TokenEnrolArgs),
    /// Trade a code for the token of this kiosk.
    Redeem(TokenRedeemArgs),
}

#[derive(Debug, Args)]
pub(crate) struct TokenKeyArgs {
    /// Folder for both files; neither may exist.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

/// Services that may take a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum AudienceArg {
    /// Cameras and recordings.
    Capture,
    /// Body states.
    Tracking,
    /// Garments.
    Cloth,
    /// Pictures: what kiosks and pages call.
    Compositor,
}

/// Claims that `issue` and `enrol` share.
#[derive(Debug, Args)]
pub(crate) struct ClaimArgs {
    /// Private key of the issuer.
    #[arg(long, value_name = "FILE")]
    pub(crate) key: PathBuf,
    /// Store of the services (`capture.store`).
    #[arg(long, value_name = "NAME")]
    pub(crate) store: String,
    /// Names of remote procedures, such as StreamFrames; without any, all of them.
    #[arg(long = "method", value_name = "RPC", default_values_t = ["*".to_owned()])]
    pub(crate) methods: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct TokenIssueArgs {
    #[command(flatten)]
    pub(crate) claims: ClaimArgs,
    /// Services that take it.
    #[arg(long, required = true, num_args = 1.., value_name = "SERVICE")]
    pub(crate) audience: Vec<AudienceArg>,
    /// Its one camera; without it, all of the store.
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: Option<String>,
    /// Its one try-on or session; without it, all of them.
    #[arg(long, value_name = "ID")]
    pub(crate) session: Option<String>,
    /// Seconds that it lives.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) ttl: u64,
    /// File for the token, for its owner's eyes, instead of standard output.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct TokenRevokeArgs {
    /// The list, a `jti` a line; made when there is none.
    #[arg(long, value_name = "FILE")]
    pub(crate) list: PathBuf,
    /// Identities of the tokens.
    #[arg(required = true, value_name = "JTI")]
    pub(crate) tokens: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct TokenEnrolArgs {
    #[command(flatten)]
    pub(crate) claims: ClaimArgs,
    /// Camera of the kiosk.
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: String,
    /// Folder of codes that the compositor reads (`auth.enrolments`).
    #[arg(long, value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// Seconds that the kiosk's token lives; 90 days.
    #[arg(long, value_name = "S", default_value_t = 90 * 24 * 3600, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) ttl: u64,
}

#[derive(Debug, Args)]
pub(crate) struct TokenRedeemArgs {
    /// URL of the compositor.
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8080")]
    pub(crate) at: String,
    /// Authorities of its certificate (PEM), for an `https` URL.
    #[arg(long, value_name = "FILE")]
    pub(crate) ca: Option<PathBuf>,
    /// The code; case, dashes and spaces do not matter.
    #[arg(value_name = "CODE")]
    pub(crate) code: String,
    /// File for the token, for its owner's eyes; it replaces an old one.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}
