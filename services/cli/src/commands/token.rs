//! `tryon token`: keys, tokens and enrolment codes (docs/decisions/062).

use crate::args::{
    AudienceArg, ClaimArgs, TokenArgs, TokenEnrolArgs, TokenIssueArgs, TokenKeyArgs,
    TokenRedeemArgs, TokenRevokeArgs, TokenWhat,
};
use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::{SystemTime, UNIX_EPOCH};
use tryon_kit::auth::{
    CODE_LIFE, Claims, Enrolments, Issuer, create_secret, random_jti, replace_secret,
};
use tryon_kit::client::{channel, request};
use tryon_kit::config::TlsConfig;
use tryon_kit::tls::Tls;
use tryon_proto::keys::is_name;
use tryon_proto::v1::RedeemCodeRequest;
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;

/// Runs the command.
///
/// # Errors
/// When a file cannot be read or written, a claim cannot be one, or the compositor refuses a code.
pub(crate) fn run(args: &TokenArgs) -> Result<ExitCode> {
    match &args.what {
        TokenWhat::Key(a) => key(a),
        TokenWhat::Issue(a) => issue(a),
        TokenWhat::Revoke(a) => revoke(a),
        TokenWhat::Enrol(a) => enrol(a),
        TokenWhat::Redeem(a) => redeem(a),
    }?;
    Ok(ExitCode::SUCCESS)
}

fn key(args: &TokenKeyArgs) -> Result<()> {
    let out = args.out.display();
    let [private, public] = Issuer::generate()?
        .write(&args.out)
        .with_context(|| format!("--out {out}"))?;
    println!(
        "{} signs tokens: keep it off the services",
        private.display()
    );
    println!("{} goes into auth.keys", public.display());
    Ok(())
}

fn issue(args: &TokenIssueArgs) -> Result<()> {
    let claims = claims(&args.claims, &args.audience, args.ttl)?;
    let claims = Claims {
        camera: args
            .camera
            .as_deref()
            .map(|c| name("--camera", c))
            .transpose()?,
        session: args.session.clone(),
        ..claims
    };
    let token = sign(&args.claims, &claims)?;
    match &args.out {
        Some(file) => create_secret(file, &format!("{token}\n"))
            .with_context(|| format!("--out {}", file.display()))?,
        None => println!("{token}"),
    }
    eprintln!("jti {}", claims.jti);
    Ok(())
}

fn revoke(args: &TokenRevokeArgs) -> Result<()> {
    for jti in &args.tokens {
        let is_identity = !jti.contains(|c: char| c.is_whitespace() || c == '#' || c == '.');
        ensure!(
            is_identity && !jti.is_empty(),
            "`{jti}` is no identity of a token: `issue` and `enrol` told it as `jti`"
        );
    }
    let list = &args.list;
    append_lines(list, &args.tokens).with_context(|| format!("--list {}", list.display()))
}

/// Adds lines in one write, so that no reader sees half of one.
fn append_lines(file: &Path, lines: &[String]) -> std::io::Result<()> {
    let old = match std::fs::read(file) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        read => read?,
    };
    let mut text = String::new();
    if old.last().is_some_and(|b| *b != b'\n') {
        text.push('\n');
    }
    text += &lines.join("\n");
    text.push('\n');
    let mut options = std::fs::OpenOptions::new();
    let mut out = options.append(true).create(true).open(file)?;
    out.write_all(text.as_bytes())?;
    out.sync_all()
}

fn enrol(args: &TokenEnrolArgs) -> Result<()> {
    let claims = claims(&args.claims, &[AudienceArg::Compositor], args.ttl)?;
    let claims = Claims {
        camera: Some(name("--camera", &args.camera)?),
        ..claims
    };
    let token = sign(&args.claims, &claims)?;
    let code = Enrolments::new(&args.folder)
        .offer(&token)
        .with_context(|| format!("--folder {}", args.folder.display()))?;
    println!("{code}");
    eprintln!(
        "jti {}; type `tryon token redeem {code}` at the kiosk within {} minutes",
        claims.jti,
        CODE_LIFE.as_secs() / 60
    );
    Ok(())
}

fn redeem(args: &TokenRedeemArgs) -> Result<()> {
    let code = args.code.clone();
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("the runtime")?;
    let answer = runtime.block_on(async {
        let trusted = TlsConfig {
            ca: args.ca.clone().unwrap_or_default(),
            ..TlsConfig::default()
        };
        let tls = Tls::open(&trusted)?;
        let channel = channel(&args.at, &tls).map_err(|e| anyhow::anyhow!("--at {e}"))?;
        let mut compositor = CompositorServiceClient::new(channel);
        match compositor
            .redeem_code(request(RedeemCodeRequest { code }))
            .await
        {
            Ok(answer) => Ok(answer.into_inner()),
            Err(s) => bail!("{}: {}", args.at, s.message()),
        }
    })?;
    replace_secret(&args.out, &format!("{}\n", answer.token))
        .with_context(|| format!("--out {}", args.out.display()))
}

/// Claims of a whole store from now on.
fn claims(args: &ClaimArgs, audience: &[AudienceArg], ttl: u64) -> Result<Claims> {
    let is_method =
        |m: &str| m == "*" || (!m.is_empty() && m.bytes().all(|b| b.is_ascii_alphanumeric()));
    if let Some(bad) = args.methods.iter().find(|m| !is_method(m)) {
        bail!("--method {bad}: the name of a remote procedure is needed, such as StreamFrames");
    }
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .context("the clock")?
        .as_secs();
    let service = |a: &AudienceArg| Some(a.to_possible_value()?.get_name().to_owned());
    Ok(Claims {
        aud: audience.iter().filter_map(service).collect(),
        exp: now.checked_add(ttl).context("--ttl: too long")?,
        nbf: Some(now),
        jti: random_jti()?,
        store: name("--store", &args.store)?,
        camera: None,
        session: None,
        methods: args.methods.clone(),
    })
}

fn name(flag: &str, value: &str) -> Result<String> {
    ensure!(
        is_name(value),
        "{flag} {value}: 1 to 64 characters of [a-z0-9_-] are needed"
    );
    Ok(value.to_owned())
}

fn sign(args: &ClaimArgs, claims: &Claims) -> Result<String> {
    let key = args.key.display();
    let issuer = Issuer::read(&args.key).with_context(|| format!("--key {key}"))?;
    Ok(issuer.issue(claims)?)
}
