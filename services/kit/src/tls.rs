//! TLS of both ends of a call, with files that are read again when they change: a new certificate is served from the next
//! connection on.

use crate::config::{Config, TlsConfig};
use crate::followed::{follow_all, follow_and_renew};
use crate::identity::{Identity, Leaf, RENEWED_AFTER};
use crate::server::StartError;
use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::server::{VerifierBuilderError, WebPkiClientVerifier};
use rustls::{ClientConfig, RootCertStore, ServerConfig};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio_rustls::{TlsAcceptor, TlsConnector};

/// Protocols of a port, preferred first.
const PROTOCOLS: [&[u8]; 2] = [b"h2", b"http/1.1"];

/// A file of `[tls]` that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("tls.{key} = {}: {why}", path.display())]
pub struct TlsError {
    /// Key of the configuration.
    pub key: &'static str,
    /// Its value.
    pub path: PathBuf,
    /// Fault.
    pub why: String,
}

/// Certificates of a process. Clones share what was read.
#[derive(Clone, Debug)]
pub struct Tls {
    server: Option<watch::Receiver<Arc<ServerConfig>>>,
    client: Option<watch::Receiver<Arc<ClientConfig>>>,
}

impl Tls {
    /// No certificates: connections are plain, and `https` URLs are trusted to nobody.
    pub fn off() -> Self {
        Self {
            server: None,
            client: None,
        }
    }

    /// Reads the files, and follows them on a task of the runtime.
    ///
    /// # Errors
    /// Names the key of a file that cannot be read or used.
    pub fn open(config: &TlsConfig) -> Result<Self, TlsError> {
        fn follow<T: Send + Sync + 'static>(
            config: &TlsConfig,
            make: fn(&TlsConfig) -> Result<T, TlsError>,
        ) -> Result<watch::Receiver<Arc<T>>, TlsError> {
            let files = config.clone();
            follow_all(config.files(), move || make(&files).map(Arc::new))
        }
        let server = config.is_server().then(|| follow(config, server_config));
        let client = config.is_client().then(|| follow(config, client_config));
        Ok(Self {
            server: server.transpose()?,
            client: client.transpose()?,
        })
    }

    /// Certificates of the store: both ends of a connection show one. Made anew long before they end, and when the file of
    /// the authority changes, on a task of the runtime.
    ///
    /// # Errors
    /// When the authority cannot be used.
    pub fn of_store(identity: &Identity) -> Result<Self, StartError> {
        let server = follow_store(identity, |roots, own| {
            serving(Some(roots), own).map_err(|part| match part {
                Part::Clients(e) => text(e),
                Part::Own(e) => text(e),
            })
        })?;
        let client = follow_store(identity, |roots, own| {
            calling(roots, Some(own)).map_err(text)
        })?;
        Ok(Self {
            server: Some(server),
            client: Some(client),
        })
    }

    /// Encryption of calls to services, for a process without a port of its own for browsers: of the store's identity, or
    /// that of `[tls]`.
    ///
    /// # Errors
    /// Names the key of a file that cannot be used.
    pub fn inside(config: &Config, identity: Option<&Identity>) -> Result<Self, StartError> {
        match identity {
            Some(identity) => Self::of_store(identity),
            None => Ok(Self::open(&config.tls)?),
        }
    }

    /// Connections are encrypted.
    pub(crate) fn is_on(&self) -> bool {
        self.server.is_some()
    }

    /// Acceptor of new connections; `None` without a certificate.
    pub(crate) fn acceptor(&self) -> Option<TlsAcceptor> {
        let config = self.server.as_ref()?.borrow().clone();
        Some(TlsAcceptor::from(config))
    }

    /// Encrypts a connection to `host`, whose certificate must be for that name or address.
    ///
    /// # Errors
    /// A name that is none, a certificate that is not trusted, or a connection that broke.
    pub(crate) async fn connect(
        &self,
        host: &str,
        stream: TcpStream,
    ) -> io::Result<tokio_rustls::client::TlsStream<TcpStream>> {
        let host = host
            .trim_start_matches('[')
            .trim_end_matches(']')
            .to_owned();
        let name = ServerName::try_from(host).map_err(io::Error::other)?;
        let untrusting = || io::Error::other("tls.ca: no authority is trusted");
        let config = self
            .client
            .as_ref()
            .ok_or_else(untrusting)?
            .borrow()
            .clone();
        TlsConnector::from(config).connect(name, stream).await
    }
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

fn fault(key: &'static str, path: &Path) -> impl Fn(&dyn std::fmt::Display) -> TlsError {
    let path = path.to_owned();
    move |why| TlsError {
        key,
        path: path.clone(),
        why: why.to_string(),
    }
}

fn certificates(key: &'static str, path: &Path) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let fault = fault(key, path);
    let all = CertificateDer::pem_file_iter(path).map_err(|e| fault(&e))?;
    let all: Vec<_> = all.collect::<Result<_, _>>().map_err(|e| fault(&e))?;
    if all.is_empty() {
        return Err(fault(&"no certificate in it"));
    }
    Ok(all)
}

fn roots(key: &'static str, path: &Path) -> Result<Arc<RootCertStore>, TlsError> {
    let mut roots = RootCertStore::empty();
    for certificate in certificates(key, path)? {
        roots.add(certificate).map_err(|e| fault(key, path)(&e))?;
    }
    Ok(Arc::new(roots))
}

/// Own certificate and key, in that order.
type Own = (Vec<CertificateDer<'static>>, PrivateKeyDer<'static>);

fn own(files: &TlsConfig) -> Result<Own, TlsError> {
    let key = PrivateKeyDer::from_pem_file(&files.key);
    let key = key.map_err(|e| fault("key", &files.key)(&e))?;
    Ok((certificates("certificate", &files.certificate)?, key))
}

fn server_config(files: &TlsConfig) -> Result<ServerConfig, TlsError> {
    let clients = if files.client_ca.as_os_str().is_empty() {
        None
    } else {
        Some(roots("client_ca", &files.client_ca)?)
    };
    serving(clients, own(files)?).map_err(|fault_in| match fault_in {
        Part::Clients(e) => fault("client_ca", &files.client_ca)(&e),
        Part::Own(e) => fault("certificate", &files.certificate)(&e),
    })
}

/// Part of a configuration at fault.
enum Part {
    Clients(VerifierBuilderError),
    Own(rustls::Error),
}

/// Serves clients of the authorities only, where some are given.
fn serving(clients: Option<Arc<RootCertStore>>, own: Own) -> Result<ServerConfig, Part> {
    let builder = ServerConfig::builder_with_provider(provider());
    let builder = (builder.with_safe_default_protocol_versions()).map_err(Part::Own)?;
    let builder = match clients {
        None => builder.with_no_client_auth(),
        Some(roots) => {
            let verifier = WebPkiClientVerifier::builder_with_provider(roots, provider()).build();
            builder.with_client_cert_verifier(verifier.map_err(Part::Clients)?)
        }
    };
    let (chain, key) = own;
    let mut config = builder.with_single_cert(chain, key).map_err(Part::Own)?;
    config.alpn_protocols = PROTOCOLS.map(<[u8]>::to_vec).to_vec();
    Ok(config)
}

fn client_config(files: &TlsConfig) -> Result<ClientConfig, TlsError> {
    let roots = roots("ca", &files.ca)?;
    let own = files.is_server().then(|| own(files)).transpose()?;
    calling(roots, own).map_err(|e| fault("certificate", &files.certificate)(&e))
}

/// Calls services of the authorities, with a certificate of its own where there is one.
fn calling(roots: Arc<RootCertStore>, own: Option<Own>) -> Result<ClientConfig, rustls::Error> {
    let builder = ClientConfig::builder_with_provider(provider());
    let builder = builder.with_safe_default_protocol_versions()?;
    let builder = builder.with_root_certificates(roots);
    let mut config = match own {
        Some((chain, key)) => builder.with_client_auth_cert(chain, key)?,
        None => builder.with_no_client_auth(),
    };
    config.alpn_protocols = vec![PROTOCOLS[0].to_vec()];
    Ok(config)
}

/// Authorities and certificate of a leaf.
fn of_leaf(leaf: &Leaf) -> Result<(Arc<RootCertStore>, Own), String> {
    let all = |pem: &str| -> Result<Vec<CertificateDer<'static>>, _> {
        CertificateDer::pem_slice_iter(pem.as_bytes()).collect()
    };
    let mut roots = RootCertStore::empty();
    for authority in all(&leaf.authorities).map_err(text)? {
        roots.add(authority).map_err(text)?;
    }
    let key = PrivateKeyDer::from_pem_slice(leaf.key.as_bytes()).map_err(text)?;
    Ok((
        Arc::new(roots),
        (all(&leaf.certificate).map_err(text)?, key),
    ))
}

fn text(e: impl std::fmt::Display) -> String {
    e.to_string()
}

/// Makes one end of connections of a new certificate of the store, now and long before it ends.
fn follow_store<T: Send + Sync + 'static>(
    identity: &Identity,
    make: fn(Arc<RootCertStore>, Own) -> Result<T, String>,
) -> Result<watch::Receiver<Arc<T>>, StartError> {
    let own = identity.clone();
    follow_and_renew(identity.files(), RENEWED_AFTER, move || {
        let made = of_leaf(&own.leaf()?).and_then(|(roots, own)| make(roots, own));
        made.map(Arc::new).map_err(|why| StartError::Config {
            key: "identity.authority".into(),
            why,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::channel;
    use crate::connections::{self, Limits};
    use crate::transport::{self, Protocols};
    use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, IsCa, KeyPair};
    use std::time::Duration;
    use tokio::net::TcpListener;
    use tonic::Code;
    use tonic_health::pb::HealthCheckRequest;
    use tonic_health::pb::health_client::HealthClient;

    type Authority = CertifiedIssuer<'static, KeyPair>;

    fn authority() -> Authority {
        let mut params = CertificateParams::new(Vec::new()).expect("no names");
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        CertifiedIssuer::self_signed(params, KeyPair::generate().expect("a key")).expect("signed")
    }

    /// Writes a certificate for 127.0.0.1, its key, and the authority.
    fn issue(dir: &Path, by: &Authority) -> TlsConfig {
        let key = KeyPair::generate().expect("a key");
        let params = CertificateParams::new(vec!["127.0.0.1".to_owned()]).expect("an address");
        let certificate = params.signed_by(&key, by).expect("signed");
        let write = |name: &str, text: String| {
            let path = dir.join(name);
            std::fs::write(&path, text).expect("written");
            path
        };
        TlsConfig {
            certificate: write("certificate.pem", certificate.pem()),
            key: write("key.pem", key.serialize_pem()),
            client_ca: PathBuf::new(),
            ca: write("ca.pem", by.pem()),
        }
    }

    async fn serve(config: &TlsConfig) -> String {
        serve_with(Tls::open(config).expect("certificates")).await
    }

    async fn serve_with(tls: Tls) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let port = listener.local_addr().expect("bound").port();
        let (routes, _) = crate::server::routes("tryon.v1.CaptureService").expect("known");
        let protocols = Protocols {
            has_http1: true,
            tls,
        };
        tokio::spawn(async move {
            let incoming = connections::accept(listener, Limits::default());
            let router = routes.routes().prepare().into_axum_router();
            transport::serve(incoming, router, &protocols, std::future::pending()).await;
        });
        format!("https://127.0.0.1:{port}")
    }

    async fn call(url: &str, config: &TlsConfig) -> Result<(), Code> {
        call_with(url, &Tls::open(config).expect("certificates")).await
    }

    async fn call_with(url: &str, tls: &Tls) -> Result<(), Code> {
        let mut health = HealthClient::new(channel(url, tls).expect("a URL"));
        let asked = health.check(HealthCheckRequest::default()).await;
        asked.map(drop).map_err(|s| s.code())
    }

    #[tokio::test]
    async fn only_trusted_ends_talk_and_new_certificates_are_served() {
        let [server, client, other] = [0; 3].map(|_| tempfile::tempdir().expect("a folder"));
        let (ours, theirs) = (authority(), authority());
        let mut served = issue(server.path(), &ours);
        let known = issue(client.path(), &ours);
        let stranger = issue(other.path(), &theirs);
        let anonymous = TlsConfig {
            ca: known.ca.clone(),
            ..TlsConfig::default()
        };
        let url = serve(&served).await;
        assert_eq!(call(&url, &anonymous).await, Ok(()));
        assert_eq!(call(&url, &stranger).await, Err(Code::Unavailable));
        let plain = url.replace("https", "http");
        assert!(call(&plain, &anonymous).await.is_err());

        served.client_ca = known.ca.clone();
        let mutual = serve(&served).await;
        assert_eq!(call(&mutual, &known).await, Ok(()));
        assert!(call(&mutual, &anonymous).await.is_err());
        let intruder = TlsConfig {
            ca: known.ca.clone(),
            ..stranger.clone()
        };
        assert!(call(&mutual, &intruder).await.is_err());

        issue(server.path(), &theirs);
        let mut renewed = Err(Code::Unavailable);
        for _ in 0..100 {
            tokio::time::sleep(Duration::from_millis(50)).await;
            renewed = call(&url, &stranger).await;
            if renewed.is_ok() {
                break;
            }
        }
        assert_eq!(renewed, Ok(()));
        assert_eq!(call(&url, &anonymous).await, Err(Code::Unavailable));
    }

    #[tokio::test]
    async fn services_of_one_store_talk_and_a_new_authority_counts_at_once() {
        let dir = tempfile::tempdir().expect("a folder");
        let of = |file: &str, name: &str| {
            let mut config = Config::default();
            config.identity.authority = dir.path().join(file);
            let identity = Identity::of(&config, name, false).expect("random");
            Tls::of_store(&identity.expect("a file")).expect("certificates")
        };
        let (tracking, cloth) = (of("ours.pem", "tracking"), of("ours.pem", "cloth"));
        let url = serve_with(tracking).await;
        let call = async |tls: &Tls| call_with(&url, tls).await;
        assert_eq!(call(&cloth).await, Ok(()));
        let stranger = of("theirs.pem", "cloth");
        assert!(call(&stranger).await.is_err());
        assert!(call(&Tls::off()).await.is_err(), "no authority is trusted");

        std::fs::copy(dir.path().join("theirs.pem"), dir.path().join("ours.pem")).expect("copied");
        let mut renewed = Err(Code::Unavailable);
        for _ in 0..100 {
            tokio::time::sleep(Duration::from_millis(50)).await;
            renewed = call(&stranger).await;
            if renewed.is_ok() {
                break;
            }
        }
        assert_eq!(renewed, Ok(()));
    }

    #[tokio::test]
    async fn faults_name_their_key() {
        let dir = tempfile::tempdir().expect("a folder");
        let good = issue(dir.path(), &authority());
        let key_of = |config: &TlsConfig| Tls::open(config).expect_err("unusable").key;
        let missing = TlsConfig {
            key: dir.path().join("none"),
            ..good.clone()
        };
        assert_eq!(key_of(&missing), "key");
        let empty = TlsConfig {
            certificate: good.key.clone(),
            ..good.clone()
        };
        assert_eq!(key_of(&empty), "certificate");
        let unlike = TlsConfig {
            client_ca: good.key.clone(),
            ..good
        };
        assert_eq!(key_of(&unlike), "client_ca");
        assert!(Tls::off().acceptor().is_none());
    }
}
