//! The service as a process, and its client.
#![allow(dead_code)] // each test uses a part

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::{CameraInfo, HoldConsentRequest, ListCamerasRequest};

/// Ends the process whatever the test does.
pub(crate) struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(crate) type Client = CaptureServiceClient<tonic::transport::Channel>;

/// The service after a line of shell, with a source for camera `front`; its gRPC URL. Recordings go into `folder`.
pub(crate) fn start(folder: &Path, before: &str, source: &str) -> (Process, String) {
    launch(folder, before, &format!("source=\"{source}\""), &[])
}

/// As [`start`], with keys of the camera.
pub(crate) fn start_camera(folder: &Path, keys: &str) -> (Process, String) {
    launch(folder, "", keys, &[])
}

/// The service as [`start`] starts it, with more of configuration.
pub(crate) fn start_with(folder: &Path, source: &str, more: &[String]) -> (Process, String) {
    launch(folder, "", &format!("source=\"{source}\""), more)
}

fn launch(folder: &Path, before: &str, keys: &str, more: &[String]) -> (Process, String) {
    let set = [
        "capture.address=127.0.0.1:0".to_owned(),
        "capture.admin=127.0.0.1:0".to_owned(),
        format!("capture.recordings={}", folder.display()),
        format!("capture.cameras=[{{name=\"front\",{keys},rate=30.0}}]"),
        format!(
            "bus.listen=[\"unixsock-stream/{}\"]",
            folder.join("bus").display()
        ),
    ];
    let mut command = Command::new("sh");
    let shell = format!("{before} exec \"$0\" \"$@\"");
    command.args(["-c", &shell, env!("CARGO_BIN_EXE_tryon-capture")]);
    for s in set.iter().chain(more) {
        command.args(["--set", s]);
    }
    let mut child = command.stdout(Stdio::piped()).spawn().expect("started");
    let out = BufReader::new(child.stdout.take().expect("piped"));
    let process = Process(child);
    let line = out
        .lines()
        .map_while(Result::ok)
        .find(|l| l.contains("grpc"));
    let line = line.expect("its address");
    let address = line.split(' ').nth(2).expect("an address").to_owned();
    (process, format!("http://{address}"))
}

pub(crate) async fn camera(client: &mut Client) -> CameraInfo {
    let list = client.list_cameras(ListCamerasRequest::default()).await;
    let cameras = list.expect("listed").into_inner().cameras;
    cameras.into_iter().next().expect("one camera")
}

/// Lets the camera publish for the next seconds.
pub(crate) async fn hold(client: &mut Client) {
    let request = HoldConsentRequest {
        camera: "front".into(),
        try_on_id: "somebody".into(),
        seconds: 5.0,
        ..Default::default()
    };
    client.hold_consent(request).await.expect("held");
}
