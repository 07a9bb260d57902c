//! Sections of the configuration with their defaults.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Mounting, PictureTurn};
use tryon_geometry::settings;

const fn local(port: u16) -> SocketAddr {
    SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}

/// Format of logs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// For people.
    #[default]
    Pretty,
    /// One JSON object a line.
    Json,
}

settings! {
    owned:
    /// Logs.
    pub struct LogConfig {
        /// pretty or json.
        pub format: LogFormat = LogFormat::Pretty,
        /// Filter: a level, `module=level` pairs, or both, between commas.
        pub level: String = "info,zenoh=error".into(),
    }
}

impl LogConfig {
    /// Checks `level`. tracing itself takes an unknown level for the name of a module, and cuts names after a space short.
    ///
    /// # Errors
    /// Names the part that is neither a level nor `module=level`.
    pub fn check_level(&self) -> Result<(), String> {
        const LEVELS: [&str; 6] = ["off", "error", "warn", "info", "debug", "trace"];
        let is_level = |l: &str| LEVELS.iter().any(|known| known.eq_ignore_ascii_case(l));
        let is_path = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | ':');
        let is_module = |m: &str| !m.is_empty() && m.chars().all(is_path);
        for part in self.level.split(',') {
            let (module, level) = part.split_once('=').unwrap_or(("all", part));
            if !(is_module(module) && is_level(level)) {
                let levels = LEVELS.join(", ");
                return Err(format!(
                    "`{part}` is neither a level ({levels}) nor module=level, such as tryon_tracking=debug"
                ));
            }
        }
        Ok(())
    }
}

settings! {
    owned:
    /// Traces.
    pub struct TelemetryConfig {
        /// OTLP/gRPC endpoint of a collector, such as `http://127.0.0.1:4317`; empty: no traces.
        pub otlp: String = String::new(),
        /// Exposures of each camera that are traced a second.
        pub traces_per_second: f64 = 1.0,
    }
}

impl TelemetryConfig {
    /// First key at fault, and the fault.
    pub(super) fn fault(&self) -> Option<(&'static str, &'static str)> {
        if !(self.otlp.is_empty() || self.otlp.starts_with("http://")) {
            let why = "a URL such as http://127.0.0.1:4317 is needed, or nothing";
            return Some(("telemetry.otlp", why));
        }
        let is_rate = (0.0..=1000.0).contains(&self.traces_per_second);
        (!is_rate).then_some(("telemetry.traces_per_second", "0 to 1000"))
    }
}

settings! {
    owned:
    /// Threads and shutdown.
    pub struct ProcessConfig {
        /// Threads for computing; 0 means one for each core.
        pub compute_threads: usize = 0,
        /// Time that open streams have to finish after a signal (ms); then they are cut.
        pub grace_ms: u64 = 3000,
        /// Lets addresses beyond loopback be bound, where anybody who reaches them sees the person.
        pub insecure: bool = false,
    }

    /// Frames between processes.
    pub struct BusConfig {
        /// File of zenoh (JSON5) with certificates and access control, as `deploy/zenoh/secure/service.json5`; empty for none.
        pub config: PathBuf = PathBuf::new(),
        /// Endpoints on which the capture process listens: `tcp/ADDRESS:PORT`, `tls/HOST:PORT` or `unixsock-stream/PATH`.
        pub listen: Vec<String> = vec!["tcp/127.0.0.1:7447".to_owned()],
        /// Endpoints to which the other processes connect.
        pub connect: Vec<String> = vec!["tcp/127.0.0.1:7447".to_owned()],
    }
}

/// Tokens: who may call the services (docs/decisions/062).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AuthConfig {
    /// Files of public keys (PEM, Ed25519) whose tokens are taken; none means that no tokens are asked for.
    pub keys: Vec<PathBuf>,
    /// File of revoked tokens, a `jti` a line, read again within a second; empty for none.
    pub revoked: PathBuf,
    /// File of the token that the services present to each other, read again when it changes; empty for none.
    pub token: PathBuf,
    /// Store whose tokens are taken; empty means `capture.store`.
    pub store: String,
    /// Folder of enrolment codes that the compositor trades for tokens; empty means that it trades none.
    pub enrolments: PathBuf,
}

/// The store's own authority, whose certificates its services show each other.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IdentityConfig {
    /// The authority (PEM: its key and certificates), made at the first start; whoever reads this file is of the store.
    /// Empty: `tryon up` draws one at each start, and processes of their own speak to each other as `[tls]` says.
    pub authority: PathBuf,
    /// Names and addresses under which others call this process, beside the name of its service, its address, `localhost`
    /// and loopback.
    pub names: Vec<String>,
    /// Services speak to each other as `[tls]` says, plainly without: for a developer's bench.
    pub off: bool,
}

impl IdentityConfig {
    /// File of the authority, where services have one in common.
    pub fn authority(&self) -> Option<&Path> {
        let is_given = !self.off && !self.authority.as_os_str().is_empty();
        is_given.then_some(&self.authority)
    }
}

/// TLS of the mirror's port, and of all ports without an `[identity]`; the files are read again when they change.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TlsConfig {
    /// Certificate chain of this process (PEM), valid for the names and addresses under which it is called; empty serves
    /// plain connections. As a client it shows the same.
    pub certificate: PathBuf,
    /// Its key (PEM).
    pub key: PathBuf,
    /// Authorities of clients (PEM): only those with a certificate of theirs are served. Empty serves all.
    pub client_ca: PathBuf,
    /// Authorities of the services that this process calls by `https` (PEM).
    pub ca: PathBuf,
}

impl TlsConfig {
    /// Ports of this process speak TLS.
    pub fn is_server(&self) -> bool {
        !self.certificate.as_os_str().is_empty()
    }

    /// This process can call others by TLS.
    pub(crate) fn is_client(&self) -> bool {
        !self.ca.as_os_str().is_empty()
    }

    /// Files that are given.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let all = [&self.certificate, &self.key, &self.client_ca, &self.ca];
        let given = all.into_iter().filter(|p| !p.as_os_str().is_empty());
        given.cloned().collect()
    }
}

settings! {
    owned:
    /// The capture service.
    pub struct CaptureConfig {
        /// gRPC address.
        pub address: SocketAddr = local(7451),
        /// Metrics and probes; port 0 in tests.
        pub admin: SocketAddr = local(9101),
        /// Store part of the bus keys.
        pub store: String = "store".into(),
        /// Folder for recordings; empty means that nothing can be recorded.
        pub recordings: PathBuf = PathBuf::new(),
        /// The cameras.
        pub cameras: Vec<CameraConfig> = vec![CameraConfig::default()],
        /// Network of the cameras whose source is `ros2:…`.
        pub ros2: Ros2Config = Ros2Config::default(),
    }

    /// Zenoh network of ROS 2 cameras: `rmw_zenoh`, or `zenoh-bridge-ros2dds`. It is none of the bus.
    pub struct Ros2Config {
        /// Endpoints of its router or bridge, of which the first that answers is taken.
        pub connect: Vec<String> = vec!["tcp/127.0.0.1:7447".to_owned()],
        /// ROS_DOMAIN_ID of the cameras, which keys of `rmw_zenoh` begin with.
        pub domain: u32 = 0,
        /// Namespace that the bridge puts before all topics, such as `robot1`; empty for none.
        pub namespace: String = String::new(),
    }

    /// One camera.
    pub struct CameraConfig {
        /// Camera part of the bus keys.
        pub name: String = "front".into(),
        /// `studio`, `studio-720`, `studio-1080`, `synth`, `synth:CLIP`, `pattern` (a test picture), `push` (a program feeds it), `ros2:DEPTH_TOPIC,COLOR_TOPIC` (the
        /// second may be left out), a device as `freenect:SERIAL`, `openni:SERIAL` or `v4l2:SERIAL`, or the path of a recording.
        pub source: String = "studio".into(),
        /// `camera.json` of a device or recording that has no calibration of its own; empty for its own.
        pub camera: PathBuf = PathBuf::new(),
        /// Frames a second; 0 means the source's own rate.
        pub rate: f64 = 0.0,
        /// Ignore all rates and go as fast as possible.
        pub fast: bool = false,
        /// Start again at the end of a recording.
        #[serde(rename = "loop")]
        pub looped: bool = true,
        /// Start publishing with the process.
        pub autostart: bool = true,
        /// Clockwise turn that sets its picture upright, degrees: 0, 90, 180 or 270.
        pub turned: PictureTurn = PictureTurn::None,
        /// It delivers mirrored pictures; they are unmirrored before they are turned.
        pub mirrored: bool = false,
    }

    /// The tracking service.
    pub struct TrackingConfig {
        /// gRPC address.
        pub address: SocketAddr = local(7452),
        /// Metrics and probes.
        pub admin: SocketAddr = local(9102),
        /// SMPL-layout npz to use as template; empty means the embedded body.
        pub body: PathBuf = PathBuf::new(),
        /// Model of `tools/landmarks/convert`, by which people are tracked in colour as well; empty means by depth alone.
        pub color_model: PathBuf = PathBuf::new(),
        /// Most sessions at a time.
        pub max_sessions: usize = 4,
        /// Seconds after which a session that nobody reads is closed.
        pub idle_s: u64 = 30,
    }

    /// The cloth service.
    pub struct ClothConfig {
        /// gRPC address.
        pub address: SocketAddr = local(7453),
        /// Metrics and probes.
        pub admin: SocketAddr = local(9103),
        /// The tracking service to follow.
        pub tracking: String = "http://127.0.0.1:7452".into(),
        /// Most sessions at a time.
        pub max_sessions: usize = 4,
        /// Seconds after which a session that nobody streams is closed.
        pub idle_s: u64 = 30,
        /// Gives up detail of cloth while exposures go without garments.
        pub adapts_detail: bool = true,
        /// Most simulations at a time.
        pub max_simulations: usize = 1,
        /// Folder of mesh garments (`.obj`, `.glb`, `.gltf`, `.mhclo`) and captures (folders that `tryon clothcap capture`
        /// wrote), with one level of folders in it; empty for none. Meshes are offered under their files' names beside the
        /// library, garments of a capture as `FOLDER_top`, `FOLDER_under`, `FOLDER_bottom` … A fault is logged, and its file or
        /// capture left out.
        pub garments: PathBuf = PathBuf::new(),
        /// Body that the mesh garments of the folder were made on (`.obj` or SMPL-layout `.npz`): they come in sizes then.
        /// Empty: a guess for each, and one size made to measure. A capture has its own.
        pub garments_body: PathBuf = PathBuf::new(),
        /// Material of the garments of the folder: `cotton` or another preset.
        pub garments_material: String = "cotton".into(),
        /// Other materials for garments of the folder, by the name they are offered under.
        pub garment_materials: BTreeMap<String, String> = BTreeMap::new(),
    }

    /// The compositor.
    pub struct CompositorConfig {
        /// gRPC, gRPC-web and page address.
        pub address: SocketAddr = local(8080),
        /// Metrics and probes.
        pub admin: SocketAddr = local(9104),
        /// The tracking service.
        pub tracking: String = "http://127.0.0.1:7452".into(),
        /// The cloth service.
        pub cloth: String = "http://127.0.0.1:7453".into(),
        /// The capture service, which asks for consent.
        pub capture: String = "http://127.0.0.1:7451".into(),
        /// Camera of a try-on that names none.
        pub store: String = "store".into(),
        /// Camera of a try-on that names none.
        pub camera: String = "front".into(),
        /// Most try-ons at a time.
        pub max_try_ons: usize = 4,
        /// Refuses try-ons beside others that this machine has no processors for.
        pub by_capacity: bool = true,
        /// Most viewers of a try-on.
        pub max_viewers: usize = 64,
        /// Most sizes and qualities of a try-on's pictures; viewers of one share its pictures.
        pub max_formats: usize = 8,
        /// Seconds after which a try-on that nobody streams is closed.
        pub idle_s: u64 = 30,
        /// Milliseconds without a frame after which the camera counts as silent.
        pub camera_silence_ms: u64 = 700,
        /// Milliseconds after which garments are too old to be shown.
        pub garments_late_ms: u64 = 700,
        /// Names of this port beside its IP addresses and localhost; requests to others are refused.
        pub hosts: Vec<String> = Vec::new(),
        /// Origins of foreign pages that may call it, such as `https://kiosk.example`.
        pub origins: Vec<String> = Vec::new(),
        /// Origin under which a shopper's phone reaches this port, such as `https://mirror.example`: the beginning of photo
        /// links. Empty: the host that the page was asked for by.
        pub public: String = String::new(),
        /// auto, cpu or gpu.
        pub renderer: RendererChoice = RendererChoice::Auto,
    }
}

impl CameraConfig {
    /// Difference of its pictures from upright ones.
    pub fn mounting(&self) -> Mounting {
        Mounting {
            turned: self.turned,
            mirrored: self.mirrored,
        }
    }

    /// The given calibration, if any.
    pub fn camera_file(&self) -> Option<&Path> {
        Some(self.camera.as_path()).filter(|p| !p.as_os_str().is_empty())
    }
}

impl Ros2Config {
    /// Highest ROS_DOMAIN_ID: DDS has no ports for others.
    const MAX_DOMAIN: u32 = 232;

    /// First key at fault, and the fault.
    pub(super) fn fault(&self) -> Option<(&'static str, &'static str)> {
        let is_endpoint = |e: &String| e.split_once('/').is_some_and(|(_, a)| !a.is_empty());
        let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '/');
        if self.connect.is_empty() || !self.connect.iter().all(is_endpoint) {
            let why = "endpoints such as tcp/127.0.0.1:7447 are needed";
            return Some(("capture.ros2.connect", why));
        }
        if self.domain > Self::MAX_DOMAIN {
            return Some(("capture.ros2.domain", "0 to 232"));
        }
        let why = "letters, digits, _ and / are needed, such as robot1";
        (!self.namespace.chars().all(is_name)).then_some(("capture.ros2.namespace", why))
    }
}

/// Renderer of the pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RendererChoice {
    /// A real graphics card if there is one, else the processor.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// Any adapter, software included; without one the start fails.
    Gpu,
}
