//! All that a box shows, remembers and tells of the people before it: two sessions whose cameras paint their ids into colour
//! and depth, watched from outside the process.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, missing_docs, clippy::print_stdout)]

use serde_json::json;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tryon::formats::image::{decode_jpeg, write_png_depth, write_png_rgb};
use tryon::geometry::camera::{ColorImage, DepthImage};
use tryon_kit::auth::{Connection, Credentials};
use tryon_kit::bus::free_tcp_endpoint;
use tryon_kit::client::channel;
use tryon_kit::config::Config;
use tryon_kit::identity::Identity;
use tryon_kit::tls::Tls;
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::*;

/// Exposures of both cameras together; a debug build takes ten times as long for each.
const FRAMES: u64 = if cfg!(debug_assertions) {
    10_000
} else {
    100_000
};
const SIZE: (u32, u32) = (64, 48);
/// Bytes of an image that are searched in memory; images are so much longer that each has aligned ones.
const PIECE: usize = 64;
/// Difference of a JPEG's channel from the paint that is still its own.
const LOSS: f64 = 12.0;
/// Longest wait for anything, far beyond what is expected on a busy machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// A camera and session, and the paint in its frames.
struct Painted {
    name: &'static str,
    color: [u8; 3],
    /// Distance of its wall (mm): no other number of the program repeats like this one.
    depth: u16,
}

const SESSIONS: [Painted; 2] = [
    Painted {
        name: "left",
        color: [200, 40, 40],
        depth: 0x1b3d,
    },
    Painted {
        name: "right",
        color: [40, 60, 200],
        depth: 0x2a4f,
    },
];

impl Painted {
    /// An RGBD folder of its frames.
    fn record(&self, folder: &Path) -> PathBuf {
        let folder = folder.join(self.name);
        let camera = json!({"width": SIZE.0, "height": SIZE.1, "fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 23.5, "depth_scale": 1000});
        std::fs::create_dir_all(folder.join("depth")).unwrap();
        std::fs::create_dir_all(folder.join("rgb")).unwrap();
        std::fs::write(folder.join("camera.json"), camera.to_string()).unwrap();
        let wall = vec![self.depth; (SIZE.0 * SIZE.1) as usize];
        let depth = DepthImage::new(SIZE.0, SIZE.1, wall).unwrap();
        write_png_depth(&folder.join("depth/0.png"), &depth).unwrap();
        let color = ColorImage::filled(SIZE.0, SIZE.1, self.color);
        write_png_rgb(&folder.join("rgb/0.png"), &color).unwrap();
        for kind in ["depth", "rgb"] {
            let list = (0..4).map(|i| format!("{} {kind}/0.png\n", f64::from(i) / 30.0));
            std::fs::write(folder.join(format!("{kind}.txt")), list.collect::<String>()).unwrap();
        }
        folder
    }

    /// A piece of its depth images as it lies in memory, [`PIECE`] bytes.
    fn piece(&self) -> Vec<u8> {
        self.depth.to_le_bytes().repeat(PIECE / 2)
    }

    fn is_own(&self, p: &Picture) -> bool {
        let image = decode_jpeg(&p.image).unwrap();
        let own =
            |p: &[u8]| (0..3).all(|c| (f64::from(p[c]) - f64::from(self.color[c])).abs() < LOSS);
        image.data().chunks_exact(3).all(own)
    }
}

/// Makes keys in a folder, and a token for capture and compositor.
fn issue(keys: &Path) -> String {
    let run = |args: &[&str]| {
        let token = Command::new(env!("CARGO_BIN_EXE_tryon"))
            .arg("token")
            .args(args)
            .output();
        let token = token.unwrap();
        assert!(token.status.success(), "{token:?}");
        String::from_utf8(token.stdout).unwrap()
    };
    run(&["key", "--out", keys.to_str().unwrap()]);
    let key = keys.join("issuer.pem");
    let of = ["issue", "--key", key.to_str().unwrap(), "--store", "store"];
    run(&[
        &of[..],
        &["--audience", "capture", "compositor", "--ttl", "3600"],
    ]
    .concat())
}

/// `tryon up` with the two cameras.
struct Program {
    child: Child,
    /// Presents a token for all of it.
    credentials: Credentials,
    log: Arc<Mutex<String>>,
    /// Authority of the store, for the services behind the compositor.
    authority: PathBuf,
    addresses: Vec<(String, SocketAddr, SocketAddr)>,
}

impl Program {
    fn start(folder: &Path) -> Self {
        let bus = free_tcp_endpoint().unwrap();
        let mut config = format!("[bus]\nlisten = [\"{bus}\"]\nconnect = [\"{bus}\"]\n");
        let authority = folder.join("authority.pem");
        config += &format!("[identity]\nauthority = \"{}\"\n", authority.display());
        let keys = folder.join("keys");
        let token = issue(&keys);
        config += &format!(
            "[auth]\nkeys = [\"{}\"]\n",
            keys.join("issuer.pub.pem").display()
        );
        for service in ["capture", "tracking", "cloth", "compositor"] {
            config += &format!("[{service}]\naddress = \"127.0.0.1:0\"\nadmin = \"127.0.0.1:0\"\n");
        }
        for s in &SESSIONS {
            let source = s.record(folder);
            config += &format!(
                "[[capture.cameras]]\nname = \"{}\"\nsource = \"{}\"\nfast = true\n",
                s.name,
                source.display()
            );
        }
        let file = folder.join("box.toml");
        std::fs::write(&file, config).unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_tryon"))
            .args(["--log", "info,tryon_capture=trace,tryon_tracking=trace,tryon_cloth=trace,tryon_compositor=trace,tryon_kit=trace,zenoh=error"])
            .args(["up", "--config", file.to_str().unwrap()])
            .env("XDG_RUNTIME_DIR", folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("starts");
        let log = Arc::<Mutex<String>>::default();
        let (mut errors, written) = (child.stderr.take().unwrap(), log.clone());
        std::thread::spawn(move || {
            let mut piece = [0; 4096];
            while let Ok(n @ 1..) = errors.read(&mut piece) {
                *written.lock().unwrap() += &String::from_utf8_lossy(&piece[..n]);
            }
        });
        // Nobody reads on after the addresses: that stops nothing.
        let said = BufReader::new(child.stdout.take().unwrap()).lines();
        let addresses = said.map_while(Result::ok).take(4).map(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let at = |i: usize| words[i].parse().unwrap();
            (words[0].trim_end_matches(':').to_owned(), at(2), at(4))
        });
        Self {
            addresses: addresses.collect(),
            authority,
            child,
            credentials: Credentials::fixed(token.trim()),
            log,
        }
    }

    fn connect(&self, service: &str) -> Connection {
        let found = self.addresses.iter().find(|a| a.0 == service);
        let mut known = Config::default();
        known.identity.authority.clone_from(&self.authority);
        let identity = Identity::of(&known, "guest", false).unwrap();
        let inside = Tls::inside(&known, identity.as_ref()).unwrap();
        let scheme = if service == "compositor" {
            "http"
        } else {
            "https"
        };
        let url = format!("{scheme}://{}", found.unwrap().1);
        self.credentials
            .clone()
            .present(channel(&url, &inside).unwrap())
    }

    /// Memory of the process.
    fn memory(&self) -> std::io::Result<File> {
        File::open(format!("/proc/{}/mem", self.child.id()))
    }

    /// Occurrences of a piece in the writable memory of the process.
    fn remembers(&self, piece: &[u8]) -> usize {
        let maps = format!("/proc/{}/maps", self.child.id());
        let maps = std::fs::read_to_string(maps).unwrap();
        let mut memory = self.memory().unwrap();
        let mut found = 0;
        for line in maps.lines().filter(|l| l.contains(" rw")) {
            let (begin, end) = line.split(' ').next().unwrap().split_once('-').unwrap();
            let at = |x: &str| u64::from_str_radix(x, 16).unwrap();
            let mut bytes = vec![0; (at(end) - at(begin)) as usize];
            // Ranges that went away, or that only the kernel reads.
            if memory.seek(SeekFrom::Start(at(begin))).is_err()
                || memory.read_exact(&mut bytes).is_err()
            {
                continue;
            }
            found += bytes.chunks_exact(PIECE).filter(|b| *b == piece).count();
        }
        found
    }

    /// Metrics of all services.
    fn metrics(&self) -> String {
        let mut out = String::new();
        for (_, _, admin) in &self.addresses {
            let mut s = TcpStream::connect(admin).unwrap();
            s.write_all(b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                .unwrap();
            s.read_to_string(&mut out).unwrap();
        }
        out
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Exposures published so far.
async fn published(capture: &Connection) -> u64 {
    let mut capture = CaptureServiceClient::new(capture.clone());
    let cameras = capture.list_cameras(ListCamerasRequest {}).await.unwrap();
    cameras.into_inner().cameras.iter().map(|c| c.frames).sum()
}

/// Opens the session and checks every picture of it until its stream ends; their number and that of foreign ones.
async fn watch(session: &'static Painted, compositor: Connection) -> (u64, u64) {
    let mut c = CompositorServiceClient::new(compositor);
    let open = OpenTryOnRequest {
        try_on_id: session.name.into(),
        camera: session.name.into(),
        consent: Some(Consent { given: true }),
        ..Default::default()
    };
    c.open_try_on(open).await.unwrap();
    let stream = StreamFramesRequest {
        try_on_id: session.name.into(),
        ..Default::default()
    };
    let mut stream = c.stream_frames(stream).await.unwrap().into_inner();
    let (mut pictures, mut foreign, mut end) = (0, 0, TryOnEnd::Unspecified);
    while let Some(message) = stream.message().await.unwrap() {
        match message.event.unwrap() {
            Event::Picture(p) => {
                pictures += 1;
                foreign += u64::from(!session.is_own(&p));
            }
            Event::Status(s) => end = s.end(),
        }
    }
    assert_eq!(end, TryOnEnd::Withdrawn, "the stream says why it ends");
    (pictures, foreign)
}

async fn eventually(what: &str, mut is: impl AsyncFnMut() -> bool) -> Duration {
    let begun = Instant::now();
    while !is().await {
        assert!(begun.elapsed() < PATIENCE, "never: {what}");
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    begun.elapsed()
}

#[test]
fn no_picture_is_foreign_and_nothing_remains_in_memory_logs_and_metrics() {
    let folder = tempfile::tempdir().unwrap();
    let tryon = Program::start(folder.path());
    if let Err(e) = tryon.memory() {
        // A process without core dumps shows its memory to holders of CAP_SYS_PTRACE alone.
        assert!(std::env::var_os("TRYON_REQUIRE_ALL").is_none(), "{e}");
        eprintln!("SKIPPED: the memory of another process cannot be read: {e}");
        return;
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .unwrap();
    runtime.block_on(async {
        let (capture, compositor) = (tryon.connect("capture"), tryon.connect("compositor"));
        tokio::time::sleep(Duration::from_millis(500)).await;
        assert_eq!(published(&capture).await, 0, "before anybody agreed");

        let watching = SESSIONS
            .each_ref()
            .map(|s| tokio::spawn(watch(s, compositor.clone())));
        eventually("1e5 frames", async || published(&capture).await >= FRAMES).await;
        for s in &SESSIONS {
            // A search that does not find them while they are there proves nothing later.
            let is_found = async || tryon.remembers(&s.piece()) > 0;
            eventually("a frame in memory", is_found).await;
        }

        let mut c = CompositorServiceClient::new(compositor);
        for s in &SESSIONS {
            let try_on_id = s.name.into();
            c.withdraw_consent(WithdrawConsentRequest { try_on_id })
                .await
                .unwrap();
        }
        let after = published(&capture).await;
        for (s, w) in SESSIONS.iter().zip(watching) {
            let (pictures, foreign) = w.await.unwrap();
            println!("{}: {pictures} pictures, {foreign} foreign", s.name);
            assert!(pictures > 0 && foreign == 0);
            let is_forgotten = async || tryon.remembers(&s.piece()) == 0;
            let took = eventually("forgotten", is_forgotten).await;
            println!(
                "{}: nothing in memory {took:.1?} after the withdrawal",
                s.name
            );
        }
        assert_eq!(published(&capture).await, after, "after everybody withdrew");
    });
    let log = tryon.log.lock().unwrap().clone();
    assert!(log.contains("consent was withdrawn"), "{log}");
    for line in log.lines().chain(tryon.metrics().lines()) {
        assert!(!shows_data(line), "image or body data: {line}");
    }
}

/// Longest list of numbers, and longest run of letters and digits, in a line that carries no data: a vector with its
/// unit, an id or a digest.
const NUMBERS: usize = 6;
const RUN: usize = 64;

/// The line has a list of numbers as poses and pixels have, or a run of digits as encoded images have.
fn shows_data(line: &str) -> bool {
    let is_number = |w: &&str| w.parse::<f64>().is_ok();
    let mut words = line
        .split([',', ' ', '[', ']', '(', ')', ';'])
        .filter(|w| !w.is_empty());
    let mut longest = 0;
    while let Some(w) = words.next() {
        if is_number(&w) {
            longest = longest.max(1 + words.by_ref().take_while(is_number).count());
        }
    }
    let is_coded = |c: char| c.is_ascii_alphanumeric() || "+/=_-".contains(c);
    let runs = line.split(|c: char| !is_coded(c));
    longest > NUMBERS || runs.map(str::len).max().unwrap_or(0) > RUN
}

#[test]
fn lines_with_data_are_told_from_others() {
    assert!(shows_data("pose [0.1, -0.2, 0.3, 1.0, 2.5, 0.0, 7]"));
    assert!(shows_data(&format!("image={}", "/9j/4AAQ".repeat(9))));
    assert!(!shows_data(
        "2026-11-26T15:00:00Z INFO try_on=web-0123… camera=store/front opened"
    ));
    assert!(!shows_data(
        "tryon_stage_ms_bucket{stage=\"cloth.step\",le=\"0.25\"} 17"
    ));
}
