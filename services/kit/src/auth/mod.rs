//! Who may call what (docs/decisions/062): tokens of an issuer, checked before a message is decoded.
//!
//! A token is a JWS (`jws`) over `claims`, made by an `issuer`. Every server is behind a `gate`, which asks the
//! `authority` of its box and ends streams whose token is revoked (`revocation`) or expires (`ending`). Handlers check the
//! claims that messages are about through the [`Grant`] of a request. Services present `credentials` of their own to each
//! other. A kiosk gets its token for a code (`enrolment`).

mod authority;
mod claims;
mod credentials;
mod ending;
mod enrolment;
mod gate;
mod grant;
mod issuer;
mod jws;
mod keys;
mod revocation;

pub use claims::Claims;
pub use credentials::{Connection, Credentials};
pub use enrolment::{Caller, EnrolFault, Enrolments, LIFE as CODE_LIFE};
pub use grant::Grant;
pub use issuer::{Issuer, create_secret, random_jti, replace_secret};
pub use keys::KeyFault;

use crate::config::Config;
use authority::Authority;
use axum::Router;
use std::sync::Arc;

/// Reason for which a token is refused; the same for every method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// There is none, or more than one.
    #[error("a token is needed: `authorization: Bearer TOKEN`")]
    Missing,
    /// It is longer than any that is issued.
    #[error("the token is too long")]
    TooLong,
    /// It is no JWS in compact form.
    #[error("the token is malformed")]
    Malformed,
    /// Its algorithm is another than EdDSA.
    #[error("the token's algorithm is not EdDSA")]
    Algorithm,
    /// No key of this box has signed it.
    #[error("the token is signed by nobody known here")]
    Signature,
    /// A claim is missing, doubled or of another type.
    #[error("the token's claims are malformed")]
    Claims,
    /// Its life is over.
    #[error("the token has expired")]
    Expired,
    /// Its life has not begun.
    #[error("the token is not valid yet")]
    NotYet,
    /// It is on the list.
    #[error("the token is revoked")]
    Revoked,
    /// The connection has failed, and so have too many others.
    #[error("too many bad tokens; try again on a new connection")]
    Spent,
}

/// A section `[auth]` that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{key}: {why}")]
pub struct AuthError {
    /// Key of the configuration.
    pub key: &'static str,
    /// Fault.
    pub why: String,
}

/// Authentication of a process: the authority over its servers, and its own credentials. Clones share both.
#[derive(Clone)]
pub struct Auth {
    authority: Option<Arc<Authority>>,
    credentials: Credentials,
    enrolments: Option<Arc<Enrolments>>,
}

impl Auth {
    /// Neither asks for tokens nor has one: services of a developer, on loopback.
    pub fn off() -> Self {
        Self {
            authority: None,
            credentials: Credentials::none(),
            enrolments: None,
        }
    }

    /// Authentication as `[auth]` says; without `keys` it asks for no tokens. `own` is the issuer of a box whose services
    /// share this process: its tokens are taken too, and the services present one. Follows files on tasks of the runtime.
    ///
    /// # Errors
    /// Names the key whose file cannot be used.
    pub fn open(config: &Config, own: Option<&Issuer>) -> Result<Self, AuthError> {
        let c = &config.auth;
        let fault = |key| move |why: String| AuthError { key, why };
        let mut keys = Vec::new();
        for file in &c.keys {
            let read = keys::read_public(file).map_err(|e| format!("{}: {e}", file.display()));
            keys.push(read.map_err(fault("auth.keys"))?);
        }
        keys.extend(own.map(Issuer::public));
        let revoked = if c.revoked.as_os_str().is_empty() {
            revocation::Revocations::none()
        } else {
            revocation::Revocations::follow(&c.revoked).map_err(fault("auth.revoked"))?
        };
        let credentials = match own {
            Some(issuer) => issuer
                .credentials(config.store())
                .map_err(|e| fault("auth.store")(e.to_string()))?,
            None if c.token.as_os_str().is_empty() => Credentials::none(),
            None => Credentials::follow(&c.token).map_err(fault("auth.token"))?,
        };
        if keys.is_empty() {
            tracing::warn!("no auth.keys: every process of this machine may call the services");
        }
        let authority = Authority::new(keys, config.store().into(), revoked);
        Ok(Self {
            authority: authority.map(Arc::new),
            credentials,
            enrolments: (!c.enrolments.as_os_str().is_empty())
                .then(|| Arc::new(Enrolments::new(&c.enrolments))),
        })
    }

    /// Routes of a service behind its gate: no message is decoded without a token that covers the call.
    pub fn guard(&self, service: &'static str, routes: Router) -> Router {
        gate::guard(self.authority.clone(), service, routes)
    }

    /// The process's own token for calls to its neighbours.
    pub fn credentials(&self) -> &Credentials {
        &self.credentials
    }

    /// Codes that kiosks may trade here.
    pub fn enrolments(&self) -> Option<Arc<Enrolments>> {
        self.enrolments.clone()
    }
}

/// Unix time, whole seconds.
fn unix_s() -> u64 {
    crate::sessions::unix_ns() / 1_000_000_000
}
