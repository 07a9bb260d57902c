//! Configuration of the whole box: flag > `TRYON_*` > TOML file > default; unknown keys are refused.

mod sections;

pub use sections::*;

use figment::Figment;
use figment::providers::{Env, Format, Serialized, Toml};
use figment::value::Value;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// All configuration. `deploy/tryon.toml` shows each key with its default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Logs.
    pub log: LogConfig,
    /// Traces.
    pub telemetry: TelemetryConfig,
    /// Threads and shutdown.
    pub process: ProcessConfig,
    /// Frames between processes.
    pub bus: BusConfig,
    /// Tokens.
    pub auth: AuthConfig,
    /// Encryption of connections.
    pub tls: TlsConfig,
    /// Identity of services to each other.
    pub identity: IdentityConfig,
    /// The capture service.
    pub capture: CaptureConfig,
    /// The tracking service.
    pub tracking: TrackingConfig,
    /// The cloth service.
    pub cloth: ClothConfig,
    /// The compositor.
    pub compositor: CompositorConfig,
}

/// Unusable configuration: the key and the fault.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ConfigError(pub String);

/// Environment variables with the prefix that are no keys: test switches, the path of the file, and the log filter of
/// the command line (services have `TRYON_LOG__LEVEL`); the token of a client.
const NOT_KEYS: [&str; 7] = [
    "SHARED",
    "REQUIRE_ALL",
    "FUZZ_SECONDS",
    "SESSIONS",
    "CONFIG",
    "LOG",
    "TOKEN",
];

/// Beginning of the sources that are cameras of ROS 2.
pub const ROS2: &str = "ros2:";

/// Fault of a name.
const NAME: &str = "1 to 64 characters of [a-z0-9_-] are needed";

impl Config {
    /// Reads all layers. `flags` are `key=value` pairs such as `capture.address=127.0.0.1:0`.
    ///
    /// # Errors
    /// Names the key that is unknown, of the wrong type or not usable, or the file that cannot be read.
    pub fn load(file: Option<&Path>, flags: &[String]) -> Result<Self, ConfigError> {
        let mut layers = Figment::from(Serialized::defaults(Self::default()));
        if let Some(file) = file {
            let text = std::fs::read_to_string(file)
                .map_err(|e| ConfigError(format!("{}: {e}", file.display())))?;
            layers = layers.merge(Toml::string(&text));
        }
        layers = layers.merge(Env::prefixed("TRYON_").ignore(&NOT_KEYS).split("__"));
        for flag in flags {
            let fault = || {
                ConfigError(format!(
                    "--set {flag}: `key=value` is needed, such as compositor.address=127.0.0.1:0"
                ))
            };
            let (key, value) = flag.split_once('=').ok_or_else(fault)?;
            let Ok(value) = value.parse::<Value>();
            layers = layers.merge(Serialized::default(key, value));
        }
        let config: Self = layers.extract().map_err(|e| ConfigError(e.to_string()))?;
        config.validate()?;
        Ok(config)
    }

    /// Checks ranges, names and URLs.
    ///
    /// # Errors
    /// Names the first key at fault.
    pub fn validate(&self) -> Result<(), ConfigError> {
        use tryon_proto::keys::is_name;
        let fault = |key: &str, why: &str| Err(ConfigError(format!("{key}: {why}")));
        if let Err(why) = self.log.check_level() {
            return fault("log.level", &why);
        }
        if !is_name(&self.capture.store) {
            return fault("capture.store", NAME);
        }
        self.validate_cameras()?;
        for (key, ms) in [
            (
                "compositor.camera_silence_ms",
                self.compositor.camera_silence_ms,
            ),
            (
                "compositor.garments_late_ms",
                self.compositor.garments_late_ms,
            ),
        ] {
            if ms < 50 {
                return fault(key, "at least 50 ms, or every hiccup is a fault");
            }
        }
        self.validate_connections()?;
        let public = &self.compositor.public;
        if !(public.is_empty() || public.starts_with("http://") || public.starts_with("https://")) {
            let why = "an origin such as https://mirror.example is needed";
            return fault("compositor.public", why);
        }
        if let Some((key, why)) = self.telemetry.fault() {
            return fault(key, why);
        }
        let is_open = !(self.has_tls() && self.has_tokens());
        if let Some(key) = self.exposed().filter(|_| is_open && !self.process.insecure) {
            let why = "is reached from beyond this machine, which needs both TLS and tokens ([auth] keys); \
                       process.insecure = true (or --insecure) allows it without";
            return fault(key, why);
        }
        if !self.auth.store.is_empty() && !is_name(&self.auth.store) {
            return fault("auth.store", NAME);
        }
        if !self.has_tokens() && !self.auth.revoked.as_os_str().is_empty() {
            return fault("auth.revoked", "revokes nothing without auth.keys");
        }
        for (key, n) in [
            ("tracking.max_sessions", self.tracking.max_sessions),
            ("cloth.max_sessions", self.cloth.max_sessions),
            ("compositor.max_try_ons", self.compositor.max_try_ons),
            ("compositor.max_viewers", self.compositor.max_viewers),
            ("compositor.max_formats", self.compositor.max_formats),
        ] {
            if n == 0 {
                return fault(key, "at least 1");
            }
        }
        Ok(())
    }

    fn validate_cameras(&self) -> Result<(), ConfigError> {
        let fault = |key: &str, why: &str| Err(ConfigError(format!("{key}: {why}")));
        for (i, c) in self.capture.cameras.iter().enumerate() {
            if !tryon_proto::keys::is_name(&c.name) {
                return fault(&format!("capture.cameras.{i}.name"), NAME);
            }
            if self.capture.cameras[..i].iter().any(|o| o.name == c.name) {
                return fault(&format!("capture.cameras.{i}.name"), "is used twice");
            }
            if !(c.rate.is_finite() && (0.0..=1000.0).contains(&c.rate)) {
                return fault(
                    &format!("capture.cameras.{i}.rate"),
                    "0 to 1000 frames a second",
                );
            }
        }
        let has_ros2 = (self.capture.cameras.iter()).any(|c| c.source.starts_with(ROS2));
        match self.capture.ros2.fault() {
            Some((key, why)) if has_ros2 => fault(key, why),
            _ => Ok(()),
        }
    }

    fn validate_connections(&self) -> Result<(), ConfigError> {
        let fault = |key: &str, why: &str| Err(ConfigError(format!("{key}: {why}")));
        for (key, url) in [
            ("cloth.tracking", &self.cloth.tracking),
            ("compositor.tracking", &self.compositor.tracking),
            ("compositor.cloth", &self.compositor.cloth),
            ("compositor.capture", &self.compositor.capture),
        ] {
            let is_http = url.starts_with("http://") || url.starts_with("https://");
            if !is_http || url.parse::<http::Uri>().is_err() {
                return fault(key, "a URL such as http://127.0.0.1:7452 is needed");
            }
            let is_trusting = self.tls.is_client() || self.identity.authority().is_some();
            if url.starts_with("https://") && !is_trusting {
                let why =
                    "https needs identity.authority, or tls.ca, the authority of that service";
                return fault(key, why);
            }
        }
        if self.tls.is_server() == self.tls.key.as_os_str().is_empty() {
            return fault("tls.key", "certificate and key are given together");
        }
        Ok(())
    }

    /// Store of this box, to which tokens are bound.
    pub fn store(&self) -> &str {
        if self.auth.store.is_empty() {
            &self.capture.store
        } else {
            &self.auth.store
        }
    }

    /// The services ask for tokens.
    fn has_tokens(&self) -> bool {
        !self.auth.keys.is_empty()
    }

    /// The services are reached through TLS only.
    fn has_tls(&self) -> bool {
        self.tls.is_server()
    }

    /// Key of the first address that other machines reach.
    fn exposed(&self) -> Option<&'static str> {
        let addresses = [
            ("capture.address", self.capture.address),
            ("capture.admin", self.capture.admin),
            ("tracking.address", self.tracking.address),
            ("tracking.admin", self.tracking.admin),
            ("cloth.address", self.cloth.address),
            ("cloth.admin", self.cloth.admin),
            ("compositor.address", self.compositor.address),
            ("compositor.admin", self.compositor.admin),
        ];
        let exposed = addresses.iter().find(|(_, a)| !a.ip().is_loopback());
        let has_certificates =
            self.identity.authority().is_some() || !self.bus.config.as_os_str().is_empty();
        let is_guarded = |e: &String| e.starts_with("tls/") && has_certificates;
        let is_open = |e: &String| !is_local_endpoint(e) && !is_guarded(e);
        let is_bus = || self.bus.listen.iter().any(is_open);
        exposed
            .map(|(key, _)| *key)
            .or_else(|| is_bus().then_some("bus.listen"))
    }
}

/// A zenoh endpoint of this machine: a socket of the file system, or a loopback address.
fn is_local_endpoint(endpoint: &str) -> bool {
    let (protocol, address) = endpoint.split_once('/').unwrap_or(("", endpoint));
    let is_loopback = |a: std::net::SocketAddr| a.ip().is_loopback();
    protocol == "unixsock-stream"
        || address.starts_with("localhost:")
        || address.parse().is_ok_and(is_loopback)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_bound_beyond_loopback_without_being_told() {
        let load = |set: &[&str]| {
            let flags: Vec<String> = set.iter().map(|s| (*s).into()).collect();
            Config::load(None, &flags).map_err(|e| e.to_string())
        };
        for (key, value) in [
            ("compositor.address", "0.0.0.0:8080"),
            ("tracking.admin", "\"[::]:9102\""),
            ("bus.listen", "[\"tcp/10.0.0.1:7447\"]"),
        ] {
            let set = format!("{key}={value}");
            let fault = load(&[&set]).expect_err("exposed");
            assert!(fault.starts_with(key), "{fault}");
            assert!(load(&[&set, "process.insecure=true"]).is_ok(), "{key}");
        }
        let guarded = [
            "bus.config=\"bus.json5\"",
            "bus.listen=[\"tls/0.0.0.0:7447\"]",
        ];
        assert!(load(&guarded).is_ok() && load(&guarded[1..]).is_err());
        let local = [
            "unixsock-stream//run/bus",
            "tcp/[::1]:7447",
            "tcp/localhost:7447",
        ];
        assert!(local.into_iter().all(is_local_endpoint));
    }

    #[test]
    fn the_network_of_ros_is_checked_where_a_camera_is_on_it() {
        let camera = "capture.cameras=[{source=\"ros2:/depth\"}]";
        let load = |set: &[&str]| {
            let flags = set.iter().map(|s| (*s).into());
            Config::load(None, &flags.collect::<Vec<String>>()).map_err(|e| e.to_string())
        };
        assert!(load(&[camera]).is_ok());
        for (key, value) in [
            ("connect", "[]"),
            ("connect", "[\"127.0.0.1:7447\"]"),
            ("domain", "233"),
            ("namespace", "\"a/**\""),
        ] {
            let set = format!("capture.ros2.{key}={value}");
            let fault = load(&[camera, &set]).expect_err(value);
            assert!(fault.starts_with(&format!("capture.ros2.{key}")), "{fault}");
            assert!(load(&[&set]).is_ok(), "no camera is on it");
        }
    }

    #[test]
    fn the_commented_default_file_is_the_default() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy/tryon.toml");
        let text = std::fs::read_to_string(file).expect("deploy/tryon.toml");
        assert_eq!(
            toml::from_str::<Config>(&text).expect("parses"),
            Config::default()
        );
        // Every key is shown: taking the comments off must not add one, and no default may be missing.
        let shown: toml::Table = toml::from_str(&text).expect("parses");
        let all = toml::Table::try_from(Config::default()).expect("serialises");
        assert_eq!(
            shown, all,
            "a key of Config::default() is missing from deploy/tryon.toml"
        );
    }

    #[test]
    fn cameras_are_mounted_by_quarter_turns() {
        let load = |set: &str| {
            let cameras = format!("capture.cameras=[{{{set}}}]");
            Config::load(None, &[cameras]).map_err(|e| e.to_string())
        };
        let mounted = load("turned=270,mirrored=true").expect("a quarter");
        let mounting = mounted.capture.cameras[0].mounting();
        assert_eq!((mounting.turned.degrees(), mounting.mirrored), (270, true));
        assert!(Config::default().capture.cameras[0].mounting().is_upright());
        let e = load("turned=45").expect_err("no quarter");
        assert!(e.contains("45 degrees") && e.contains("turned"), "{e}");
    }

    #[test]
    fn flags_win_and_unknown_keys_are_refused() {
        let dir = tempfile::tempdir().expect("a folder");
        let file = dir.path().join("c.toml");
        std::fs::write(
            &file,
            "[tracking]\nmax_sessions = 3\naddress = \"127.0.0.1:1\"\n",
        )
        .expect("written");
        let c = Config::load(Some(&file), &["tracking.address=127.0.0.1:7".into()]).expect("fine");
        assert_eq!((c.tracking.max_sessions, c.tracking.address.port()), (3, 7));
        std::fs::write(&file, "[tracking]\nmax_session = 3\n").expect("written");
        let e = Config::load(Some(&file), &[])
            .expect_err("a typo")
            .to_string();
        assert!(e.contains("max_session"), "{e}");
        let e = Config::load(None, &["tracking.adress=1".into()])
            .expect_err("a typo")
            .to_string();
        assert!(e.contains("adress"), "{e}");
        let e = Config::load(None, &["capture.store=a/b".into()])
            .expect_err("a slash")
            .to_string();
        assert!(e.starts_with("capture.store"), "{e}");
    }

    #[test]
    fn log_filters_are_levels_and_modules_with_levels() {
        let check = |level: &str| Config::load(None, &[format!("log.level=\"{level}\"")]);
        for good in [
            "info",
            "OFF",
            "warn,tryon_cloth_service::engine=trace,a-b=off",
        ] {
            assert!(check(good).is_ok(), "{good}");
        }
        for bad in [
            "loud",
            "",
            "info,",
            "info, a=off",
            "zenoh",
            "a=loud",
            "=info",
        ] {
            let e = check(bad).expect_err(bad).to_string();
            let part = bad.rsplit(',').next().unwrap_or_default();
            assert!(e.starts_with(&format!("log.level: `{part}` is ")), "{e}");
        }
    }
}
