//! Identity of a store's services to each other: an authority of the store's own, and a certificate that each process makes
//! itself of it, in memory. `[identity]`.
//!
//! The authority's file admits its readers to the store. A certificate's common name is that of its service, by which the
//! router of the bus tells who may publish.

use crate::auth::{create_secret, random_jti, replace_secret};
use crate::config::Config;
use crate::server::StartError;
use pem::{EncodeConfig, LineEnding, Pem};
use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose, date_time_ymd,
};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use std::fmt::Display;
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use time::OffsetDateTime;
use x509_parser::parse_x509_certificate;
use x509_parser::prelude::X509Certificate;
use zeroize::Zeroizing;

const DAY: Duration = Duration::from_secs(24 * 3600);
/// Life of an authority. Another is put in its place when the last tenth begins.
const AUTHORITY_LIFE: Duration = DAY.saturating_mul(3650);
/// Life of a certificate. Connections of gRPC show one of at most [`RENEWED_AFTER`]; the bus and the router keep the one
/// that they began with until they start again.
const LIFE: Duration = DAY.saturating_mul(400);
/// Age from which a process makes itself another certificate.
pub(crate) const RENEWED_AFTER: Duration = DAY.saturating_mul(10);
/// Certificates end no earlier than if they were made then (2026): the clock of a box may not be set yet.
const EARLIEST: Duration = DAY.saturating_mul(20454);
/// Common name of authorities.
const AUTHORITY: &str = "tryon store";

/// A certificate with its key, and the authorities that it trusts, all PEM.
pub struct Leaf {
    /// Authorities.
    pub authorities: String,
    /// Certificate.
    pub certificate: String,
    /// Its key.
    pub key: Zeroizing<String>,
}

/// The key of a store and its certificates: its own, then those of keys before it.
pub struct Authority {
    issuer: Issuer<'static, KeyPair>,
    certificates: Vec<CertificateDer<'static>>,
}

impl Authority {
    /// A new one.
    ///
    /// # Errors
    /// When the system gives no random bytes.
    pub fn generate() -> Result<Self, String> {
        Self::lasting(AUTHORITY_LIFE)
    }

    fn lasting(life: Duration) -> Result<Self, String> {
        let key = KeyPair::generate().map_err(text)?;
        let mut params = CertificateParams::default();
        params
            .distinguished_name
            .push(DnType::CommonName, AUTHORITY);
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        (params.not_before, params.not_after) = (date_time_ymd(1970, 1, 1), end(life));
        let own = params.self_signed(&key).map_err(text)?;
        Ok(Self {
            certificates: vec![own.der().clone()],
            issuer: Issuer::new(params, key),
        })
    }

    /// That of a file, made where there is none; another takes over where it ends soon and the file can be written.
    ///
    /// # Errors
    /// When the file cannot be read or made, or holds no authority.
    pub fn open(file: &Path) -> Result<Self, String> {
        let read = match std::fs::read_to_string(file) {
            Ok(pem) => Self::read(&Zeroizing::new(pem))?,
            Err(e) if e.kind() == ErrorKind::NotFound => return Self::create(file),
            Err(e) => return Err(e.to_string()),
        };
        if !read.ends_soon()? {
            return Ok(read);
        }
        let mut next = Self::generate()?;
        next.certificates.extend(read.certificates.iter().cloned());
        match replace_secret(file, &next.content()) {
            Ok(()) => Ok(next),
            Err(why) => {
                tracing::warn!(file = %file.display(), %why, "the store's authority ends soon and cannot be renewed here");
                Ok(read)
            }
        }
    }

    /// Writes a new one where there is still none: of processes that start at once the first one's stays.
    fn create(file: &Path) -> Result<Self, String> {
        let new = Self::generate()?;
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder).map_err(text)?;
        }
        let draft = file.with_extension(random_jti().map_err(text)?);
        create_secret(&draft, &new.content()).map_err(text)?;
        let linked = std::fs::hard_link(&draft, file);
        let removed = std::fs::remove_file(&draft);
        match linked {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => Self::open(file),
            linked => linked.and(removed).map(|()| new).map_err(text),
        }
    }

    /// Content of its file.
    fn content(&self) -> Zeroizing<String> {
        Zeroizing::new(self.issuer.key().serialize_pem() + &self.authorities())
    }

    fn read(pem: &str) -> Result<Self, String> {
        let key = KeyPair::from_pem(pem).map_err(|_| "it does not begin with a private key")?;
        let certificates = CertificateDer::pem_slice_iter(pem.as_bytes());
        let certificates: Vec<_> = certificates.collect::<Result<_, _>>().map_err(text)?;
        let own = certificates.first().ok_or("no certificate in it")?;
        if parsed(own)?.public_key().subject_public_key.data != key.public_key_raw() {
            return Err("its first certificate is not that of its key".into());
        }
        Ok(Self {
            issuer: Issuer::from_ca_cert_der(own, key).map_err(text)?,
            certificates,
        })
    }

    /// Moment in which it ends.
    ///
    /// # Errors
    /// When it has no certificate of X.509.
    pub fn end(&self) -> Result<OffsetDateTime, String> {
        let own = self.certificates.first().ok_or("no certificate in it")?;
        Ok(parsed(own)?.validity().not_after.to_datetime())
    }

    /// It ends within a tenth of its life.
    fn ends_soon(&self) -> Result<bool, String> {
        Ok(self.end()? < end(AUTHORITY_LIFE / 10))
    }

    /// Its certificates, PEM.
    fn authorities(&self) -> String {
        let of_der = |der: &CertificateDer<'_>| Pem::new("CERTIFICATE", der.as_ref());
        let all: Vec<Pem> = self.certificates.iter().map(of_der).collect();
        pem::encode_many_config(&all, EncodeConfig::new().set_line_ending(LineEnding::LF))
    }

    /// A certificate of service `name` for these names and addresses.
    ///
    /// # Errors
    /// Names the one that is neither.
    pub fn issue(&self, name: &str, names: &[String]) -> Result<Leaf, String> {
        let key = KeyPair::generate().map_err(text)?;
        let mut params = CertificateParams::default();
        for name in names {
            let one =
                CertificateParams::new(vec![name.clone()]).map_err(|e| format!("{name}: {e}"))?;
            params.subject_alt_names.extend(one.subject_alt_names);
        }
        params.distinguished_name.push(DnType::CommonName, name);
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![
            ExtendedKeyUsagePurpose::ServerAuth,
            ExtendedKeyUsagePurpose::ClientAuth,
        ];
        params.use_authority_key_identifier_extension = true;
        (params.not_before, params.not_after) = (date_time_ymd(1970, 1, 1), end(LIFE));
        let certificate = params.signed_by(&key, &self.issuer).map_err(text)?;
        Ok(Leaf {
            authorities: self.authorities(),
            certificate: certificate.pem(),
            key: Zeroizing::new(key.serialize_pem()),
        })
    }
}

fn text(e: impl Display) -> String {
    e.to_string()
}

fn parsed<'a>(der: &'a CertificateDer<'_>) -> Result<X509Certificate<'a>, String> {
    parse_x509_certificate(der).map(|(_, c)| c).map_err(text)
}

/// Time since 1970.
fn now() -> Duration {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.unwrap_or_default().max(EARLIEST)
}

/// Moment after a life that begins now.
fn end(life: Duration) -> OffsetDateTime {
    date_time_ymd(1970, 1, 1) + now() + life
}

#[derive(Clone)]
enum Source {
    File(PathBuf),
    Memory(Arc<Authority>),
}

/// Identity of a process.
#[derive(Clone)]
pub struct Identity {
    source: Source,
    name: String,
    names: Vec<String>,
}

impl Identity {
    /// Identity of the process `name`; `None` where services have none. A process that `is_alone`, so holds all services, needs
    /// no file of an authority.
    ///
    /// # Errors
    /// When the system gives no random bytes.
    pub fn of(config: &Config, name: &str, is_alone: bool) -> Result<Option<Self>, StartError> {
        let own = &config.identity;
        let source = match own.authority() {
            Some(file) => Source::File(file.to_owned()),
            None if own.off || !is_alone => return Ok(None),
            None => Source::Memory(Arc::new(Authority::generate().map_err(fault(None))?)),
        };
        Ok(Some(Self {
            source,
            name: name.into(),
            names: names(config, name),
        }))
    }

    /// A new certificate.
    ///
    /// # Errors
    /// Names the key of the configuration at fault.
    pub(crate) fn leaf(&self) -> Result<Leaf, StartError> {
        let issue = |authority: &Authority| authority.issue(&self.name, &self.names);
        match &self.source {
            Source::Memory(authority) => issue(authority).map_err(fault(None)),
            Source::File(file) => {
                (Authority::open(file).and_then(|a| issue(&a))).map_err(fault(Some(file)))
            }
        }
    }

    /// Files that it depends on.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        match &self.source {
            Source::File(file) => vec![file.clone()],
            Source::Memory(_) => Vec::new(),
        }
    }
}

/// Fault of the file of the authority, or of one in memory.
fn fault(file: Option<&Path>) -> impl Fn(String) -> StartError {
    let file = file.map_or(String::new(), |f| format!("{}: ", f.display()));
    move |why| StartError::Config {
        key: "identity.authority".into(),
        why: format!("{file}{why}"),
    }
}

/// Checks the URL of another service under `key`.
///
/// # Errors
/// When services have an identity, so speak TLS only, and the URL is plain.
pub fn check_url(config: &Config, key: &str, url: &str) -> Result<(), StartError> {
    if config.identity.authority().is_some() && !url.starts_with("https://") {
        return Err(StartError::Config {
            key: key.into(),
            why: format!(
                "{url}: https is needed, services with an identity.authority speak TLS only"
            ),
        });
    }
    Ok(())
}

/// Names and addresses under which others call the process `name`.
fn names(config: &Config, name: &str) -> Vec<String> {
    let addresses: [(&str, SocketAddr); 4] = [
        ("capture", config.capture.address),
        ("tracking", config.tracking.address),
        ("cloth", config.cloth.address),
        ("compositor", config.compositor.address),
    ];
    let is_own = |service: &str| service == name || addresses.iter().all(|(s, _)| *s != name);
    let mut names: Vec<String> = vec![name.into(), "localhost".into()];
    names.extend(["127.0.0.1", "::1"].map(Into::into));
    names.extend(config.identity.names.iter().cloned());
    let own = addresses.iter().filter(|(s, _)| is_own(s));
    let own = own
        .map(|(_, a)| a.ip())
        .filter(|ip: &IpAddr| !ip.is_unspecified());
    names.extend(own.map(|ip| ip.to_string()));
    names.sort_unstable();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn config(authority: &Path) -> Config {
        let mut config = Config::default();
        config.identity.authority = authority.to_owned();
        config
    }

    #[test]
    fn processes_that_start_at_once_have_one_authority() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("new/authority.pem");
        let open = || Authority::open(&file).expect("made").authorities();
        let all: BTreeSet<String> = std::thread::scope(|threads| {
            let opened: Vec<_> = (0..8).map(|_| threads.spawn(open)).collect();
            (opened.into_iter())
                .map(|t| t.join().expect("ended"))
                .collect()
        });
        assert_eq!(all.len(), 1);
        let left: Vec<_> = std::fs::read_dir(dir.path().join("new"))
            .expect("a folder")
            .collect();
        assert_eq!(left.len(), 1, "drafts are taken away: {left:?}");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = file.metadata().expect("there").permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
    }

    #[test]
    fn an_authority_that_ends_soon_hands_over_and_stays_trusted() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("authority.pem");
        let old = Authority::lasting(AUTHORITY_LIFE / 11).expect("made");
        std::fs::write(&file, &*old.content()).expect("written");
        let next = Authority::open(&file).expect("renewed");
        assert!(next.end().expect("parsed") > old.end().expect("parsed"));
        assert!(next.authorities().ends_with(&old.authorities()));
        let again = Authority::open(&file).expect("read");
        assert_eq!(again.authorities(), next.authorities());
    }

    #[test]
    fn faults_name_key_and_file() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("authority.pem");
        let [one, other] = [(); 2].map(|()| Authority::generate().expect("random"));
        let mixed = one.issuer.key().serialize_pem() + &other.authorities();
        for (content, why) in [
            (String::new(), "does not begin with a private key"),
            (one.issuer.key().serialize_pem(), "no certificate"),
            (mixed, "not that of its key"),
        ] {
            std::fs::write(&file, content).expect("written");
            let identity = Identity::of(&config(&file), "capture", false).expect("given");
            let fault = identity.expect("given").leaf().err().expect("unusable");
            let fault = fault.to_string();
            assert!(fault.starts_with("identity.authority: "), "{fault}");
            assert!(
                fault.contains("authority.pem") && fault.contains(why),
                "{fault}"
            );
        }
    }

    #[test]
    fn only_a_process_of_all_services_needs_no_file() {
        let mut none = Config::default();
        let of = |c: &Config, is_alone| Identity::of(c, "box", is_alone).expect("random").is_some();
        assert!(of(&none, true) && !of(&none, false));
        none.identity.off = true;
        assert!(!of(&none, true));
        let mut given = config(Path::new("a.pem"));
        let url = |c: &Config, url| check_url(c, "cloth.tracking", url).map_err(|e| e.to_string());
        let plain = url(&given, "http://tracking:7452").expect_err("plain");
        assert!(
            plain.starts_with("cloth.tracking: http://tracking:7452"),
            "{plain}"
        );
        assert!(url(&given, "https://tracking:7452").is_ok());
        given.identity.off = true;
        assert!(!of(&given, false) && url(&given, "http://tracking:7452").is_ok());
    }

    #[test]
    fn certificates_are_for_the_service_and_its_own_addresses() {
        let mut config = Config::default();
        config.identity.names = vec!["mirror.example".into()];
        config.tracking.address = ([10, 0, 0, 7], 7452).into();
        config.cloth.address = ([0, 0, 0, 0], 7453).into();
        assert!(names(&config, "tracking").contains(&"10.0.0.7".to_owned()));
        assert!(!names(&config, "capture").contains(&"10.0.0.7".to_owned()));
        let all = ["127.0.0.1", "::1", "cloth", "localhost", "mirror.example"];
        assert_eq!(names(&config, "cloth"), all);
        let authority = Authority::generate().expect("random");
        let bad = authority.issue("cloth", &["a\u{e9}".into()]);
        assert!(bad.err().expect("not ASCII").starts_with("a\u{e9}: "));
    }
}
