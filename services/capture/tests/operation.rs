//! The program as an operator meets it: its check, its exit codes, no core dump.
#![cfg(unix)]

use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn capture(folder: &Path, set: &str) -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon-capture"));
    let listen = format!(
        "bus.listen=[\"unixsock-stream/{}\"]",
        folder.join("bus").display()
    );
    for s in [
        "capture.address=127.0.0.1:0",
        "capture.admin=127.0.0.1:0",
        &listen,
        set,
    ] {
        c.args(["--set", s]);
    }
    c
}

fn said(end: &Output) -> String {
    let bytes = [&end.stdout[..], &end.stderr].concat();
    String::from_utf8_lossy(&bytes).into_owned()
}

#[test]
fn a_start_and_its_check_refuse_the_same_files() {
    let dir = tempfile::tempdir().expect("a folder");
    let no = dir.path().join("missing").display().to_string();
    let cases = [
        ("auth.token", format!("auth.token={no}")),
        ("auth.keys", format!("auth.keys=[\"{no}\"]")),
        ("tls.ca", format!("tls.ca={no}")),
        ("bus.config", format!("bus.config={no}")),
        ("capture.recordings", format!("capture.recordings={no}")),
        (
            "capture.cameras.0.source",
            format!("capture.cameras=[{{source=\"{no}\"}}]"),
        ),
        ("log.level", "log.level=loud".to_owned()),
    ];
    for (key, set) in cases {
        for flag in [None, Some("--check")] {
            let end = capture(dir.path(), &set).args(flag).output();
            let end = end.expect("started");
            let words = said(&end);
            assert_eq!(end.status.code(), Some(64), "{set}: {words}");
            assert!(words.contains(&format!("capture: {key}")), "{set}: {words}");
        }
    }
    let recordings = format!("capture.recordings={}", dir.path().display());
    let fine = capture(dir.path(), &recordings).arg("--check").output();
    let fine = fine.expect("started");
    assert!(fine.status.success() && said(&fine).contains("is fine"));
}

#[test]
fn an_abort_leaves_no_core() {
    use std::io::{BufRead, BufReader};
    let dir = tempfile::tempdir().expect("a folder");
    let program = capture(dir.path(), "process.grace_ms=100");
    let mut command = Command::new("sh");
    let cores = "ulimit -S -c $(ulimit -H -c); exec \"$0\" \"$@\"";
    command.args(["-c", cores]).arg(program.get_program());
    command.args(program.get_args());
    command.stdout(Stdio::piped()).current_dir(dir.path());
    let mut child = command.spawn().expect("started");
    let out = BufReader::new(child.stdout.take().expect("piped")).lines();
    let is_up = |l: &String| l.contains("grpc");
    out.map_while(Result::ok).find(is_up).expect("its address");
    let pid = child.id().to_string();
    let sent = Command::new("kill").args(["-s", "ABRT", &pid]).status();
    assert!(sent.is_ok_and(|s| s.success()));
    let end = child.wait().expect("ended");
    assert_eq!((end.signal(), end.core_dumped()), (Some(6), false));
}
