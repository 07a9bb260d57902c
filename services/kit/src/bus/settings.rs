//! Settings of zenoh's sessions.

use crate::config::BusConfig;
use crate::frames::BusError;
use crate::identity::Identity;
use crate::server::StartError;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::path::Path;
use std::time::Duration;
use zeroize::Zeroizing;

/// Time that a stalled peer may block the others [µs]; then its connection is closed and reopened. zenoh's default of
/// 5 s freezes every screen.
const WAIT_BEFORE_CLOSE_US: u32 = 300_000;
/// Silence after which a connection counts as dead (ms).
const LEASE_MS: u32 = 2_000;
/// First and longest pause between attempts to connect (ms): a restarted peer is found within a second.
const RETRY_MS: (u32, u32) = (100, 500);
/// Largest message of another network, bytes: an uncompressed colour image of 4096 × 4096 has 48 MiB.
const MAX_FOREIGN: usize = 64 << 20;

/// Ends of the bus that a process is: `tcp/ADDRESS:PORT`, `tls/HOST:PORT` or `unixsock-stream/PATH`.
#[derive(Clone, Copy)]
pub struct Ends<'a> {
    /// Endpoints to listen on.
    pub listen: &'a [String],
    /// Endpoints to connect to.
    pub connect: &'a [String],
    /// Certificate of `tls/` endpoints.
    pub identity: Option<&'a Identity>,
    /// Further settings, a file of zenoh (JSON5); an empty path for none.
    pub file: &'a Path,
}

impl<'a> Ends<'a> {
    /// A camera's end.
    pub fn listening(bus: &'a BusConfig, identity: Option<&'a Identity>) -> Self {
        Self {
            listen: &bus.listen,
            connect: &[],
            identity,
            file: &bus.config,
        }
    }

    /// The end of who takes frames.
    pub fn connecting(bus: &'a BusConfig, identity: Option<&'a Identity>) -> Self {
        Self {
            listen: &[],
            connect: &bus.connect,
            identity,
            file: &bus.config,
        }
    }

    /// Configuration without mode and endpoints.
    pub(super) fn base(&self) -> Result<zenoh::Config, BusError> {
        let mut c = of_file(self.file)?;
        let mut endpoints = self.listen.iter().chain(self.connect);
        let Some(identity) = self
            .identity
            .filter(|_| endpoints.any(|e| e.starts_with("tls/")))
        else {
            return Ok(c);
        };
        let leaf = identity.leaf().map_err(|e| BusError(e.to_string()))?;
        let base64 = |pem: &str| format!("\"{}\"", STANDARD.encode(pem));
        let (certificate, key) = (base64(&leaf.certificate), Zeroizing::new(base64(&leaf.key)));
        for (setting, value) in [
            ("enable_mtls", "true"),
            ("root_ca_certificate_base64", &base64(&leaf.authorities)),
            ("listen_certificate_base64", &certificate),
            ("listen_private_key_base64", &key),
            ("connect_certificate_base64", &certificate),
            ("connect_private_key_base64", &key),
        ] {
            let setting = format!("transport/link/tls/{setting}");
            c.insert_json5(&setting, value)
                .map_err(|e| BusError(format!("{setting}: {e}")))?;
        }
        Ok(c)
    }
}

/// Configuration of a file of zenoh; the default for an empty path.
fn of_file(file: &Path) -> Result<zenoh::Config, BusError> {
    if file.as_os_str().is_empty() {
        return Ok(zenoh::Config::default());
    }
    zenoh::Config::from_file(file).map_err(|e| BusError(format!("{}: {e}", file.display())))
}

/// Sets keys of a configuration to JSON5.
fn set(
    c: &mut zenoh::Config,
    settings: impl IntoIterator<Item = (&'static str, String)>,
) -> Result<(), BusError> {
    settings.into_iter().try_for_each(|(key, value)| {
        c.insert_json5(key, &value)
            .map_err(|e| BusError(format!("{key} = {value}: {e}")))
    })
}

/// Configuration of a client of another network of zenoh than the bus, such as that of ROS 2 cameras. Opening it fails
/// where nobody answers within `patience`; once open, it connects again and again.
///
/// # Errors
/// Names a malformed endpoint.
pub fn client_elsewhere(endpoint: &str, patience: Duration) -> Result<zenoh::Config, BusError> {
    let endpoint = [endpoint.to_owned()];
    let mut c = settings(zenoh::Config::default(), "client", &[], &endpoint)?;
    set(
        &mut c,
        [
            ("connect/timeout_ms", patience.as_millis().to_string()),
            ("connect/exit_on_failure", "true".into()),
            (
                "transport/link/rx/max_message_size",
                MAX_FOREIGN.to_string(),
            ),
        ],
    )?;
    Ok(c)
}

/// Configuration of one session of zenoh.
pub(super) fn settings(
    mut c: zenoh::Config,
    mode: &str,
    listen: &[String],
    connect: &[String],
) -> Result<zenoh::Config, BusError> {
    let list = |l: &[String]| format!("{l:?}");
    let (init, max) = RETRY_MS;
    let retry =
        format!("{{period_init_ms: {init}, period_max_ms: {max}, period_increase_factor: 2}}");
    let settings = [
        ("mode", format!("\"{mode}\"")),
        ("listen/endpoints", list(listen)),
        ("connect/endpoints", list(connect)),
        ("connect/timeout_ms", "-1".into()),
        ("connect/exit_on_failure", "false".into()),
        ("connect/retry", retry),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
        ("transport/link/tx/lease", LEASE_MS.to_string()),
        (
            "transport/link/tx/queue/congestion_control/block/wait_before_close",
            WAIT_BEFORE_CLOSE_US.to_string(),
        ),
    ];
    set(&mut c, settings)?;
    Ok(c)
}

/// Checks the file and the endpoints of `[bus]`.
///
/// # Errors
/// Names the key with the file that cannot be read, the fault in it, or the malformed endpoint.
pub fn check(config: &BusConfig) -> Result<(), StartError> {
    let (file, none) = (&config.config, &[][..]);
    let parts = [
        ("bus.config", none, none),
        ("bus.listen", &config.listen[..], none),
        ("bus.connect", none, &config.connect[..]),
    ];
    parts.into_iter().try_for_each(|(key, listen, connect)| {
        let fault = |BusError(why)| StartError::Config {
            key: key.into(),
            why,
        };
        (of_file(file).and_then(|c| settings(c, "peer", listen, connect)))
            .map(drop)
            .map_err(fault)
    })
}
