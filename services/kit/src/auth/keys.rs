//! Ed25519 keys in files: PKCS#8 and SPKI as PEM, which `openssl` and every JWT library read.

use ed25519_dalek::pkcs8::spki::der::pem::LineEnding;
use ed25519_dalek::pkcs8::{DecodePrivateKey, DecodePublicKey, EncodePrivateKey, EncodePublicKey};
use ed25519_dalek::{SigningKey, VerifyingKey};
use std::path::Path;

/// A key file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum KeyFault {
    /// It cannot be read.
    #[error(transparent)]
    File(#[from] std::io::Error),
    /// It holds no key of the expected kind.
    #[error("no {0} in PEM")]
    Pem(&'static str),
    /// The system gives no random bytes.
    #[error("no random bytes: {0}")]
    Random(String),
}

/// `N` random bytes of the system's generator.
pub(super) fn random<const N: usize>() -> Result<[u8; N], KeyFault> {
    let mut bytes = [0; N];
    getrandom::fill(&mut bytes).map_err(|e| KeyFault::Random(e.to_string()))?;
    Ok(bytes)
}

/// A new private key.
pub(super) fn generate() -> Result<SigningKey, KeyFault> {
    Ok(SigningKey::from_bytes(&random()?))
}

/// Public key of a file.
pub(super) fn read_public(file: &Path) -> Result<VerifyingKey, KeyFault> {
    let text = std::fs::read_to_string(file)?;
    VerifyingKey::from_public_key_pem(&text).map_err(|_| KeyFault::Pem("public key of Ed25519"))
}

/// Private key of a file.
pub(super) fn read_private(file: &Path) -> Result<SigningKey, KeyFault> {
    let text = zeroize::Zeroizing::new(std::fs::read_to_string(file)?);
    SigningKey::from_pkcs8_pem(&text).map_err(|_| KeyFault::Pem("private key of Ed25519"))
}

/// Both keys as PEM: private, public.
pub(super) fn to_pem(key: &SigningKey) -> Result<(zeroize::Zeroizing<String>, String), KeyFault> {
    let fault = |_| KeyFault::Pem("key");
    let private = key.to_pkcs8_pem(LineEnding::LF).map_err(fault)?;
    let public = key.verifying_key().to_public_key_pem(LineEnding::LF);
    Ok((private, public.map_err(|_| KeyFault::Pem("key"))?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_survive_their_files_and_are_not_mistaken_for_each_other() {
        let dir = tempfile::tempdir().expect("a folder");
        let key = generate().expect("random");
        let (private, public) = to_pem(&key).expect("PEM");
        let files = [dir.path().join("key.pem"), dir.path().join("pub.pem")];
        std::fs::write(&files[0], private.as_bytes()).expect("written");
        std::fs::write(&files[1], public).expect("written");
        assert_eq!(
            read_private(&files[0]).expect("private").to_bytes(),
            key.to_bytes()
        );
        assert_eq!(read_public(&files[1]).expect("public"), key.verifying_key());
        assert!(matches!(read_public(&files[0]), Err(KeyFault::Pem(_))));
        assert!(matches!(read_private(&files[1]), Err(KeyFault::Pem(_))));
        assert!(matches!(read_public(dir.path()), Err(KeyFault::File(_))));
    }
}
