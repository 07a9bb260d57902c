//! A session's garments on finer meshes on request: drape and motion, their owner, their end.

use crate::client;
use crate::kiosk::{PATIENCE, Part, wear};
use crate::requests::field;
use crate::tokens::Guarded;
use std::path::Path;
use std::time::Instant;
use tokio::time::timeout;
use tonic::{Code, Status, Streaming};
use tryon::formats::image::decode_color;
use tryon::geometry::math::P3;
use tryon_kit::auth::Connection;
use tryon_proto::convert::garment::{GarmentReader, topology_from_wire};
use tryon_proto::v1::cloth_service_client::ClothServiceClient;
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;
use tryon_proto::v1::start_simulation_request::Start;
use tryon_proto::v1::take_fine_picture_response::Content;
use tryon_proto::v1::*;

/// Session that is dressed.
const MINE: &str = "mine";
/// Vertices that are asked for.
const VERTICES: u32 = 1000;
/// Vertices of a drape that is still at work when it is cancelled or its session ends.
const LONG: u32 = 5000;
/// Largest message of cloth, bytes.
const MAX_BYTES: usize = 16 << 20;

type Cloth = ClothServiceClient<Connection>;
type Compositor = CompositorServiceClient<Connection>;

fn cloth(guarded: &Guarded, session: Option<&str>) -> Cloth {
    let token = guarded.token(|c| c.session = session.map(Into::into));
    ClothServiceClient::new(guarded.connect(Part::Cloth, Some(&token)))
        .max_decoding_message_size(MAX_BYTES)
}

fn drape(session: &str, vertices: u32) -> StartSimulationRequest {
    StartSimulationRequest {
        start: Some(Start::Session(SessionStart {
            session_id: session.into(),
            vertices,
            motion_seconds: 0.0,
        })),
        ..Default::default()
    }
}

fn motion(motion_seconds: f32) -> StartSimulationRequest {
    StartSimulationRequest {
        start: Some(Start::Session(SessionStart {
            session_id: MINE.into(),
            vertices: VERTICES,
            motion_seconds,
        })),
        ..Default::default()
    }
}

fn stream(session: &str) -> StreamGarmentsRequest {
    StreamGarmentsRequest {
        session_id: session.into(),
    }
}

fn follow(simulation_id: &str) -> FollowSimulationRequest {
    FollowSimulationRequest {
        simulation_id: simulation_id.into(),
        first_frame: 0,
    }
}

fn continuation(simulation_id: &str) -> StartSimulationRequest {
    StartSimulationRequest {
        start: Some(Start::SimulationId(simulation_id.into())),
        ..Default::default()
    }
}

fn cancel(simulation_id: &str) -> CancelSimulationRequest {
    CancelSimulationRequest {
        simulation_id: simulation_id.into(),
    }
}

/// Code and words.
fn told(s: &Status) -> (Code, &str) {
    (s.code(), s.message())
}

/// Garments as the live stream shows them.
struct Preview {
    stream: Streaming<StreamGarmentsResponse>,
    reader: GarmentReader,
}

impl Preview {
    /// Drawn vertices of the first message with garments from an exposure on.
    async fn from(&mut self, sequence: u64) -> Vec<P3> {
        loop {
            let next = timeout(PATIENCE, self.stream.message()).await;
            let message = next.expect("in time").expect("fine").expect("a message");
            let frame = message.frame.expect("a frame");
            let placed = self.reader.read(&frame).expect("readable");
            let is_later = frame.frame.is_some_and(|f| f.sequence >= sequence);
            if is_later && !placed.is_empty() {
                return placed.into_iter().flat_map(|(_, x)| x).collect();
            }
        }
    }
}

/// Tries of what a second without exposures ends, as it occurs on a busy machine: the body is forgotten then.
const TRIES: usize = 5;

/// Starts a simulation of the session once it wears garments and an earlier one has ended.
async fn start(
    c: &mut Cloth,
    preview: &mut Preview,
    request: &StartSimulationRequest,
) -> StartSimulationResponse {
    let begun = Instant::now();
    loop {
        preview.from(0).await;
        let refused = match c.start_simulation(request.clone()).await {
            Ok(started) => return started.into_inner(),
            Err(s) => s,
        };
        let waits = [Code::FailedPrecondition, Code::ResourceExhausted];
        let is_early = waits.contains(&refused.code()) && begun.elapsed() < PATIENCE;
        assert!(is_early, "{refused}");
    }
}

/// Steps and the frame of a drape.
async fn whole(c: &mut Cloth, id: &str) -> Result<(Vec<DrapeStep>, Vec<P3>), Status> {
    let mut frames = c.follow_simulation(follow(id)).await?;
    let (mut steps, mut positions) = (Vec::new(), Vec::new());
    while let Some(f) = frames.get_mut().message().await? {
        assert_eq!((f.frame, f.frame_count), (0, 1));
        assert!(positions.is_empty(), "the frame comes last");
        steps.extend(f.drape);
        let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let point = |b: &[u8]| P3::new(number(b), number(&b[4..]), number(&b[8..]));
        positions.extend(f.positions.chunks_exact(12).map(point));
    }
    Ok((steps, positions))
}

#[test]
fn a_session_is_draped_fine_for_its_owner_alone() {
    let guarded = Guarded::start("synth:still");
    client(async {
        let mut mine = cloth(&guarded, Some(MINE));
        faults_are_typed(&guarded, &mut mine).await;
        let token = guarded.token(|c| c.session = Some(MINE.into()));
        let mut compositor = guarded.compositor(Some(&token));
        let open = OpenTryOnRequest {
            try_on_id: MINE.into(),
            garments: wear(&["skirt"]),
            consent: Some(Consent { given: true }),
            ..Default::default()
        };
        compositor.open_try_on(open).await.expect("opened");
        let request = StreamFramesRequest {
            try_on_id: MINE.into(),
            ..Default::default()
        };
        // The camera runs while somebody watches.
        let pictures = compositor.stream_frames(request).await.expect("streams");
        let mut pictures = pictures.into_inner();
        tokio::spawn(async move { while let Ok(Some(_)) = pictures.message().await {} });
        let live = mine.stream_garments(stream(MINE)).await.expect("streams");
        let mut preview = Preview {
            stream: live.into_inner(),
            reader: GarmentReader::default(),
        };
        fine_is_near_the_preview(&mut mine, &mut preview).await;
        a_fine_picture_is_drawn(&guarded, &mut compositor, &mut preview).await;
        strangers_are_refused(&guarded, &mut mine, &mut preview).await;
        motion_is_recorded(&mut mine, &mut preview).await;
        a_cancelled_motion_continues(&guarded, &mut mine, &mut preview).await;

        let endless = start(&mut mine, &mut preview, &drape(MINE, LONG)).await;
        let endless = endless.simulation_id;
        let followed = mine.follow_simulation(follow(&endless)).await;
        let mut running = followed.expect("followed").into_inner();
        let close = CloseTryOnRequest {
            try_on_id: MINE.into(),
        };
        compositor.close_try_on(close).await.expect("closed");
        let end = async {
            loop {
                match running.message().await {
                    Ok(Some(m)) => assert!(m.positions.is_empty(), "it is not done"),
                    Ok(None) => panic!("a regular end"),
                    Err(status) => return status,
                }
            }
        };
        let end = timeout(PATIENCE, end).await.expect("forgotten in time");
        assert_eq!(end.code(), Code::NotFound, "{end}");
        let gone = mine.follow_simulation(follow(&endless)).await;
        assert_eq!(gone.expect_err("forgotten").code(), Code::NotFound);
    });
}

/// Wrong and early requests are refused by name.
async fn faults_are_typed(guarded: &Guarded, mine: &mut Cloth) {
    for vertices in [0, 50_001] {
        let refused = mine.start_simulation(drape(MINE, vertices)).await;
        let named = field(refused.expect_err("out of range"));
        assert_eq!(named, "start_simulation_request.session.vertices");
    }
    for seconds in [-1.0, 10.5, f32::NAN] {
        let refused = mine.start_simulation(motion(seconds)).await;
        let named = field(refused.expect_err("out of range"));
        assert_eq!(named, "start_simulation_request.session.motion_seconds");
    }
    let unknown = mine.start_simulation(continuation("unknown")).await;
    assert_eq!(unknown.expect_err("unknown").code(), Code::NotFound);
    let realtime = StartSimulationRequest {
        solver: ClothSolver::Realtime.into(),
        ..drape(MINE, VERTICES)
    };
    let named = field(mine.start_simulation(realtime).await.expect_err("realtime"));
    assert_eq!(named, "start_simulation_request.solver");
    let resumed = StartSimulationRequest {
        checkpoint: vec![1].into(),
        ..drape(MINE, VERTICES)
    };
    let named = field(mine.start_simulation(resumed).await.expect_err("resumed"));
    assert_eq!(named, "start_simulation_request.checkpoint");
    let nothing = StartSimulationRequest::default();
    let named = field(mine.start_simulation(nothing).await.expect_err("no start"));
    assert_eq!(named, "start_simulation_request.start");

    let mut store = cloth(guarded, None);
    let unknown = store.start_simulation(drape("nobody", VERTICES)).await;
    let same = store.stream_garments(stream("nobody")).await;
    assert_eq!(
        told(&unknown.expect_err("unknown")),
        told(&same.expect_err("unknown"))
    );
    let undressed = DressRequest {
        session_id: MINE.into(),
        ..DressRequest::default()
    };
    mine.dress(undressed).await.expect("wears nothing");
    let bare = mine.start_simulation(drape(MINE, VERTICES)).await;
    assert_eq!(bare.expect_err("bare").code(), Code::FailedPrecondition);
}

/// The drape of a session that is live.
async fn fine_is_near_the_preview(mine: &mut Cloth, preview: &mut Preview) {
    /// Mean and largest distance of cloth at rest from the vertices of the preview (m), which sways and whose edges are
    /// 25 mm long.
    const NEAR: [f32; 2] = [0.02, 0.08];
    for _ in 0..TRIES {
        let started = start(mine, preview, &drape(MINE, VERTICES)).await;
        let exposure = started.exposure.expect("an exposure");
        assert!(started.world_from_camera.is_some());
        let before = preview.from(exposure.sequence).await;
        let garments = started.garments.iter().map(topology_from_wire);
        let garments: Vec<_> = garments.collect::<Result<_, _>>().expect("topology");
        let count = started.vertex_count;
        assert_eq!((garments.len(), garments[0].vertices), (1, count as usize));
        assert!((VERTICES / 2..=2 * VERTICES).contains(&count), "{count}");

        let (steps, fine) = match whole(mine, &started.simulation_id).await {
            Ok(done) => done,
            Err(s) if s.code() == Code::NotFound => continue,
            Err(s) => panic!("{s}"),
        };
        let last = steps.last().expect("steps");
        // The finest mesh is left after a few steps, at rest or near it.
        assert!(last.vertex_count == count && last.motion < 5e-3, "{last:?}");
        assert_eq!(fine.len(), count as usize);
        let (mut sum, mut farthest) = (0.0, 0.0f32);
        for &v in &garments[0].drawn {
            let x = fine[v as usize];
            assert!(x.coords.iter().all(|c| c.is_finite()), "vertex {v}: {x}");
            let distances = before.iter().map(|y| (x - y).norm());
            let nearest = distances.fold(f32::INFINITY, f32::min);
            (sum, farthest) = (sum + nearest, farthest.max(nearest));
        }
        let mean = sum / garments[0].drawn.len() as f32;
        println!("{count} vertices, {mean} m from the preview in the mean, {farthest} m at most");
        assert!(mean < NEAR[0] && farthest < NEAR[1], "{mean} {farthest}");
        return;
    }
    panic!("always forgotten");
}

/// The compositor drapes and draws, for the owner, one picture at a time.
async fn a_fine_picture_is_drawn(guarded: &Guarded, mine: &mut Compositor, preview: &mut Preview) {
    let wish = |vertices| TakeFinePictureRequest {
        try_on_id: MINE.into(),
        vertices,
        ..Default::default()
    };
    let refused = mine.take_fine_picture(wish(50_001)).await;
    let named = field(refused.expect_err("out of range"));
    assert_eq!(named, "take_fine_picture_request.vertices");
    let token = guarded.token(|c| c.session = Some("stranger".into()));
    let mut stranger = guarded.compositor(Some(&token));
    let refused = stranger.take_fine_picture(wish(VERTICES)).await;
    let code = refused.expect_err("not theirs").code();
    assert_eq!(code, Code::PermissionDenied);
    for _ in 0..TRIES {
        preview.from(0).await;
        let taken = mine.take_fine_picture(wish(VERTICES)).await;
        let mut messages = taken.expect("begun").into_inner();
        let second = mine.take_fine_picture(wish(VERTICES)).await;
        let code = second.expect_err("one at a time").code();
        assert_eq!(code, Code::ResourceExhausted);
        let mut steps = 0;
        let picture = loop {
            match timeout(PATIENCE, messages.message())
                .await
                .expect("in time")
            {
                Ok(Some(m)) => match m.content.expect("content") {
                    Content::Drape(_) => steps += 1,
                    Content::Picture(picture) => break Some(picture),
                },
                Ok(None) => panic!("no picture"),
                Err(s) => {
                    let waits = [
                        Code::Aborted,
                        Code::ResourceExhausted,
                        Code::FailedPrecondition,
                    ];
                    assert!(waits.contains(&s.code()), "{s}");
                    break None;
                }
            }
        };
        let Some(picture) = picture else { continue };
        assert!(steps > 0, "steps are told");
        assert_eq!(picture.state(), TryOnState::Live);
        assert_eq!(picture.codec(), PictureCodec::Png);
        let drawn = decode_color(&picture.image, Path::new("fine.png")).expect("a picture");
        assert_eq!(
            (drawn.width(), drawn.height()),
            (picture.width, picture.height)
        );
        assert!(
            matches!(messages.message().await, Ok(None)),
            "it comes last"
        );
        return;
    }
    panic!("always aborted");
}

/// Exposures of the frames of a simulation and the number of frames that its last message says.
async fn exposures(
    c: &mut Cloth,
    started: &StartSimulationResponse,
) -> Result<(Vec<FrameId>, usize), Status> {
    let followed = c.follow_simulation(follow(&started.simulation_id)).await?;
    let mut followed = followed.into_inner();
    let (mut exposures, mut count) = (Vec::new(), 0);
    while let Some(m) = followed.message().await? {
        if !m.positions.is_empty() {
            assert_eq!(m.frame, started.first_frame + exposures.len() as u32);
            assert_eq!(m.positions.len(), 12 * started.vertex_count as usize);
            exposures.push(m.exposure.expect("an exposure"));
        }
        count = m.frame_count as usize;
    }
    Ok((exposures, count))
}

/// Each exposure of a short motion is a frame, in order.
async fn motion_is_recorded(mine: &mut Cloth, preview: &mut Preview) {
    const SECONDS: f32 = 0.2;
    for _ in 0..TRIES {
        let started = start(mine, preview, &motion(SECONDS)).await;
        assert_eq!(started.frame_count, 0, "not known yet");
        let (exposures, count) = match exposures(mine, &started).await {
            Ok(done) => done,
            Err(s) if s.code() == Code::NotFound => continue,
            Err(s) => panic!("{s}"),
        };
        let first = started.exposure.expect("an exposure");
        assert_eq!(exposures[0], first);
        let is_later = |w: &[FrameId]| w[0].capture_time_ns < w[1].capture_time_ns;
        assert!(exposures.windows(2).all(is_later), "{exposures:?}");
        let last = exposures[exposures.len() - 1].capture_time_ns;
        let length = (last - first.capture_time_ns) as f32 * 1e-9;
        println!("{count} frames in {length:.2} s of motion");
        assert!(exposures.len() > 1 && length <= SECONDS, "{length} s");
        assert_eq!(count, exposures.len());
        return;
    }
    panic!("always forgotten");
}

/// A motion that is cancelled during its drape and after its first frames goes on for its owner, numbered on.
async fn a_cancelled_motion_continues(guarded: &Guarded, mine: &mut Cloth, preview: &mut Preview) {
    for _ in 0..TRIES {
        match continued(guarded, mine, preview).await {
            Ok(()) => return,
            Err(s) if s.code() == Code::NotFound => {}
            Err(s) => panic!("{s}"),
        }
    }
    panic!("always forgotten");
}

/// NOT_FOUND when the body was forgotten.
async fn continued(
    guarded: &Guarded,
    mine: &mut Cloth,
    preview: &mut Preview,
) -> Result<(), Status> {
    const SECONDS: f32 = 0.2;
    let started = start(mine, preview, &motion(SECONDS)).await;
    let id = started.simulation_id;
    cannot_be_continued(mine, &id).await?;
    let cancelled = mine.cancel_simulation(cancel(&id)).await?.into_inner();
    assert_eq!(cancelled, CancelSimulationResponse::default());

    let mut theirs = cloth(guarded, Some("theirs"));
    let stranger = theirs.start_simulation(continuation(&id)).await;
    let followed = theirs.follow_simulation(follow(&id)).await;
    assert_eq!(
        told(&stranger.expect_err("start")),
        told(&followed.expect_err("follow"))
    );
    let anew = mine.start_simulation(continuation(&id)).await?.into_inner();
    assert_eq!(anew.first_frame, 0);
    let mut frames = mine.follow_simulation(follow(&anew.simulation_id)).await?;
    let mut published = 0;
    while published < 2 {
        let message = frames.get_mut().message().await?.expect("a frame");
        published += u32::from(!message.positions.is_empty());
    }
    let cancelled = mine.cancel_simulation(cancel(&anew.simulation_id)).await?;
    let cancelled = cancelled.into_inner();
    assert!(cancelled.next_frame >= 2 && cancelled.checkpoint.is_empty());

    let rest = mine.start_simulation(continuation(&anew.simulation_id));
    let rest = rest.await?.into_inner();
    let same = StartSimulationResponse {
        first_frame: cancelled.next_frame,
        frame_count: rest.frame_count,
        simulation_id: rest.simulation_id.clone(),
        ..started
    };
    assert!(rest == same, "other garments or another start");
    let (before, _) = exposures(mine, &anew).await?;
    let (after, count) = exposures(mine, &rest).await?;
    assert_eq!(before.len() + after.len(), count);
    let all: Vec<u64> = (before.iter().chain(&after))
        .map(|e| e.capture_time_ns)
        .collect();
    assert!(all.is_sorted_by(|a, b| a < b), "{all:?}");
    println!("{} frames and {} after them", before.len(), after.len());
    cannot_be_continued(mine, &anew.simulation_id).await?;
    cannot_be_continued(mine, &rest.simulation_id).await
}

/// An error that is not the expected refusal is returned.
async fn cannot_be_continued(c: &mut Cloth, id: &str) -> Result<(), Status> {
    let refused = c.start_simulation(continuation(id)).await;
    let refused = refused.expect_err("no frames are left");
    if refused.code() == Code::FailedPrecondition {
        Ok(())
    } else {
        Err(refused)
    }
}

/// Another session's token is refused as for the garments; the own one cancels, and no frame is left then.
async fn strangers_are_refused(guarded: &Guarded, mine: &mut Cloth, preview: &mut Preview) {
    let mut theirs = cloth(guarded, Some("theirs"));
    let garments = theirs.stream_garments(stream(MINE)).await;
    let garments = garments.expect_err("not theirs");
    assert_eq!(garments.code(), Code::PermissionDenied);
    let running = start(mine, preview, &drape(MINE, LONG)).await;
    let id = running.simulation_id;
    let another = theirs.start_simulation(drape(MINE, VERTICES)).await;
    let followed = theirs.follow_simulation(follow(&id)).await;
    let cancelled = theirs.cancel_simulation(cancel(&id)).await;
    for refused in [
        another.expect_err("start"),
        followed.expect_err("follow"),
        cancelled.expect_err("cancel"),
    ] {
        assert_eq!(told(&refused), told(&garments));
    }
    let second = mine.start_simulation(drape(MINE, VERTICES)).await;
    let busy = second.expect_err("one at a time").code();
    assert_eq!(busy, Code::ResourceExhausted);
    let next_frame = loop {
        match mine.cancel_simulation(cancel(&id)).await {
            Ok(cancelled) => break cancelled.into_inner().next_frame,
            // The step in work is a long one.
            Err(s) => assert_eq!(s.code(), Code::DeadlineExceeded, "{s}"),
        }
    };
    assert_eq!(next_frame, 0);
}
