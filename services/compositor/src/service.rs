//! Remote procedures of the compositor: check the request, find the try-on, answer.

use crate::admission::Admission;
use crate::card::Card;
use crate::encoding::{Encoding, PICTURE_QUALITY};
use crate::fine_picture::{self, FinePicture};
use crate::photos::{self, Photos};
use crate::try_on::{self, Command, Handle, Setup};
use crate::upstream::{self, renamed};
use crate::viewer::viewer;
use futures::Stream;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::oneshot;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Request, Response, Status};
use tryon_kit::auth::{Caller, Connection, EnrolFault, Grant};
use tryon_kit::client::{channel, request as call};
use tryon_kit::config::CompositorConfig;
use tryon_kit::consent::Cameras;
use tryon_kit::frames::CameraKey;
use tryon_kit::queue::consumption::Consumption;
use tryon_kit::server::{Context, StartError};
use tryon_kit::sessions::{Opened, Sessions, brief, random_id};
use tryon_kit::status::{exhausted, from_upstream, not_found, unavailable};
use tryon_proto::convert::request;
use tryon_proto::v1::capture_service_server::SERVICE_NAME as CAPTURE;
use tryon_proto::v1::cloth_service_server::SERVICE_NAME as CLOTH;
use tryon_proto::v1::compositor_service_server::CompositorService;
use tryon_proto::v1::tracking_service_server::SERVICE_NAME as TRACKING;
use tryon_proto::v1::*;

/// Longest wait for a snapshot.
const SNAPSHOT_DEADLINE: Duration = Duration::from_secs(2);

/// Longest wait until everything behind a try-on was told of its end.
const WITHDRAWAL_DEADLINE: Duration = Duration::from_secs(5);

/// Steps of a fine picture, and the picture.
type FineMessages = ReceiverStream<Result<TakeFinePictureResponse, Status>>;

/// Picture stream of a viewer.
type Pictures = Pin<Box<dyn Stream<Item = Result<StreamFramesResponse, Status>> + Send>>;

/// Directory of try-ons and the dependencies of new ones.
pub(crate) struct Compositor {
    try_ons: Sessions<Handle>,
    admission: Admission,
    config: CompositorConfig,
    ctx: Context,
    cloth: Connection,
    tracking: Connection,
    capture: Connection,
    cameras: Cameras,
    photos: Photos,
    card: Card,
}

impl Compositor {
    pub(crate) fn new(
        config: &CompositorConfig,
        ctx: &Context,
        photos: Photos,
    ) -> Result<Self, StartError> {
        let fault = |key: &str| {
            let key = format!("compositor.{key}");
            move |why| StartError::Config { key, why }
        };
        let present = |channel| ctx.auth.credentials().present(channel);
        let tracking = present(channel(&config.tracking, &ctx.inside).map_err(fault("tracking"))?);
        let cloth = present(channel(&config.cloth, &ctx.inside).map_err(fault("cloth"))?);
        let capture = present(channel(&config.capture, &ctx.inside).map_err(fault("capture"))?);
        let card = Card::open(config.renderer).map_err(|e| StartError::Config {
            key: "compositor.renderer".into(),
            why: e.to_string(),
        })?;
        let try_ons = Sessions::new(config.max_try_ons);
        let open = try_ons.clone();
        Ok(Self {
            admission: Admission::start(move || open.len(), ctx.shutdown.clone()),
            try_ons,
            config: config.clone(),
            ctx: ctx.clone(),
            cloth,
            tracking,
            cameras: Cameras::new(capture.clone()),
            capture,
            photos,
            card,
        })
    }

    /// Services behind this one, by gRPC name.
    pub(crate) fn behind(&self) -> Vec<(&'static str, Connection)> {
        vec![
            (CAPTURE, self.capture.clone()),
            (TRACKING, self.tracking.clone()),
            (CLOTH, self.cloth.clone()),
        ]
    }

    /// Try-on of that id, open or ending, if the request's token reaches it.
    fn reach<T>(&self, r: &Request<T>, id: &str) -> Result<Option<Arc<Handle>>, Status> {
        let grant = Grant::of(r)?;
        grant.check_session(id)?;
        let found = self.try_ons.get(id);
        if let Some(handle) = &found {
            grant.check_camera(&handle.key)?;
        }
        Ok(found)
    }

    /// The open try-on of that id.
    fn find<T>(&self, r: &Request<T>, id: &str) -> Result<Arc<Handle>, Status> {
        let open = |h: &Arc<Handle>| !h.commands.is_closed();
        let found = self.reach(r, id)?.filter(open);
        found.ok_or_else(|| not_found("try-on", id))
    }

    /// Takes a try-on out of the directory to end it; `None` when there is none.
    fn take<T>(&self, r: &Request<T>, id: &str) -> Result<Option<Arc<Handle>>, Status> {
        let found = self.reach(r, id)?;
        if let Some(handle) = &found {
            self.try_ons
                .remove_if(id, |open| std::ptr::eq(open, &**handle));
        }
        Ok(found)
    }

    /// Id and camera of a try-on to be opened, if the request's token reaches both. Names that are left out are those of
    /// the token, then those of the configuration.
    fn opening(&self, r: &Request<OpenTryOnRequest>) -> Result<(String, CameraKey), Status> {
        let grant = Grant::of(r)?;
        let r = r.get_ref();
        let id = if r.try_on_id.is_empty() {
            grant.session().map_or_else(random_id, Into::into)
        } else {
            request::session_id("open_try_on_request.try_on_id", &r.try_on_id)?
        };
        grant.check_session(&id)?;
        let or = |given: &str, default: &str| {
            let name = if given.is_empty() { default } else { given };
            name.to_owned()
        };
        let store = or(&r.store, &self.config.store);
        let camera = grant.camera().unwrap_or(&self.config.camera);
        let camera = or(&r.camera, camera);
        let key = request::camera_key("open_try_on_request", &store, &camera)?;
        grant.check_camera(&key)?;
        Ok((id, key))
    }

    /// Dresses the session in cloth. A silent cloth service is UNAVAILABLE, no fault of the outfit.
    async fn dress(
        &self,
        id: &str,
        choices: &[GarmentChoice],
        message: &str,
    ) -> Result<(), Status> {
        let mut client = upstream::client(self.cloth.clone());
        match upstream::dress(&mut client, id, choices, None).await {
            Ok(_) => Ok(()),
            Err(s) if s.code() == Code::InvalidArgument => Err(renamed(&s, message)),
            Err(s) => Err(from_upstream("cloth", &s)),
        }
    }
}

/// Newest picture of try-on `id`, at the camera's size.
async fn snapshot(handle: &Handle, id: &str, encoding: Encoding) -> Result<Picture, Status> {
    let (answer, drawn) = oneshot::channel();
    let gone = || not_found("try-on", id);
    handle
        .commands
        .send(Command::Snapshot(encoding, answer))
        .await
        .map_err(|_| gone())?;
    let late = |_| unavailable("compositor", "the picture took too long");
    tokio::time::timeout(SNAPSHOT_DEADLINE, drawn)
        .await
        .map_err(late)?
        .map_err(|_| gone())?
}

#[tonic::async_trait]
impl CompositorService for Compositor {
    async fn open_try_on(
        &self,
        r: Request<OpenTryOnRequest>,
    ) -> Result<Response<OpenTryOnResponse>, Status> {
        let (id, key) = self.opening(&r)?;
        let r = r.get_ref();
        let choices = request::choices("open_try_on_request", &r.garments)?;
        if !r.consent.is_some_and(|c| c.given) {
            return Err(Status::failed_precondition(
                "open_try_on_request.consent: nobody is shown without it",
            ));
        }
        if self
            .try_ons
            .get(&id)
            .is_some_and(|h| h.commands.is_closed())
        {
            self.try_ons.remove(&id);
        }
        if let Some(h) = self.try_ons.get(&id) {
            if h.key != key {
                return Err(Status::failed_precondition(format!(
                    "try-on `{id}` is open with camera {}",
                    h.key
                )));
            }
            let _ = h.commands.try_send(Command::Touch);
            return Ok(Response::new(OpenTryOnResponse {
                try_on_id: id,
                created: false,
            }));
        }
        let open = self.try_ons.len();
        if self.config.by_capacity && !self.admission.has_room(open) {
            metrics::counter!("tryon_try_ons_refused").increment(1);
            return Err(exhausted("try-ons that this machine can run", open));
        }
        // Without an answer it may come up later: the try-on says so, and asks again.
        if let Ok(false) = self.cameras.has(&key).await {
            return Err(not_found("camera", &key.to_string()));
        }
        if !choices.is_empty()
            && let Err(s) = self.dress(&id, &choices, "open_try_on_request").await
            && s.code() == Code::InvalidArgument
        {
            return Err(s);
        }
        let setup = || Setup {
            id: id.clone(),
            key: key.clone(),
            choices: choices.clone(),
            ctx: self.ctx.clone(),
            config: self.config.clone(),
            card: self.card.clone(),
            cameras: self.cameras.clone(),
            photos: self.photos.clone(),
            directory: self.try_ons.clone(),
        };
        let created = match self.try_ons.open(&id, || try_on::spawn(setup())) {
            Opened::Found(_) => false,
            Opened::Created(_) => {
                tracing::info!(try_on = brief(&id), camera = %key, "opened");
                metrics::gauge!("tryon_try_ons").set(self.try_ons.len() as f64);
                self.admission.on_opened();
                true
            }
            Opened::Full => return Err(exhausted("try-ons", self.try_ons.limit())),
        };
        Ok(Response::new(OpenTryOnResponse {
            try_on_id: id,
            created,
        }))
    }

    async fn close_try_on(
        &self,
        r: Request<CloseTryOnRequest>,
    ) -> Result<Response<CloseTryOnResponse>, Status> {
        if let Some(h) = self.take(&r, &r.get_ref().try_on_id)? {
            let _ = h.commands.send(Command::Close(TryOnEnd::Requested)).await;
        }
        Ok(Response::new(CloseTryOnResponse {}))
    }

    async fn withdraw_consent(
        &self,
        r: Request<WithdrawConsentRequest>,
    ) -> Result<Response<WithdrawConsentResponse>, Status> {
        if let Some(h) = self.take(&r, &r.get_ref().try_on_id)? {
            let _ = h.commands.send(Command::Close(TryOnEnd::Withdrawn)).await;
            tokio::time::timeout(WITHDRAWAL_DEADLINE, h.over.cancelled())
                .await
                .map_err(|_| unavailable("capture", "its lease ends by itself"))?;
        }
        Ok(Response::new(WithdrawConsentResponse {}))
    }

    async fn choose_garments(
        &self,
        r: Request<ChooseGarmentsRequest>,
    ) -> Result<Response<ChooseGarmentsResponse>, Status> {
        let handle = self.find(&r, &r.get_ref().try_on_id)?;
        let r = r.get_ref();
        let choices = request::choices("choose_garments_request", &r.garments)?;
        let accepted = self
            .dress(&r.try_on_id, &choices, "choose_garments_request")
            .await;
        if let Err(s) = &accepted
            && s.code() != Code::Unavailable
        {
            return Err(s.clone());
        }
        // The choice is kept when cloth does not answer, and applied when it is back.
        handle.wanted.send_if_modified(|w| {
            let changed = w.choices != choices;
            if changed {
                w.revision += 1;
                (w.choices, w.sizes) = (choices, None);
            }
            changed
        });
        accepted?;
        Ok(Response::new(ChooseGarmentsResponse {
            outfit_revision: handle.wanted.borrow().revision,
        }))
    }

    async fn show_fit(
        &self,
        r: Request<ShowFitRequest>,
    ) -> Result<Response<ShowFitResponse>, Status> {
        let handle = self.find(&r, &r.get_ref().try_on_id)?;
        let r = r.get_ref();
        let gone = |_| not_found("try-on", &r.try_on_id);
        handle
            .commands
            .send(Command::ShowFit(r.show))
            .await
            .map_err(gone)?;
        Ok(Response::new(ShowFitResponse {}))
    }

    async fn list_garment_choices(
        &self,
        _: Request<ListGarmentChoicesRequest>,
    ) -> Result<Response<ListGarmentChoicesResponse>, Status> {
        let mut cloth = upstream::client(self.cloth.clone());
        let list = cloth.list_garments(call(ListGarmentsRequest {})).await;
        let garments = list
            .map_err(|s| from_upstream("cloth", &s))?
            .into_inner()
            .garments;
        Ok(Response::new(ListGarmentChoicesResponse { garments }))
    }

    async fn redeem_code(
        &self,
        r: Request<RedeemCodeRequest>,
    ) -> Result<Response<RedeemCodeResponse>, Status> {
        if !Grant::of(&r)?.is_nothing() {
            let why = "a code is for callers without a token, where tokens are asked for";
            return Err(Status::failed_precondition(why));
        }
        let Some(codes) = self.ctx.auth.enrolments() else {
            return Err(Status::unauthenticated("no codes are traded here"));
        };
        let caller = Caller::of(&r);
        let code = r.into_inner().code;
        let trade = tokio::task::spawn_blocking(move || codes.redeem(&code, &caller));
        let traded = trade.await.map_err(|e| Status::internal(e.to_string()))?;
        match traded {
            Ok(token) => Ok(Response::new(RedeemCodeResponse { token })),
            Err(EnrolFault::Folder(e)) => {
                tracing::error!(error = %e, "auth.enrolments cannot be read");
                Err(Status::unavailable("codes cannot be traded now"))
            }
            Err(e) => Err(Status::unauthenticated(e.to_string())),
        }
    }

    type StreamFramesStream = Pictures;

    async fn stream_frames(
        &self,
        r: Request<StreamFramesRequest>,
    ) -> Result<Response<Pictures>, Status> {
        let peer = r.remote_addr();
        let connection = r.extensions().get::<Consumption>().cloned();
        let format = request::picture_format(r.get_ref())?;
        let handle = self.find(&r, &r.get_ref().try_on_id)?;
        let r = r.get_ref();
        let gone = || not_found("try-on", &r.try_on_id);
        let (viewer, reader) = viewer(&r.try_on_id, format, peer);
        let (answer, is_admitted) = oneshot::channel();
        let view = Command::View(viewer, answer);
        handle.commands.send(view).await.map_err(|_| gone())?;
        is_admitted.await.map_err(|_| gone())??;
        Ok(Response::new(Box::pin(
            reader.paced_by(connection).stream(),
        )))
    }

    async fn acknowledge_frames(
        &self,
        r: Request<AcknowledgeFramesRequest>,
    ) -> Result<Response<AcknowledgeFramesResponse>, Status> {
        let handle = self.find(&r, &r.get_ref().try_on_id)?;
        let r = r.get_ref();
        let command = Command::Acknowledge(r.stream, r.number);
        let gone = |_| not_found("try-on", &r.try_on_id);
        handle.commands.send(command).await.map_err(gone)?;
        Ok(Response::new(AcknowledgeFramesResponse {}))
    }

    async fn take_snapshot(
        &self,
        r: Request<TakeSnapshotRequest>,
    ) -> Result<Response<TakeSnapshotResponse>, Status> {
        let encoding = Encoding::of_picture(r.get_ref().codec, "take_snapshot_request.codec")?;
        let handle = self.find(&r, &r.get_ref().try_on_id)?;
        let picture = snapshot(&handle, &r.get_ref().try_on_id, encoding).await?;
        Ok(Response::new(TakeSnapshotResponse {
            picture: Some(picture),
        }))
    }

    type TakeFinePictureStream = FineMessages;

    async fn take_fine_picture(
        &self,
        r: Request<TakeFinePictureRequest>,
    ) -> Result<Response<FineMessages>, Status> {
        let wish = r.get_ref();
        let work = FinePicture {
            vertices: fine_picture::vertices(wish.vertices)?,
            encoding: Encoding::of_picture(wish.codec, "take_fine_picture_request.codec")?,
            try_on_id: wish.try_on_id.clone(),
            handle: self.find(&r, &wish.try_on_id)?,
            cloth: self.cloth.clone(),
            card: self.card.clone(),
            pool: self.ctx.pool.clone(),
        };
        let place = work.handle.fine.clone().try_acquire_owned();
        let place = place.map_err(|_| exhausted("fine pictures of a try-on", 1))?;
        Ok(Response::new(ReceiverStream::new(work.spawn(place))))
    }

    async fn offer_photo(
        &self,
        r: Request<OfferPhotoRequest>,
    ) -> Result<Response<OfferPhotoResponse>, Status> {
        let id = &r.get_ref().try_on_id;
        let handle = self.find(&r, id)?;
        let origin = photos::origin(&self.config.public, r.metadata())?;
        let picture = snapshot(&handle, id, Encoding::Jpeg(PICTURE_QUALITY)).await?;
        let url = origin + &self.photos.offer(id, picture.image.clone())?;
        if let Err(gone) = self.find(&r, id) {
            // Its end came before the offer and found nothing to drop.
            self.photos.forget(id);
            return Err(gone);
        }
        Ok(Response::new(OfferPhotoResponse {
            qr_svg: photos::qr_svg(&url)?,
            url,
            seconds: photos::LIFE.as_secs_f32(),
            picture: Some(picture),
        }))
    }
}
