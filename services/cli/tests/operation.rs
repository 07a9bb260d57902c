//! Processes as an operator meets them: exit codes, checks, signals, and files.
#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs)]

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use tempfile::TempDir;

const SIGABRT: i32 = 6;
const SIGPIPE: i32 = 13;

fn tryon(args: &[&str]) -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon"));
    // Software Vulkan writes a warning without a desktop session.
    c.args(args).env("XDG_RUNTIME_DIR", std::env::temp_dir());
    c
}

/// The command in a shell that runs `setup` before.
fn after(setup: &str, command: &Command) -> Command {
    let mut c = Command::new("sh");
    c.args(["-c", &format!("{setup}; exec \"$0\" \"$@\"")])
        .arg(command.get_program())
        .args(command.get_args())
        .env("XDG_RUNTIME_DIR", std::env::temp_dir());
    c
}

/// `tryon up` on free ports and a bus in a folder, with keys set.
fn up(folder: &Path, set: &[String]) -> Command {
    let mut c = tryon(&["up"]);
    for service in ["capture", "tracking", "cloth", "compositor"] {
        for key in ["address", "admin"] {
            c.args(["--set", &format!("{service}.{key}=127.0.0.1:0")]);
        }
    }
    let bus = folder.join("bus");
    let listen = format!("bus.listen=[\"unixsock-stream/{}\"]", bus.display());
    c.args(["--set", &listen]);
    for s in set {
        c.args(["--set", s]);
    }
    c
}

fn run(command: &mut Command) -> Output {
    command.output().expect("starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o7777
}

/// A running box; it ends with the test.
struct RunningBox(Child);

impl RunningBox {
    /// Its lines up to the address of its page, and that address.
    fn start(mut command: Command) -> (Self, String) {
        let mut child = command.stdout(Stdio::piped()).spawn().expect("starts");
        let out = BufReader::new(child.stdout.take().unwrap()).lines();
        let running = Self(child);
        let page = out
            .map_while(Result::ok)
            .find_map(|l| l.strip_prefix("mirror: ").map(str::to_owned));
        (running, page.expect("an address"))
    }

    fn signal(&self, name: &str) {
        let pid = self.0.id().to_string();
        let sent = Command::new("kill").args(["-s", name, &pid]).status();
        assert!(sent.expect("sent").success());
    }
}

impl Drop for RunningBox {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Key pair of an issuer in a folder, as `tryon token key` makes it.
fn issuer(folder: &Path) -> [String; 2] {
    let out = folder.join("keys").display().to_string();
    let made = run(&mut tryon(&["token", "key", "--out", &out]));
    assert!(made.status.success(), "{}", text(&made.stderr));
    [format!("{out}/issuer.pem"), format!("{out}/issuer.pub.pem")]
}

#[test]
fn a_box_refuses_files_that_it_cannot_use() {
    let dir = TempDir::new().unwrap();
    let no = dir.path().join("missing").display().to_string();
    let good = dir.path().display().to_string();
    let json = dir.path().join("bus.json5");
    fs::write(&json, "{ mode: ").unwrap();
    let [_, public] = issuer(dir.path());
    let keys = format!("auth.keys=[\"{public}\"]");
    let cases = [
        ("auth.keys", vec![format!("auth.keys=[\"{no}\"]")]),
        ("auth.revoked", vec![keys, format!("auth.revoked={no}")]),
        (
            "tls.key",
            vec![format!("tls.certificate={public}"), format!("tls.key={no}")],
        ),
        ("bus.config", vec![format!("bus.config={no}")]),
        ("bus.config", vec![format!("bus.config={}", json.display())]),
        ("tracking.body", vec![format!("tracking.body={no}")]),
        (
            "tracking.color_model",
            vec![format!("tracking.color_model={no}")],
        ),
        ("cloth.garments", vec![format!("cloth.garments={no}")]),
        (
            "cloth.garments_body",
            vec![
                format!("cloth.garments={good}"),
                format!("cloth.garments_body={no}"),
            ],
        ),
        ("auth.enrolments", vec![format!("auth.enrolments={public}")]),
        (
            "capture.recordings",
            vec![format!("capture.recordings={no}")],
        ),
        (
            "capture.cameras.0.source",
            vec![format!("capture.cameras=[{{source=\"{no}\"}}]")],
        ),
        ("log.level", vec!["log.level=loud".into()]),
        ("tracking.speed", vec!["tracking.speed=3".into()]),
    ];
    for (key, set) in cases {
        let ends = [
            run(up(dir.path(), &set).arg("--check")),
            run(&mut up(dir.path(), &set)),
        ];
        for end in ends {
            let why = text(&end.stderr);
            let name = key.rsplit('.').next().unwrap();
            assert_eq!(end.status.code(), Some(64), "{key}: {why}");
            assert!(why.contains(key) || why.contains(name), "{key}: {why}");
            assert!(text(&end.stdout).is_empty(), "{key}");
        }
    }
    let checked = run(up(dir.path(), &["cloth.idle_s=7".into()]).arg("--check"));
    assert!(checked.status.success() && text(&checked.stdout).contains("idle_s = 7"));
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("cloth.address={}", taken.local_addr().unwrap());
    let end = run(&mut up(dir.path(), std::slice::from_ref(&address)));
    assert_eq!(end.status.code(), Some(70), "{}", text(&end.stderr));
    assert!(text(&end.stderr).contains(&address.replace('=', " = ")));
}

#[test]
fn a_kiosk_trades_its_code_as_documented() {
    let dir = TempDir::new().unwrap();
    let [private, public] = issuer(dir.path());
    let codes = dir.path().join("codes").display().to_string();
    let drawn = run(&mut tryon(&[
        "token", "enrol", "--key", &private, "--store", "store", "--camera", "front", "--folder",
        &codes,
    ]));
    let code = text(&drawn.stdout).trim().to_owned();
    let set = [
        format!("auth.keys=[\"{public}\"]"),
        format!("auth.enrolments={codes}"),
    ];
    let (_running, page) = RunningBox::start(up(dir.path(), &set));
    let file = dir.path().join("kiosk.token");
    let out = file.display().to_string();
    let redeem = ["token", "redeem", &code, "--out", &out, "--at", &page];
    let traded = run(&mut tryon(&redeem));
    assert!(traded.status.success(), "{}", text(&traded.stderr));
    let token = fs::read_to_string(&file).unwrap();
    assert_eq!((token.trim().split('.').count(), mode(&file)), (3, 0o600));
    // Its default address takes no more arguments than documented.
    let again = run(&mut tryon(&redeem));
    assert_eq!(again.status.code(), Some(1), "{}", text(&again.stderr));
}

#[test]
fn a_closed_standard_output_ends_a_command_quietly() {
    let dir = TempDir::new().unwrap();
    let shirt = dir.path().join("shirt.obj").display().to_string();
    let made = run(&mut tryon(&["export", "tshirt", "--out", &shirt]));
    assert!(made.status.success(), "{}", text(&made.stderr));
    for args in [&["doctor"][..], &["export", "--list"], &["import", &shirt]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let end = run(tryon(args).stdout(writer));
        let why = text(&end.stderr);
        assert_eq!(end.status.signal(), Some(SIGPIPE), "{args:?}: {why}");
        assert_eq!(why, "", "{args:?}");
    }
}

#[test]
fn a_box_outlives_its_reader_and_broken_connections() {
    let dir = TempDir::new().unwrap();
    // Nobody reads its standard output once the address is known.
    let (mut running, page) = RunningBox::start(up(dir.path(), &[]));
    let page = page.strip_prefix("http://").unwrap();
    let (address, _) = page.split_once('/').unwrap();
    let get = || {
        let mut stream = TcpStream::connect(address).unwrap();
        let request = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
        stream.write_all(request).unwrap();
        stream
    };
    // Closed with the answer unread: the box writes to a connection that was reset.
    (0..200).for_each(|_| drop(get()));
    let mut answer = [0; 12];
    get().read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"HTTP/1.1 200");
    running.signal("TERM");
    assert_eq!(running.0.wait().unwrap().code(), Some(0));
}

#[test]
fn an_abort_leaves_no_core() {
    let dir = TempDir::new().unwrap();
    let cores = "ulimit -S -c $(ulimit -H -c)";
    let mut command = after(cores, &up(dir.path(), &[]));
    command.current_dir(dir.path());
    let (mut running, _) = RunningBox::start(command);
    running.signal("ABRT");
    let end = running.0.wait().unwrap();
    assert_eq!((end.signal(), end.core_dumped()), (Some(SIGABRT), false));
}

#[test]
fn nobody_else_reads_a_recording_under_any_umask() {
    let dir = TempDir::new().unwrap();
    let record = |out: &Path| {
        let mut command = tryon(&["record", "--source", "pattern", "--seconds", "0.1", "--out"]);
        command.arg(out);
        let made = run(&mut after("umask 0", &command));
        assert!(made.status.success(), "{}", text(&made.stderr));
        mode(out)
    };
    let (file, folder) = (dir.path().join("a.mcap"), dir.path().join("a"));
    assert_eq!((record(&file), record(&folder)), (0o600, 0o700));
    assert_eq!(mode(&folder.join("depth/000000.png")), 0o600);
}

#[test]
fn names_of_files_forge_no_lines_of_the_log() {
    let dir = TempDir::new().unwrap();
    let name = "a\n2026-01-01 ERROR forged\x1b[2J.obj";
    File::create(dir.path().join(name)).unwrap();
    let garments = format!("cloth.garments={}", dir.path().display());
    let checked = run(up(dir.path(), &[garments]).arg("--check"));
    let log = text(&checked.stderr);
    assert!(checked.status.success(), "{log}");
    assert!(log.contains(r"a\n2026-01-01 ERROR forged"), "{log}");
    assert!(!log.lines().any(|l| l.starts_with("2026-01-01 ERROR")));
    assert!(!log.contains("\x1b[2J"), "{log:?}");
}
