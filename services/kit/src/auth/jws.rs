//! JWS compact serialisation (RFC 7515) with EdDSA over Ed25519 (RFC 8037), the only algorithm: nothing that a token
//! says about itself chooses how it is checked.

use super::Fault;
use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD as BASE64;
use ed25519_dalek::{Signature, Signer, SigningKey, VerifyingKey};
use serde::Deserialize;
use serde::de::IgnoredAny;

/// Longest token, bytes. One with every claim and ten methods takes 700.
pub(super) const MAX_BYTES: usize = 4096;
/// Header of every token that is made here: `{"alg":"EdDSA","typ":"JWT"}`.
const HEADER: &[u8] = br#"{"alg":"EdDSA","typ":"JWT"}"#;

/// Members of the JOSE header that decide; a member given twice is an error of serde.
#[derive(Deserialize)]
struct Header {
    alg: String,
    /// Extensions that must be understood (RFC 7515, 4.1.11): none is.
    crit: Option<IgnoredAny>,
}

/// Token over a payload.
pub(super) fn sign(payload: &[u8], key: &SigningKey) -> String {
    let mut token = BASE64.encode(HEADER);
    token.push('.');
    BASE64.encode_string(payload, &mut token);
    let signature = key.sign(token.as_bytes()).to_bytes();
    token.push('.');
    BASE64.encode_string(signature, &mut token);
    token
}

/// Payload of a token that one of the keys has signed.
///
/// # Errors
/// In this order: too long, malformed, another algorithm, a foreign signature.
pub(super) fn verify(token: &str, keys: &[VerifyingKey]) -> Result<Vec<u8>, Fault> {
    if token.len() > MAX_BYTES {
        return Err(Fault::TooLong);
    }
    let (signed, signature) = token.rsplit_once('.').ok_or(Fault::Malformed)?;
    let (header, payload) = signed.split_once('.').ok_or(Fault::Malformed)?;
    let decode = |part: &str| BASE64.decode(part).map_err(|_| Fault::Malformed);
    let header = decode(header)?;
    let header: Header = serde_json::from_slice(&header).map_err(|_| Fault::Malformed)?;
    if header.alg != "EdDSA" || header.crit.is_some() {
        return Err(Fault::Algorithm);
    }
    let payload = decode(payload)?;
    let signature = decode(signature)?;
    let signature = Signature::from_slice(&signature).map_err(|_| Fault::Signature)?;
    // Strict: keys and signatures of small order, which verify for many messages, are refused.
    let is_ours = |key: &VerifyingKey| key.verify_strict(signed.as_bytes(), &signature).is_ok();
    if keys.iter().any(is_ours) {
        Ok(payload)
    } else {
        Err(Fault::Signature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(seed: u8) -> SigningKey {
        SigningKey::from_bytes(&[seed; 32])
    }

    /// Token with this header over `{}`, signed by key 1.
    fn with_header(header: &str) -> String {
        let signed = format!("{}.{}", BASE64.encode(header), BASE64.encode("{}"));
        let signature = BASE64.encode(key(1).sign(signed.as_bytes()).to_bytes());
        format!("{signed}.{signature}")
    }

    fn fault(token: &str) -> Fault {
        verify(token, &[key(1).verifying_key()]).expect_err(token)
    }

    #[test]
    fn a_token_is_read_with_its_own_key_only() {
        let token = sign(b"{}", &key(1));
        let keys = [key(2).verifying_key(), key(1).verifying_key()];
        assert_eq!(verify(&token, &keys), Ok(b"{}".to_vec()));
        assert_eq!(verify(&token, &keys[..1]), Err(Fault::Signature));
        assert_eq!(verify(&token, &[]), Err(Fault::Signature));
    }

    #[test]
    fn example_of_rfc_8037_verifies() {
        let x = BASE64.decode("11qYAYKxCrfVS_7TyWQHOg7hcvPapiMlrwIaaPcHURo");
        let x: [u8; 32] = x.expect("base64").try_into().expect("32 bytes");
        let key = VerifyingKey::from_bytes(&x).expect("a point");
        let token = "eyJhbGciOiJFZERTQSJ9.RXhhbXBsZSBvZiBFZDI1NTE5IHNpZ25pbmc.\
                     hgyY0il_MGCjP0JzlnLWG1PPOt7-09PGcvMg3AIbQR6dWbhijcNR4ki4iylGjg5BhVsPt9g7sVvpAr_MuM0KAg";
        assert_eq!(
            verify(token, &[key]),
            Ok(b"Example of Ed25519 signing".to_vec())
        );
    }

    #[test]
    fn other_algorithms_are_refused_before_the_signature() {
        for alg in ["none", "None", "HS256", "RS256", "ES256", "eddsa", ""] {
            let token = with_header(&format!(r#"{{"alg":"{alg}"}}"#));
            assert_eq!(fault(&token), Fault::Algorithm, "{alg}");
            let bare = token.rsplit_once('.').expect("three parts").0;
            assert_eq!(fault(&format!("{bare}.")), Fault::Algorithm, "{alg}");
        }
        let critical = with_header(r#"{"alg":"EdDSA","crit":["b64"],"b64":false}"#);
        assert_eq!(fault(&critical), Fault::Algorithm);
    }

    #[test]
    fn malformed_tokens_are_refused() {
        let twice = with_header(r#"{"alg":"EdDSA","alg":"EdDSA"}"#);
        let good = sign(b"{}", &key(1));
        let bad = [
            "",
            ".",
            "..",
            "...",
            "a.b",
            "!.!.!",
            "e30.e30.",
            twice.as_str(),
            &good.replace('.', ","),
            &format!("{good}."),
            &format!(".{good}"),
        ];
        for token in bad {
            assert_eq!(fault(token), Fault::Malformed, "{token}");
        }
        assert_eq!(fault(&format!("{good}=")), Fault::Malformed);
        assert_eq!(fault(&good[..good.len() - 6]), Fault::Signature);
        assert_eq!(fault(&"a".repeat(MAX_BYTES + 1)), Fault::TooLong);
    }

    #[test]
    fn no_bit_of_a_token_may_change() {
        let good = sign(br#"{"store":"a"}"#, &key(1));
        for at in 0..good.len() {
            let mut bytes = good.clone().into_bytes();
            bytes[at] ^= 1;
            if let Ok(token) = String::from_utf8(bytes) {
                assert!(verify(&token, &[key(1).verifying_key()]).is_err(), "{at}");
            }
        }
    }
}
