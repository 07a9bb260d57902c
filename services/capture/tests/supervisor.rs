//! The process as systemd sees it: ready, alive, stopping.

use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Ends the process whatever the test does.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn next(socket: &UnixDatagram) -> String {
    let mut message = [0; 256];
    let n = socket.recv(&mut message).expect("a message in time");
    String::from_utf8_lossy(&message[..n]).trim().to_owned()
}

#[test]
fn systemd_learns_of_start_life_and_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("notify");
    let socket = UnixDatagram::bind(&path).expect("bound");
    let patience = Duration::from_secs(30);
    socket.set_read_timeout(Some(patience)).expect("a time");
    let bus = folder.path().join("bus");
    let listen = format!("bus.listen=[\"unixsock-stream/{}\"]", bus.display());
    let child = Command::new(env!("CARGO_BIN_EXE_tryon-capture"))
        .args(["--set", "capture.address=127.0.0.1:0"])
        .args(["--set", "capture.admin=127.0.0.1:0"])
        .args(["--set", &listen])
        .args(["--set", "process.grace_ms=100"])
        .env("NOTIFY_SOCKET", &path)
        .env("WATCHDOG_USEC", "600000")
        .stdout(Stdio::null())
        .spawn()
        .expect("started");
    let mut process = Process(child);

    assert_eq!(next(&socket), "READY=1");
    for _ in 0..3 {
        assert_eq!(next(&socket), "WATCHDOG=1");
    }
    let pid = process.0.id().to_string();
    let sent = Command::new("kill").args(["-TERM", &pid]).status();
    assert!(sent.is_ok_and(|s| s.success()));
    let last = std::iter::repeat_with(|| next(&socket)).find(|m| m != "WATCHDOG=1");
    assert_eq!(last.as_deref(), Some("STOPPING=1"));
    assert!(process.0.wait().expect("ended").success());
}
