//! The rpcs: find the camera, send it a command, answer.

use crate::camera::{self, Command, Handle};
use crate::live::Opening;
use crate::push;
use crate::source::open_camera;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;
use tokio::sync::oneshot;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status, Streaming};
use tryon_kit::auth::Grant;
use tryon_kit::config::CaptureConfig;
use tryon_kit::frames::CameraKey;
use tryon_kit::server::Context;
use tryon_kit::status::{not_found, unavailable};
use tryon_proto::convert::geometry::calibration_to_wire;
use tryon_proto::convert::{WireError, request};
use tryon_proto::v1::capture_service_server::CaptureService;
use tryon_proto::v1::*;

/// Longest lease of consent (s): a lost holder must not keep a camera on.
const MAX_LEASE_S: f32 = 5.0;

/// All cameras of the process.
pub(crate) struct Capture {
    cameras: BTreeMap<String, (CameraKey, Handle)>,
    recordings: PathBuf,
}

impl Capture {
    pub(crate) fn new(config: &CaptureConfig, ctx: &Context) -> Self {
        let spawn = |c: &tryon_kit::config::CameraConfig| {
            // Names were checked with the configuration.
            let key = CameraKey::new(&config.store, &c.name)?;
            let opening = Opening {
                open: open_camera,
                camera: c.clone(),
                ros2: config.ros2.clone(),
            };
            let handle = camera::spawn(opening, key.clone(), ctx.clone());
            Some((c.name.clone(), (key, handle)))
        };
        Self {
            cameras: config.cameras.iter().filter_map(spawn).collect(),
            recordings: config.recordings.clone(),
        }
    }

    pub(crate) async fn autostart(&self, name: &str) {
        if let Some((_, handle)) = self.cameras.get(name) {
            // A camera that cannot be opened is listed as failed, and its task has logged why.
            let _ = handle.send(Command::Start).await;
        }
    }

    /// Camera of that name, if the request's token reaches it. A token for one camera does not learn of others.
    fn find<T>(&self, r: &Request<T>, name: &str) -> Result<&Handle, Status> {
        self.granted(&Grant::of(r)?, name)
    }

    fn granted(&self, grant: &Grant, name: &str) -> Result<&Handle, Status> {
        let Some((key, handle)) = self.cameras.get(name) else {
            return Err(match grant.camera() {
                Some(own) if own != name => Status::permission_denied("another camera's token"),
                _ => not_found("camera", name),
            });
        };
        grant.check_camera(key)?;
        Ok(handle)
    }
}

impl Handle {
    async fn send<T>(
        &self,
        command: impl FnOnce(oneshot::Sender<Result<T, Status>>) -> Command,
    ) -> Result<T, Status> {
        let (answer, reply) = oneshot::channel();
        let gone = |_| unavailable("capture", "shutting down");
        self.commands
            .send(command(answer))
            .await
            .map_err(|_| unavailable("capture", "shutting down"))?;
        reply.await.map_err(gone)?
    }
}

#[tonic::async_trait]
impl CaptureService for Capture {
    type PublishFramesStream = ReceiverStream<Result<PublishFramesResponse, Status>>;

    async fn publish_frames(
        &self,
        r: Request<Streaming<PublishFramesRequest>>,
    ) -> Result<Response<Self::PublishFramesStream>, Status> {
        let grant = Grant::of(&r)?;
        let mut requests = r.into_inner();
        let described = push::first(&mut requests).await?;
        let camera = self.granted(&grant, &described.camera)?.clone();
        let call = push::open(&described)?;
        let feed = |answer| Command::Feed {
            feed: call.feed,
            answer,
        };
        camera.send(feed).await?;
        tokio::spawn(call.sender.run(requests, camera));
        Ok(Response::new(ReceiverStream::new(call.answers)))
    }

    async fn list_cameras(
        &self,
        r: Request<ListCamerasRequest>,
    ) -> Result<Response<ListCamerasResponse>, Status> {
        let grant = Grant::of(&r)?;
        let cameras = (self.cameras.values())
            .filter(|(key, _)| grant.check_camera(key).is_ok())
            .map(|(_, h)| h.info.borrow().clone())
            .collect();
        Ok(Response::new(ListCamerasResponse { cameras }))
    }

    async fn get_calibration(
        &self,
        r: Request<GetCalibrationRequest>,
    ) -> Result<Response<GetCalibrationResponse>, Status> {
        let c = self
            .find(&r, &r.get_ref().camera)?
            .send(Command::Calibration)
            .await?;
        Ok(Response::new(GetCalibrationResponse {
            calibration: Some(calibration_to_wire(&c)),
        }))
    }

    async fn hold_consent(
        &self,
        r: Request<HoldConsentRequest>,
    ) -> Result<Response<HoldConsentResponse>, Status> {
        Grant::of(&r)?.check_session(&r.get_ref().try_on_id)?;
        let camera = self.find(&r, &r.get_ref().camera)?;
        let r = r.get_ref();
        let holder = request::session_id("hold_consent_request.try_on_id", &r.try_on_id)?;
        if !r.store.is_empty() && r.store != camera.info.borrow().store {
            return Err(not_found("store", &r.store));
        }
        if !(0.0..=MAX_LEASE_S).contains(&r.seconds) {
            let why = format!("0 to {MAX_LEASE_S} s");
            return Err(WireError::new("hold_consent_request.seconds", why).into());
        }
        let key = if r.seconds > 0.0 {
            let length = Duration::from_secs_f32(r.seconds);
            Some(camera.leases.hold(&holder, length)?)
        } else {
            camera.leases.end(&holder);
            None
        };
        Ok(Response::new(HoldConsentResponse { key }))
    }

    async fn start_camera(
        &self,
        r: Request<StartCameraRequest>,
    ) -> Result<Response<StartCameraResponse>, Status> {
        let info = self
            .find(&r, &r.get_ref().camera)?
            .send(Command::Start)
            .await?;
        Ok(Response::new(StartCameraResponse { info: Some(info) }))
    }

    async fn stop_camera(
        &self,
        r: Request<StopCameraRequest>,
    ) -> Result<Response<StopCameraResponse>, Status> {
        let info = self
            .find(&r, &r.get_ref().camera)?
            .send(Command::Stop)
            .await?;
        Ok(Response::new(StopCameraResponse { info: Some(info) }))
    }

    async fn start_recording(
        &self,
        r: Request<StartRecordingRequest>,
    ) -> Result<Response<StartRecordingResponse>, Status> {
        let camera = self.find(&r, &r.get_ref().camera)?;
        let r = r.get_ref();
        if !r.consent {
            return Err(Status::failed_precondition(
                "start_recording_request.consent: nobody is recorded without it",
            ));
        }
        if self.recordings.as_os_str().is_empty() {
            return Err(Status::failed_precondition(
                "capture.recordings: no folder is configured",
            ));
        }
        let folder = self.recordings.clone();
        let file = camera
            .send(|answer| Command::Record { folder, answer })
            .await?;
        Ok(Response::new(StartRecordingResponse { file }))
    }

    async fn stop_recording(
        &self,
        r: Request<StopRecordingRequest>,
    ) -> Result<Response<StopRecordingResponse>, Status> {
        let done = self
            .find(&r, &r.get_ref().camera)?
            .send(Command::EndRecording)
            .await?;
        Ok(Response::new(StopRecordingResponse {
            file: done.file,
            frames: done.frames,
            dropped: done.dropped,
        }))
    }
}
