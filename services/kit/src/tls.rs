//! TLS of both ends of a call, with files that are read again when they change: a new certificate is served from the next
//! connection on.

use crate::config::TlsConfig;
use rustls::client::WebPkiServerVerifier;
use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::server::WebPkiClientVerifier;
use rustls::{ClientConfig, RootCertStore, ServerConfig};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};
use tokio::net::TcpStream;
use tokio_rustls::{TlsAcceptor, TlsConnector};

/// Interval of looks at the files.
const LOOK_EVERY: Duration = Duration::from_secs(1);
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
    server: Option<Arc<Reloaded<ServerConfig>>>,
    client: Arc<Reloaded<ClientConfig>>,
}

impl Tls {
    /// Reads the files.
    ///
    /// # Errors
    /// Names the key of a file that cannot be read or used.
    pub fn open(config: &TlsConfig) -> Result<Self, TlsError> {
        let is_server = config.is_server();
        let server = is_server.then(|| Reloaded::open(config.clone(), server_config));
        Ok(Self {
            server: server.transpose()?.map(Arc::new),
            client: Arc::new(Reloaded::open(config.clone(), client_config)?),
        })
    }

    /// Acceptor of new connections; `None` without a certificate.
    pub(crate) fn acceptor(&self) -> Option<TlsAcceptor> {
        Some(TlsAcceptor::from(self.server.as_ref()?.current()))
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
        let host = host.trim_start_matches('[').trim_end_matches(']').to_owned();
        let name = ServerName::try_from(host).map_err(io::Error::other)?;
        let connector = TlsConnector::from(self.client.current());
        connector.connect(name, stream).await
    }
}

/// Value made of files, made anew when one of them changes.
#[derive(Debug)]
struct Reloaded<T> {
    files: TlsConfig,
    make: fn(&TlsConfig) -> Result<T, TlsError>,
    state: Mutex<State<T>>,
}

#[derive(Debug)]
struct State<T> {
    value: Arc<T>,
    looked: Instant,
    changed: Vec<Option<SystemTime>>,
}

impl<T> Reloaded<T> {
    fn open(files: TlsConfig, make: fn(&TlsConfig) -> Result<T, TlsError>) -> Result<Self, TlsError> {
        let state = State {
            changed: changed(&files),
            value: Arc::new(make(&files)?),
            looked: Instant::now(),
        };
        Ok(Self {
            files,
            make,
            state: Mutex::new(state),
        })
    }

    /// The value of the files as they are now; of faulty files the last good one.
    fn current(&self) -> Arc<T> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.looked.elapsed() < LOOK_EVERY {
            return state.value.clone();
        }
        state.looked = Instant::now();
        let changed = changed(&self.files);
        if changed != state.changed {
            // Files are replaced one by one: a pair that does not fit is looked at again.
            match (self.make)(&self.files) {
                Ok(value) => {
                    tracing::info!("the certificates were read again");
                    (state.value, state.changed) = (Arc::new(value), changed);
                }
                Err(e) => tracing::warn!(error = %e, "the last certificates stay in use"),
            }
        }
        state.value.clone()
    }
}

fn changed(files: &TlsConfig) -> Vec<Option<SystemTime>> {
    let paths = [&files.certificate, &files.key, &files.client_ca, &files.ca];
    let time = |p: &&PathBuf| std::fs::metadata(p).and_then(|m| m.modified()).ok();
    paths.iter().map(time).collect()
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
type Identity = (Vec<CertificateDer<'static>>, PrivateKeyDer<'static>);

fn identity(files: &TlsConfig) -> Result<Identity, TlsError> {
    let key = PrivateKeyDer::from_pem_file(&files.key);
    let key = key.map_err(|e| fault("key", &files.key)(&e))?;
    Ok((certificates("certificate", &files.certificate)?, key))
}

fn server_config(files: &TlsConfig) -> Result<ServerConfig, TlsError> {
    let wrong = fault("certificate", &files.certificate);
    let builder = ServerConfig::builder_with_provider(provider());
    let builder = (builder.with_safe_default_protocol_versions()).map_err(|e| wrong(&e))?;
    let builder = if files.client_ca.as_os_str().is_empty() {
        builder.with_no_client_auth()
    } else {
        let roots = roots("client_ca", &files.client_ca)?;
        let verifier = WebPkiClientVerifier::builder_with_provider(roots, provider()).build();
        let verifier = verifier.map_err(|e| fault("client_ca", &files.client_ca)(&e))?;
        builder.with_client_cert_verifier(verifier)
    };
    let (chain, key) = identity(files)?;
    let mut config = builder.with_single_cert(chain, key).map_err(|e| wrong(&e))?;
    config.alpn_protocols = PROTOCOLS.map(<[u8]>::to_vec).to_vec();
    Ok(config)
}

fn client_config(files: &TlsConfig) -> Result<ClientConfig, TlsError> {
    let wrong = fault("ca", &files.ca);
    let builder = ClientConfig::builder_with_provider(provider());
    let builder = (builder.with_safe_default_protocol_versions()).map_err(|e| wrong(&e))?;
    let trusted = if files.ca.as_os_str().is_empty() {
        Arc::new(RootCertStore::empty())
    } else {
        roots("ca", &files.ca)?
    };
    let builder = if trusted.is_empty() {
        // Nobody is trusted: every connection fails, and says so.
        builder.with_root_certificates(trusted)
    } else {
        let verifier = WebPkiServerVerifier::builder_with_provider(trusted, provider()).build();
        builder.with_webpki_verifier(verifier.map_err(|e| wrong(&e))?)
    };
    let mut config = if files.is_server() {
        let (chain, key) = identity(files)?;
        let own = builder.with_client_auth_cert(chain, key);
        own.map_err(|e| fault("certificate", &files.certificate)(&e))?
    } else {
        builder.with_no_client_auth()
    };
    config.alpn_protocols = vec![PROTOCOLS[0].to_vec()];
    Ok(config)
}
