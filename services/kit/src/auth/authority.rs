//! Judge of tokens of a box: keys, store, revocations, and the budget of checks.
//!
//! A flood of bad tokens must not lock out whoever shares its address. So failures cost their connection: the first
//! token of a connection is always checked, which costs no more than the connection did. Once a check of it has failed,
//! it draws from one budget with all others that have, and after eight failures it ends ([`Seat::fail_proof`]).

use super::claims::{Call, Claims};
use super::revocation::Revocations;
use super::{Fault, jws, unix_s};
use crate::connections::Seat;
use crate::peer_budget::{Allowance, Bucket};
use ed25519_dalek::VerifyingKey;
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Checks for all connections on which one has failed. A signature cannot be guessed: this bounds the work (60 µs a
/// check, a sixteenth of a core in all) and the log.
const ALLOWANCE: Allowance = Allowance {
    burst: 500.0,
    per_second: 1000.0,
};
/// Most signatures that are remembered as good.
const MAX_KNOWN: usize = 1024;

type Digest256 = [u8; 32];

/// Judge of tokens.
pub(super) struct Authority {
    keys: Vec<VerifyingKey>,
    store: String,
    revoked: Revocations,
    checks: Mutex<Bucket>,
    /// Claims by digest of tokens whose signature was good, which is not checked again.
    known: Mutex<HashMap<Digest256, Arc<Claims>>>,
}

impl Authority {
    /// `None` without a key: nobody could pass.
    pub(super) fn new(
        keys: Vec<VerifyingKey>,
        store: String,
        revoked: Revocations,
    ) -> Option<Self> {
        (!keys.is_empty()).then(|| Self {
            keys,
            store,
            revoked,
            checks: Mutex::new(Bucket::full(ALLOWANCE, Instant::now())),
            known: Mutex::default(),
        })
    }

    pub(super) fn revoked(&self) -> Revocations {
        self.revoked.clone()
    }

    /// Claims of a valid token that came on a connection.
    pub(super) fn authenticate(
        &self,
        token: &str,
        seat: Option<&Seat>,
    ) -> Result<Arc<Claims>, Fault> {
        let claims = self.claims(token, seat)?;
        claims.check_life(unix_s())?;
        if self.revoked.contains(&claims.jti) {
            return Err(Fault::Revoked);
        }
        Ok(claims)
    }

    /// The claim that does not cover a call, if there is one.
    pub(super) fn refusal(
        &self,
        claims: &Claims,
        service: &str,
        method: &str,
    ) -> Option<&'static str> {
        claims.refusal(&Call {
            service,
            store: &self.store,
            method,
        })
    }

    /// Claims of a token with a good signature.
    fn claims(&self, token: &str, seat: Option<&Seat>) -> Result<Arc<Claims>, Fault> {
        let digest: Digest256 = Sha256::digest(token).into();
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(claims) = known().get(&digest) {
            return Ok(claims.clone());
        }
        let claims = self.check(token, seat);
        if let (Err(_), Some(seat)) = (&claims, seat) {
            seat.fail_proof();
        }
        let claims = Arc::new(claims?);
        let mut known = known();
        if known.len() >= MAX_KNOWN {
            known.clear();
        }
        known.insert(digest, claims.clone());
        Ok(claims)
    }

    /// Checks a token within the budget.
    fn check(&self, token: &str, seat: Option<&Seat>) -> Result<Claims, Fault> {
        let mut checks = self.checks.lock().unwrap_or_else(PoisonError::into_inner);
        if !seat.is_some_and(Seat::is_clean) && !checks.take(Instant::now()) {
            return Err(Fault::Spent);
        }
        drop(checks);
        Claims::read(&jws::verify(token, &self.keys)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::Issuer;

    fn claims(change: impl FnOnce(&mut Claims)) -> Claims {
        let mut claims = Claims {
            aud: vec!["cloth".into()],
            exp: unix_s() + 60,
            nbf: None,
            jti: "j".into(),
            store: "store".into(),
            camera: None,
            session: None,
            methods: vec!["*".into()],
        };
        change(&mut claims);
        claims
    }

    fn authority(issuer: &Issuer, revoked: Revocations) -> Authority {
        Authority::new(vec![issuer.public()], "store".into(), revoked).expect("a key")
    }

    #[tokio::test]
    async fn valid_tokens_pass_until_they_end_or_are_revoked() {
        let dir = tempfile::tempdir().expect("a folder");
        let list = dir.path().join("revoked");
        std::fs::write(&list, "gone\n").expect("written");
        let issuer = Issuer::generate().expect("random");
        let a = authority(&issuer, Revocations::follow(&list).expect("there"));
        let judge = |c: &Claims| a.authenticate(&issuer.issue(c).expect("short"), None);
        assert!(judge(&claims(|_| {})).is_ok());
        let expired = claims(|c| c.exp = unix_s() - 1);
        assert_eq!(judge(&expired), Err(Fault::Expired));
        let early = claims(|c| c.nbf = Some(unix_s() + 60));
        assert_eq!(judge(&early), Err(Fault::NotYet));
        assert_eq!(
            judge(&claims(|c| c.jti = "gone".into())),
            Err(Fault::Revoked)
        );
        let foreign = Issuer::generate().expect("random");
        let token = foreign.issue(&claims(|_| {})).expect("short");
        assert_eq!(a.authenticate(&token, None), Err(Fault::Signature));
    }

    #[test]
    fn a_flood_spends_its_own_checks_and_fresh_tokens_on_new_connections_pass() {
        let issuer = Issuer::generate().expect("random");
        let a = authority(&issuer, Revocations::none());
        let foreign = Issuer::generate().expect("random");
        let bad = foreign.issue(&claims(|_| {})).expect("short");
        let flood = Seat::alone();
        let first = a.authenticate(&bad, Some(&flood));
        assert_eq!(first, Err(Fault::Signature));
        // More than a slow machine gets back meanwhile.
        let last = (0..20_000)
            .map(|_| a.authenticate("x", Some(&flood)))
            .last();
        assert_eq!(last, Some(Err(Fault::Spent)));
        assert!(flood.is_ended());
        for i in 0..32 {
            let fresh = issuer.issue(&claims(|c| c.jti = format!("kiosk {i}")));
            let fresh = fresh.expect("short");
            assert!(a.authenticate(&fresh, Some(&Seat::alone())).is_ok(), "{i}");
            assert!(
                a.authenticate(&fresh, Some(&flood)).is_ok(),
                "it is known now"
            );
        }
    }

    #[test]
    fn memory_of_known_tokens_is_bounded() {
        let issuer = Issuer::generate().expect("random");
        let a = authority(&issuer, Revocations::none());
        for i in 0..MAX_KNOWN + 10 {
            let token = issuer.issue(&claims(|c| c.jti = i.to_string()));
            assert!(
                a.authenticate(&token.expect("short"), Some(&Seat::alone()))
                    .is_ok()
            );
        }
        assert!(a.known.lock().expect("not poisoned").len() <= MAX_KNOWN);
    }
}
