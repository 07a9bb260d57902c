//! `tryon fine` against the services of a box with the synthetic person: its files, its cancel and what continues it.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs, clippy::print_stdout)]

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use tryon::formats::gltf::read_glb;
use tryon::formats::npy::read_npy;
use tryon_kit::auth::Credentials;
use tryon_kit::bus::free_tcp_endpoint;
use tryon_kit::client::channel;
use tryon_kit::tls::Tls;
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;
use tryon_proto::v1::*;

/// Longest wait for anything that a busy machine delays: a body that is silent for a second is forgotten.
const PATIENCE: Duration = Duration::from_secs(300);

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tryon"));
    command
        .args(args)
        .env("XDG_RUNTIME_DIR", std::env::temp_dir());
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Standard output of a command that succeeds.
fn output(args: &[&str]) -> String {
    let out = command(args).output().unwrap();
    assert!(out.status.success(), "{args:?}: {out:?}");
    text(&out.stdout).trim().to_owned()
}

/// `tryon up` with the synthetic person, and a configuration that reaches it.
struct Program {
    child: Child,
    folder: PathBuf,
    compositor: String,
    token: String,
}

impl Program {
    fn start(folder: &Path) -> Self {
        let path = |name: &str| folder.join(name).display().to_string();
        output(&["token", "key", "--out", &path("keys")]);
        let key = path("keys/issuer.pem");
        let issue = ["token", "issue", "--key", &key, "--store", "store"];
        let claims = ["--audience", "cloth", "compositor", "--ttl", "3600"];
        let token = output(&[&issue[..], &claims].concat());
        std::fs::write(folder.join("token"), &token).unwrap();

        let bus = free_tcp_endpoint().unwrap();
        let public = path("keys/issuer.pub.pem");
        let identity = format!("[identity]\nauthority = \"{}\"\n", path("authority.pem"));
        let mut config = format!(
            "{identity}[auth]\nkeys = [\"{public}\"]\n[bus]\nlisten = [\"{bus}\"]\nconnect = [\"{bus}\"]\n\
             [[capture.cameras]]\nname = \"front\"\nsource = \"synth:still\"\nrate = 10.0\n"
        );
        for (service, more) in [
            ("capture", ""),
            ("tracking", ""),
            ("cloth", "adapts_detail = false\n"),
            ("compositor", "by_capacity = false\n"),
        ] {
            let any = "address = \"127.0.0.1:0\"\nadmin = \"127.0.0.1:0\"\n";
            config += &format!("[{service}]\n{any}{more}");
        }
        std::fs::write(folder.join("box.toml"), config).unwrap();
        let mut up = command(&["up", "--config", &path("box.toml")]);
        let mut child = up.stdout(Stdio::piped()).spawn().unwrap();
        let said = BufReader::new(child.stdout.take().unwrap()).lines();
        let said: Vec<String> = said.map_while(Result::ok).take(4).collect();
        let url = |service: &str| {
            let line = said.iter().find(|l| l.starts_with(service)).unwrap();
            format!("http://{}", line.split_whitespace().nth(2).unwrap())
        };
        let (token_file, cloth) = (path("token"), url("cloth").replace("http", "https"));
        let client = format!(
            "{identity}[auth]\ntoken = \"{token_file}\"\n[compositor]\ncloth = \"{cloth}\"\n"
        );
        std::fs::write(folder.join("client.toml"), client).unwrap();
        Self {
            child,
            folder: folder.to_owned(),
            compositor: url("compositor"),
            token,
        }
    }

    /// A try-on that wears a skirt for as long as the runtime lives.
    async fn wear(&self) {
        let channel = channel(&self.compositor, &Tls::off()).unwrap();
        let connection = Credentials::fixed(&self.token).present(channel);
        let mut compositor = CompositorServiceClient::new(connection);
        let skirt = GarmentChoice {
            garment: "skirt".into(),
            size: "M".into(),
            color_rgb: None,
            print: None,
        };
        let open = OpenTryOnRequest {
            try_on_id: "mine".into(),
            garments: vec![skirt],
            consent: Some(Consent { given: true }),
            ..Default::default()
        };
        compositor.open_try_on(open).await.unwrap();
        let watch = StreamFramesRequest {
            try_on_id: "mine".into(),
            ..Default::default()
        };
        let pictures = compositor.stream_frames(watch).await.unwrap();
        let mut pictures = pictures.into_inner();
        tokio::spawn(async move { while let Ok(Some(_)) = pictures.message().await {} });
    }

    /// `tryon fine` into the folder `out`.
    fn fine(&self, args: &[&str], out: &str) -> Command {
        let path = |name: &str| self.folder.join(name).display().to_string();
        let (config, out) = (path("client.toml"), path(out));
        command(&[&["fine", "--config", &config, "--out", &out], args].concat())
    }

    /// One line on standard error of a refusal.
    fn refused(&self, args: &[&str]) -> String {
        let out = self.fine(args, "refused").output().unwrap();
        assert_eq!(out.status.code(), Some(1), "{out:?}");
        text(&out.stderr)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Tries until there is a result; `Err` is a reason to try again that a dressing or a busy machine explains.
fn eventually<T>(mut attempt: impl FnMut() -> Result<T, Output>) -> T {
    let begun = Instant::now();
    loop {
        match attempt() {
            Ok(done) => return done,
            Err(out) => {
                let why = text(&out.stderr);
                let waits = ["FAILED_PRECONDITION", "NOT_FOUND", "RESOURCE_EXHAUSTED"];
                let is_early = out.status.success() || waits.iter().any(|w| why.contains(w));
                assert!(is_early && begun.elapsed() < PATIENCE, "{out:?}");
            }
        }
        #[allow(clippy::disallowed_methods, reason = "a plain thread of a test")]
        std::thread::sleep(Duration::from_millis(300));
    }
}

/// Frames and vertices of positions.npy, and the capture times of the report.
fn files(folder: &Path) -> ([u64; 2], Vec<u64>) {
    let (shape, values) = read_npy(&folder.join("positions.npy")).unwrap();
    assert!(shape[2] == 3 && values.iter().all(|x| x.is_finite()));
    let report = std::fs::read(folder.join("report.json")).unwrap();
    let report: Value = serde_json::from_slice(&report).unwrap();
    let garment = &report["garments"][0];
    assert_eq!(
        (&garment["name"], &garment["first_vertex"]),
        (&"skirt".into(), &0.into())
    );
    assert_eq!(garment["vertices"], shape[1]);
    assert!(report["world_from_camera"].is_object());
    let frames = report["frames"].as_array().unwrap().iter();
    let times = frames.map(|f| f["capture_time_ns"].as_u64().unwrap());
    ([shape[0], shape[1]], times.collect())
}

/// Starts a motion and ends it by Ctrl-C after its first frame; the frames by then, and the command that continues it.
fn cancelled(tryon: &Program) -> Result<(u64, String), Output> {
    let folder = tryon.folder.join("motion");
    let _ = std::fs::remove_dir_all(&folder);
    let args = ["--session", "mine", "--vertices", "2000", "--seconds", "1"];
    let mut fine = tryon.fine(&args, "motion");
    let fine = fine.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = fine.spawn().unwrap();
    let has_frames = || {
        let report = std::fs::read_to_string(folder.join("report.json"));
        report.is_ok_and(|r| r.contains("capture_time_ns"))
    };
    while child.try_wait().unwrap().is_none() && !has_frames() {
        #[allow(clippy::disallowed_methods, reason = "a plain thread of a test")]
        std::thread::sleep(Duration::from_millis(5));
    }
    let kill = ["-INT", &child.id().to_string()];
    Command::new("kill").args(kill).status().unwrap();
    let out = child.wait_with_output().unwrap();
    if out.status.code() != Some(130) {
        return Err(out);
    }
    let said = text(&out.stdout);
    Ok((files(&folder).0[0], said.lines().last().unwrap().to_owned()))
}

#[test]
fn a_session_is_simulated_cancelled_and_continued() {
    let dir = tempfile::tempdir().unwrap();
    let tryon = Program::start(dir.path());
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .unwrap();
    runtime.block_on(tryon.wear());
    let unknown = tryon.refused(&["--session", "nobody"]);
    assert!(unknown.contains("StartSimulation: NOT_FOUND"), "{unknown}");
    let none = tryon.refused(&["--session", "mine", "--vertices", "0"]);
    let named = "INVALID_ARGUMENT: start_simulation_request.session.vertices";
    assert!(none.contains(named), "{none}");

    eventually(|| {
        let args = ["--session", "mine", "--vertices", "2000"];
        let out = tryon.fine(&args, "drape").output().unwrap();
        if out.status.success() {
            Ok(())
        } else {
            Err(out)
        }
    });
    let folder = dir.path().join("drape");
    let ([frames, vertices], times) = files(&folder);
    assert_eq!((frames, times.len()), (1, 1));
    assert!((1000..=4000).contains(&vertices), "{vertices}");
    let glb = read_glb(&folder.join("outfit.glb")).unwrap();
    assert_eq!(
        (glb.parts.len(), glb.parts[0].names.group.as_str()),
        (1, "skirt")
    );

    let (before, after, times) = eventually(|| {
        let (before, command) = cancelled(&tryon)?;
        let words: Vec<&str> = command.split(' ').collect();
        assert_eq!(words[..3], ["tryon", "fine", "--simulation"], "{command}");
        let out = self::command(&words[1..]).output().unwrap();
        if !out.status.success() {
            return Err(out);
        }
        let ([after, _], times) = files(&dir.path().join("motion"));
        Ok((before, after, times))
    });
    println!("{before} frames, then {after}");
    assert!(before < after && times.len() as u64 == after);
    assert!(times.is_sorted_by(|a, b| a < b), "{times:?}");
    read_glb(&dir.path().join("motion/outfit.glb")).unwrap();
}

#[test]
fn a_service_that_is_away_and_files_of_nothing_are_said() {
    let dir = tempfile::tempdir().unwrap();
    let config = dir.path().join("client.toml");
    std::fs::write(&config, "[compositor]\ncloth = \"http://127.0.0.1:1\"\n").unwrap();
    let (config, out) = (
        config.display().to_string(),
        dir.path().display().to_string(),
    );
    let fine = |args: &[&str]| {
        let to = ["fine", "--config", &config, "--out", &out];
        let out = command(&[&to[..], args].concat()).output().unwrap();
        (out.status.code(), text(&out.stderr))
    };
    let (code, why) = fine(&["--session", "mine"]);
    assert_eq!(code, Some(1));
    let named = "http://127.0.0.1:1: StartSimulation: UNAVAILABLE";
    assert!(why.contains(named), "{why}");
    let (code, why) = fine(&["--simulation", "gone"]);
    assert!(code == Some(1) && why.contains("report.json"), "{why}");
    for wrong in [&[][..], &["--session", "a", "--simulation", "b"]] {
        assert_eq!(fine(wrong).0, Some(2), "{wrong:?}");
    }
}
