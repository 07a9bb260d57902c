//! Judge of tokens of a box: keys, store, revocations, and the patience with peers that fail.

use super::claims::{Call, Claims};
use super::revocation::Revocations;
use super::{Fault, jws, unix_s};
use crate::peer_budget::{Allowance, PeerBudget};
use ed25519_dalek::VerifyingKey;
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Bad tokens that a peer may send. A signature cannot be guessed: this bounds the work (60 µs a check) and the log.
const ALLOWANCE: Allowance = Allowance {
    burst: 500.0,
    per_second: 200.0,
};
/// Most signatures that are remembered as good.
const MAX_KNOWN: usize = 1024;

type Digest256 = [u8; 32];

/// Judge of tokens.
pub(super) struct Authority {
    keys: Vec<VerifyingKey>,
    store: String,
    revoked: Revocations,
    failures: PeerBudget,
    /// Claims by digest of tokens whose signature was good. They pass where a peer's attempts are spent, so that nobody
    /// behind the same address locks others out.
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
            failures: PeerBudget::new(ALLOWANCE),
            known: Mutex::default(),
        })
    }

    pub(super) fn revoked(&self) -> Revocations {
        self.revoked.clone()
    }

    /// Claims of a valid token.
    pub(super) fn authenticate(&self, token: &str, peer: IpAddr) -> Result<Arc<Claims>, Fault> {
        let claims = self.claims(token, peer).and_then(|claims| {
            claims.check_life(unix_s())?;
            if self.revoked.contains(&claims.jti) {
                return Err(Fault::Revoked);
            }
            Ok(claims)
        });
        if claims.is_err() {
            self.failures.record(peer, Instant::now());
        }
        claims
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
    fn claims(&self, token: &str, peer: IpAddr) -> Result<Arc<Claims>, Fault> {
        if token.len() > jws::MAX_BYTES {
            return Err(Fault::TooLong);
        }
        let digest: Digest256 = Sha256::digest(token).into();
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(claims) = known().get(&digest) {
            return Ok(claims.clone());
        }
        if self.failures.is_spent(peer, Instant::now()) {
            return Err(Fault::Spent);
        }
        let claims = Arc::new(Claims::read(&jws::verify(token, &self.keys)?)?);
        let mut known = known();
        if known.len() >= MAX_KNOWN {
            known.clear();
        }
        known.insert(digest, claims.clone());
        Ok(claims)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::Issuer;

    const PEER: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

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
        let judge = |c: &Claims| a.authenticate(&issuer.issue(c).expect("short"), PEER);
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
        assert_eq!(a.authenticate(&token, PEER), Err(Fault::Signature));
    }

    #[test]
    fn a_peer_that_fails_is_refused_and_its_neighbour_with_a_known_token_is_not() {
        let issuer = Issuer::generate().expect("random");
        let a = authority(&issuer, Revocations::none());
        let known = issuer.issue(&claims(|_| {})).expect("short");
        assert!(a.authenticate(&known, PEER).is_ok());
        // More than a slow machine gets back meanwhile.
        let last = (0..20_000).map(|_| a.authenticate("x", PEER)).last();
        assert_eq!(last, Some(Err(Fault::Spent)));
        assert!(a.authenticate(&known, PEER).is_ok());
        let other = IpAddr::from([10, 0, 0, 1]);
        assert_eq!(a.authenticate("x", other), Err(Fault::Malformed));
    }

    #[test]
    fn memory_of_known_tokens_is_bounded() {
        let issuer = Issuer::generate().expect("random");
        let a = authority(&issuer, Revocations::none());
        for i in 0..MAX_KNOWN + 10 {
            let token = issuer.issue(&claims(|c| c.jti = i.to_string()));
            assert!(a.authenticate(&token.expect("short"), PEER).is_ok());
        }
        assert!(a.known.lock().expect("not poisoned").len() <= MAX_KNOWN);
    }
}
