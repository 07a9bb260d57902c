//! Maker of tokens: holder of a private key.

use super::claims::Claims;
use super::credentials::Credentials;
use super::keys::{self, KeyFault};
use super::{Fault, jws, unix_s};
use ed25519_dalek::{SigningKey, VerifyingKey};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Life of tokens whose key dies with the process (s): longer than any process.
const PROCESS_LIFE_S: u64 = 10 * 365 * 24 * 3600;

/// Private key that tokens are signed with. It is wiped when dropped.
pub struct Issuer(SigningKey);

impl Issuer {
    /// With a new key.
    ///
    /// # Errors
    /// When the system has no random bytes.
    pub fn generate() -> Result<Self, KeyFault> {
        keys::generate().map(Self)
    }

    /// With the key of a file (PKCS#8 PEM).
    ///
    /// # Errors
    /// When it cannot be read or holds another kind of key.
    pub fn read(file: &Path) -> Result<Self, KeyFault> {
        keys::read_private(file).map(Self)
    }

    /// Writes `issuer.pem` (private, for its owner's eyes) and `issuer.pub.pem` into a folder; the two files.
    ///
    /// # Errors
    /// When a file exists or cannot be written.
    pub fn write(&self, folder: &Path) -> Result<[PathBuf; 2], KeyFault> {
        let (private, public) = keys::to_pem(&self.0)?;
        std::fs::create_dir_all(folder)?;
        let files = ["issuer.pem", "issuer.pub.pem"].map(|name| folder.join(name));
        create_secret(&files[0], &private)?;
        let mut file = std::fs::File::create_new(&files[1])?;
        file.write_all(public.as_bytes())?;
        Ok(files)
    }

    /// Key for those who check tokens.
    pub(super) fn public(&self) -> VerifyingKey {
        self.0.verifying_key()
    }

    /// A token with these claims.
    ///
    /// # Errors
    /// [`Fault::TooLong`] when no service would take it.
    pub fn issue(&self, claims: &Claims) -> Result<String, Fault> {
        let payload = serde_json::to_vec(claims).map_err(|_| Fault::Claims)?;
        let token = jws::sign(&payload, &self.0);
        if token.len() > jws::MAX_BYTES {
            return Err(Fault::TooLong);
        }
        Ok(token)
    }

    /// Claims of a token of this issuer, past or present.
    ///
    /// # Errors
    /// A token of another issuer or without the claims of one.
    pub fn claims(&self, token: &str) -> Result<Claims, Fault> {
        if token.len() > jws::MAX_BYTES {
            return Err(Fault::TooLong);
        }
        Claims::read(&jws::verify(token, &[self.public()])?)
    }

    /// A token for some services of a store, as long as the process lives; for keys that die with it.
    ///
    /// # Errors
    /// When the system has no random bytes.
    pub fn issue_for_process(&self, store: &str, services: &[&str]) -> Result<String, KeyFault> {
        let claims = Self::claims_of_process(store, services)?;
        self.issue(&claims).map_err(|_| KeyFault::Pem("store"))
    }

    /// A token for the program that feeds a camera, as [`Self::issue_for_process`].
    ///
    /// # Errors
    /// When the system has no random bytes.
    pub fn issue_for_feeder(&self, store: &str, camera: &str) -> Result<String, KeyFault> {
        let claims = Claims {
            camera: Some(camera.into()),
            methods: vec!["PublishFrames".into()],
            ..Self::claims_of_process(store, &["capture"])?
        };
        self.issue(&claims).map_err(|_| KeyFault::Pem("store"))
    }

    fn claims_of_process(store: &str, services: &[&str]) -> Result<Claims, KeyFault> {
        Ok(Claims {
            aud: services.iter().map(|s| (*s).into()).collect(),
            exp: unix_s() + PROCESS_LIFE_S,
            nbf: None,
            jti: random_jti()?,
            store: store.into(),
            camera: None,
            session: None,
            methods: vec!["*".into()],
        })
    }

    /// Credentials of the services of a box, which share this issuer's process.
    pub(super) fn credentials(&self, store: &str) -> Result<Credentials, KeyFault> {
        let services = ["capture", "tracking", "cloth", "compositor"];
        Ok(Credentials::fixed(
            &self.issue_for_process(store, &services)?,
        ))
    }
}

/// A new identity for a token: 128 bits, hexadecimal.
///
/// # Errors
/// When the system has no random bytes.
pub fn random_jti() -> Result<String, KeyFault> {
    Ok(format!("{:032x}", u128::from_be_bytes(keys::random()?)))
}

/// Writes a file that only its owner may read, and that does not exist yet.
///
/// # Errors
/// When it exists or cannot be written.
pub fn create_secret(file: &Path, text: &str) -> std::io::Result<()> {
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(file)?.write_all(text.as_bytes())
}

/// Writes a file that only its owner may read in place of another, at once.
///
/// # Errors
/// Errors of the file system.
pub fn replace_secret(file: &Path, text: &str) -> std::io::Result<()> {
    let new = file.with_extension("new");
    match std::fs::remove_file(&new) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(e),
        _ => {}
    }
    create_secret(&new, text)?;
    std::fs::rename(new, file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_written_once_and_for_its_owner() {
        let dir = tempfile::tempdir().expect("a folder");
        let issuer = Issuer::generate().expect("random");
        let [private, public] = issuer.write(dir.path()).expect("written");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = |f: &Path| std::fs::metadata(f).expect("there").permissions().mode();
            assert_eq!(mode(&private) & 0o077, 0);
        }
        assert!(issuer.write(dir.path()).is_err(), "never over another key");
        let again = Issuer::read(&private).expect("read");
        assert_eq!(again.public(), keys::read_public(&public).expect("read"));
        assert!(Issuer::read(&public).is_err());
    }
}
