//! Claims of a token (RFC 7519) and the calls that they cover.

use super::Fault;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Time by which the clock of an issuer may be ahead of ours (s). The end has no such grace: it is when streams end.
const SKEW_S: u64 = 10;
/// `methods` entry that stands for all.
const EVERY: &str = "*";

/// Claims of a token; times in Unix seconds. Unknown members are ignored, known ones given twice are refused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Claims {
    /// Services that take it: `capture`, `tracking`, `cloth`, `compositor`.
    #[serde(deserialize_with = "one_or_more")]
    pub aud: Vec<String>,
    /// End of its life.
    pub exp: u64,
    /// Begin of its life.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nbf: Option<u64>,
    /// Identity, for revocation.
    pub jti: String,
    /// Its one store.
    pub store: String,
    /// Its one camera; without it, every camera of the store.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Its one session or try-on; without it, every one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
    /// Names of rpcs, such as `StreamFrames`, or `*`.
    pub methods: Vec<String>,
}

/// A call as far as claims are about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Call<'a> {
    /// Service that is called: `compositor`.
    pub(super) service: &'a str,
    /// Store that the service belongs to.
    pub(super) store: &'a str,
    /// Name of the rpc.
    pub(super) method: &'a str,
}

impl Claims {
    /// Reads the payload of a token.
    pub(super) fn read(payload: &[u8]) -> Result<Self, Fault> {
        let claims: Self = serde_json::from_slice(payload).map_err(|_| Fault::Claims)?;
        // Without an identity it could never be revoked.
        if claims.jti.is_empty() {
            return Err(Fault::Claims);
        }
        Ok(claims)
    }

    /// Refuses a token before and after its life; `now` in Unix seconds.
    pub(super) fn check_life(&self, now: u64) -> Result<(), Fault> {
        if now >= self.exp {
            return Err(Fault::Expired);
        }
        match self.nbf {
            Some(begin) if begin > now.saturating_add(SKEW_S) => Err(Fault::NotYet),
            _ => Ok(()),
        }
    }

    /// The claim that does not cover a call, if there is one. Camera and session are in the message: handlers check
    /// them ([`super::Grant`]).
    pub(super) fn refusal(&self, call: &Call<'_>) -> Option<&'static str> {
        let has = |list: &[String], name: &str| list.iter().any(|l| l == name);
        if !has(&self.aud, call.service) {
            return Some("aud");
        }
        if self.store != call.store {
            return Some("store");
        }
        let is_method = has(&self.methods, EVERY) || has(&self.methods, call.method);
        (!is_method).then_some("methods")
    }
}

/// `aud` is one name or a list of them (RFC 7519, 4.1.3).
fn one_or_more<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Audience {
        One(String),
        List(Vec<String>),
    }
    match Audience::deserialize(from)? {
        Audience::One(name) => Ok(vec![name]),
        Audience::List(names) if names.is_empty() => Err(D::Error::custom("no audience")),
        Audience::List(names) => Ok(names),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"{"aud":["cloth","compositor"],"exp":2000,"nbf":1000,"jti":"j","store":"s","methods":["*"]}"#;

    fn read(text: &str) -> Result<Claims, Fault> {
        Claims::read(text.as_bytes())
    }

    #[test]
    fn life_has_a_begin_with_skew_and_an_end_without() {
        let claims = read(GOOD).expect("claims");
        for (now, expected) in [
            (989, Err(Fault::NotYet)),
            (990, Ok(())),
            (1999, Ok(())),
            (2000, Err(Fault::Expired)),
        ] {
            assert_eq!(claims.check_life(now), expected, "{now}");
        }
    }

    #[test]
    fn claims_that_are_missing_doubled_or_of_another_type_are_refused() {
        for (from, to) in [
            (r#""exp":2000,"#, ""),
            (r#""jti":"j","#, ""),
            (r#""jti":"j""#, r#""jti":"""#),
            (r#""store":"s","#, ""),
            (r#","methods":["*"]"#, ""),
            (r#""methods":["*"]"#, r#""methods":"*""#),
            (r#"["cloth","compositor"]"#, "[]"),
            ("2000", "-1"),
            ("2000", "1e400"),
            ("2000", "\"2000\""),
            (r#""store":"s""#, r#""store":"s","store":"other""#),
            (r#""exp":2000"#, r#""exp":2000,"exp":9000"#),
            (r#""store":"s""#, r#""store":["s"]"#),
            (r#""store":"s""#, r#""store":"s","session":7"#),
        ] {
            let text = GOOD.replace(from, to);
            assert_eq!(read(&text), Err(Fault::Claims), "{text}");
        }
        for text in ["", "null", "[]", "{}", "\u{0}"] {
            assert_eq!(read(text), Err(Fault::Claims), "{text}");
        }
    }

    #[test]
    fn audience_store_and_method_must_cover_the_call() {
        let mut claims = read(GOOD).expect("claims");
        let call = |service, store, method| Call {
            service,
            store,
            method,
        };
        assert_eq!(claims.refusal(&call("cloth", "s", "Dress")), None);
        assert_eq!(claims.refusal(&call("capture", "s", "Dress")), Some("aud"));
        assert_eq!(claims.refusal(&call("cloth", "t", "Dress")), Some("store"));
        claims.methods = vec!["StreamFrames".into()];
        assert_eq!(
            claims.refusal(&call("cloth", "s", "Dress")),
            Some("methods")
        );
        assert_eq!(claims.refusal(&call("cloth", "s", "StreamFrames")), None);
        let one = read(&GOOD.replace(r#"["cloth","compositor"]"#, r#""cloth""#));
        assert_eq!(one.expect("one name").aud, ["cloth"]);
    }
}
