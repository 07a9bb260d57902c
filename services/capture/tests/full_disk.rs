//! A disk that becomes full under a recording: the error is typed, publishing goes on, the file is readable.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tonic::Code;
use tryon_formats::open_recording;
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::{
    CameraInfo, HoldConsentRequest, ListCamerasRequest, StartRecordingRequest, StopRecordingRequest,
};

/// Ends the process whatever the test does.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

type Client = CaptureServiceClient<tonic::transport::Channel>;

async fn camera(client: &mut Client) -> CameraInfo {
    let list = client.list_cameras(ListCamerasRequest::default()).await;
    let cameras = list.expect("listed").into_inner().cameras;
    cameras.into_iter().next().expect("one camera")
}

/// Lets the camera publish for the next seconds.
async fn hold(client: &mut Client) {
    let request = HoldConsentRequest {
        camera: "front".into(),
        try_on_id: "somebody".into(),
        seconds: 2.0,
        ..Default::default()
    };
    client.hold_consent(request).await.expect("held");
}

/// The service with files of at most `kib` KiB (RLIMIT_FSIZE, EFBIG like a full disk's ENOSPC), and its gRPC URL.
fn start(folder: &std::path::Path, kib: usize) -> (Process, String) {
    let shell = format!("trap '' XFSZ; ulimit -f {}; exec \"$0\" \"$@\"", 2 * kib);
    let set = [
        "capture.address=127.0.0.1:0".to_owned(),
        "capture.admin=127.0.0.1:0".to_owned(),
        format!("capture.recordings={}", folder.display()),
        "capture.cameras=[{name=\"front\",source=\"pattern\",rate=30.0}]".to_owned(),
        format!(
            "bus.listen=[\"unixsock-stream/{}\"]",
            folder.join("bus").display()
        ),
    ];
    let mut command = Command::new("sh");
    command.args(["-c", &shell, env!("CARGO_BIN_EXE_tryon-capture")]);
    for s in &set {
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

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_full_disk_ends_the_recording_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_process, url) = start(folder.path(), 300);
    let mut client = Client::connect(url).await.expect("connected");
    let request = StartRecordingRequest {
        camera: "front".into(),
        consent: true,
    };
    hold(&mut client).await;
    let begun = client.start_recording(request).await.expect("begun");
    let file = begun.into_inner().file;

    while camera(&mut client).await.recording {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let before = camera(&mut client).await.frames;
    while camera(&mut client).await.frames < before + 10 {
        hold(&mut client).await;
        tokio::time::sleep(Duration::from_millis(50)).await;
    }

    let request = StopRecordingRequest {
        camera: "front".into(),
    };
    let fault = client.stop_recording(request.clone()).await;
    let fault = fault.expect_err("the disk is full");
    assert_eq!(fault.code(), Code::ResourceExhausted, "{fault}");
    assert!(fault.message().contains(&file), "{fault}");
    let again = client.stop_recording(request).await.expect_err("ended");
    assert_eq!(again.code(), Code::FailedPrecondition);

    let mut recording = open_recording(&folder.path().join(file)).expect("readable");
    let mut frames = 0;
    while recording.next_frame().expect("whole frames").is_some() {
        frames += 1;
    }
    assert!(frames > 0);
}
