//! Progress of a simulation: its thread publishes frames and steps, readers follow them.

use bytes::Bytes;
use std::ops::ControlFlow;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::watch;
use tonic::Status;
use tryon::geometry::math::P3;
use tryon_proto::v1::{DrapeStep, FollowSimulationResponse, FrameId};

/// Frame stream of one reader.
pub(crate) type Frames =
    Pin<Box<dyn futures::Stream<Item = Result<FollowSimulationResponse, Status>> + Send>>;

/// Most memory for the frames of one simulation, bytes: 10 s of 20,000 vertices at 60 frames/s take 144 MB.
pub(crate) const MAX_RESULT_BYTES: usize = 256 << 20;

/// A finished frame.
#[derive(Clone)]
struct Finished {
    positions: Bytes,
    /// Exposure of its body.
    exposure: Option<FrameId>,
    /// Computing time (ms).
    ms: f32,
    /// Estimated computing time of the frames after it (s).
    seconds_left: f32,
}

/// Progress of a simulation. `frames` only grows until it is forgotten.
#[derive(Default)]
pub(crate) struct Progress {
    /// First frame that is computed.
    first: u32,
    /// The frame after the last; 0 while it isn't known.
    frame_count: u32,
    frames: Vec<Finished>,
    /// Newest step of a drape.
    drape: Option<DrapeStep>,
    /// State after the last frame of a cancelled simulation.
    checkpoint: Bytes,
    is_cancelled: bool,
    end: Option<Result<(), Status>>,
}

/// Progress as its thread, its readers and its directory share it.
pub(crate) type SharedProgress = Arc<watch::Sender<Progress>>;

impl Progress {
    /// A simulation of these frames: the first that is computed, and the one after the last or 0 while it isn't known.
    pub(crate) fn of([first, frame_count]: [u32; 2]) -> SharedProgress {
        Arc::new(watch::Sender::new(Self {
            first,
            frame_count,
            ..Self::default()
        }))
    }

    pub(crate) fn frame_count(&self) -> u32 {
        self.frame_count
    }

    /// Asks the simulation to end after the frame in work.
    pub(crate) fn cancel(&mut self) {
        self.is_cancelled = true;
    }

    /// Ends the simulation unless it has ended.
    pub(crate) fn finish(&mut self, end: Result<(), Status>) {
        self.end.get_or_insert(end);
    }

    /// Drops everything that was published; nothing more is taken.
    pub(crate) fn forget(&mut self) {
        *self = Self {
            end: Some(Err(Status::not_found("the simulation was forgotten"))),
            ..Self::default()
        };
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.end.is_some()
    }

    /// The frame after the last finished one, and the state after that one if it was cancelled.
    pub(crate) fn outcome(&self) -> (u32, Bytes) {
        (self.next_frame(), self.checkpoint.clone())
    }

    fn next_frame(&self) -> u32 {
        self.first + self.frames.len() as u32
    }

    /// Message of frame `next`, or of the step of a drape before it unless that is `seen`; `None` before there is one.
    fn message(&self, next: u32, seen: Option<&DrapeStep>) -> Option<FollowSimulationResponse> {
        let finished = self.frames.get(next.checked_sub(self.first)? as usize);
        if finished.is_none() && (self.drape.is_none() || self.drape.as_ref() == seen) {
            return None;
        }
        let mut message = FollowSimulationResponse {
            frame: next,
            frame_count: self.frame_count,
            drape: self.drape,
            ..Default::default()
        };
        if let Some(done) = finished.cloned() {
            (message.positions, message.ms) = (done.positions, done.ms);
            (message.seconds_left, message.exposure) = (done.seconds_left, done.exposure);
        }
        Some(message)
    }
}

/// All frames that are computed, from `next` on; then the end.
pub(crate) fn follow(progress: watch::Receiver<Progress>, next: u32) -> Frames {
    let first = progress.borrow().first;
    let start = Some((next.max(first), None, progress));
    Box::pin(futures::stream::unfold(start, move |at| async move {
        let (mut next, seen, mut progress) = at?;
        let message = {
            let known = progress
                .wait_for(|p| p.has_ended() || p.message(next, seen.as_ref()).is_some())
                .await;
            match known {
                Ok(p) => match (p.message(next, seen.as_ref()), &p.end) {
                    (Some(message), _) => Ok(message),
                    (None, Some(Err(why))) => Err(why.clone()),
                    (None, _) => return None,
                },
                Err(_) => Err(Status::aborted("the simulation broke off")),
            }
        };
        match message {
            Ok(message) => {
                next += u32::from(!message.positions.is_empty());
                let seen = message.drape;
                Some((Ok(message), Some((next, seen, progress))))
            }
            Err(why) => Some((Err(why), None)),
        }
    }))
}

/// Frames and steps on their way to the readers.
pub(crate) struct Publisher {
    progress: SharedProgress,
    started: Instant,
    last: Instant,
    published: u32,
}

impl Publisher {
    /// A simulation that begins now.
    pub(crate) fn new(progress: SharedProgress) -> Self {
        let now = Instant::now();
        Self {
            progress,
            started: now,
            last: now,
            published: 0,
        }
    }

    /// Adds a frame, of an exposure if it follows a body; breaks off when cancelled or forgotten.
    pub(crate) fn publish(
        &mut self,
        positions: &[P3],
        exposure: Option<FrameId>,
    ) -> ControlFlow<()> {
        let positions: Vec<u8> = positions
            .iter()
            .flat_map(|p| [p.x, p.y, p.z])
            .flat_map(f32::to_le_bytes)
            .collect();
        self.published += 1;
        let mean = self.started.elapsed().as_secs_f32() / self.published as f32;
        let ms = self.last.elapsed().as_secs_f32() * 1e3;
        self.last = Instant::now();
        self.update(|p| {
            let left = p.frame_count.saturating_sub(p.next_frame() + 1);
            p.frames.push(Finished {
                positions: positions.into(),
                exposure,
                ms,
                seconds_left: mean * left as f32,
            });
        })
    }

    /// Makes it known that `more` frames follow.
    pub(crate) fn expect(&self, more: usize) {
        // Cancelled or not, the number is right.
        let _: ControlFlow<()> = self.update(|p| p.frame_count = p.next_frame() + more as u32);
    }

    /// Shows a step of a drape; breaks off when cancelled or forgotten.
    pub(crate) fn show(&self, step: DrapeStep) -> ControlFlow<()> {
        self.update(|p| p.drape = Some(step))
    }

    /// Keeps the state after the last frame of a cancelled simulation.
    pub(crate) fn keep(&self, checkpoint: Bytes) -> ControlFlow<()> {
        self.update(|p| p.checkpoint = checkpoint)
    }

    /// True after [`Progress::cancel`] and [`Progress::forget`].
    pub(crate) fn is_cancelled(&self) -> bool {
        let progress = self.progress.borrow();
        progress.is_cancelled || progress.has_ended()
    }

    fn update(&self, change: impl FnOnce(&mut Progress)) -> ControlFlow<()> {
        self.progress.send_if_modified(|p| {
            let is_kept = !p.has_ended();
            if is_kept {
                change(p);
            }
            is_kept
        });
        if self.is_cancelled() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures::StreamExt;
    use tonic::Code;

    fn step(steps: u32) -> DrapeStep {
        DrapeStep {
            steps,
            ..Default::default()
        }
    }

    fn run(frames: u32) -> (SharedProgress, Publisher) {
        let progress = Progress::of([0, frames]);
        (progress.clone(), Publisher::new(progress))
    }

    #[tokio::test]
    async fn readers_see_the_newest_step_then_every_frame() {
        let (progress, mut publisher) = run(2);
        let mut early = follow(progress.subscribe(), 0);
        let mut next = async || early.next().await.map(|m| m.expect("a message"));
        assert!(publisher.show(step(1)).is_continue() && publisher.show(step(2)).is_continue());
        let first = next().await.expect("a step");
        assert_eq!((first.frame, first.drape), (0, Some(step(2))));
        assert!(first.positions.is_empty());
        for x in [1.0, 2.0] {
            assert!(
                publisher
                    .publish(&[P3::new(x, 0.0, 0.0)], None)
                    .is_continue()
            );
        }
        progress.send_modify(|p| p.finish(Ok(())));
        for (frame, x) in [(0, 1.0f32), (1, 2.0)] {
            let m = next().await.expect("a frame");
            assert_eq!((m.frame, m.frame_count), (frame, 2));
            assert_eq!(m.positions[..4], x.to_le_bytes());
        }
        assert_eq!(next().await, None, "no step comes after the frames");
        let late: Vec<_> = follow(progress.subscribe(), 1).collect().await;
        assert_eq!(late.len(), 1, "from the second frame on, without steps");
    }

    #[tokio::test]
    async fn the_number_of_frames_is_known_once_the_recording_is() {
        let (progress, mut publisher) = run(0);
        let mut reader = follow(progress.subscribe(), 0);
        let exposure = FrameId {
            sequence: 7,
            ..Default::default()
        };
        assert!(
            publisher
                .publish(&[P3::origin()], Some(exposure))
                .is_continue()
        );
        publisher.expect(2);
        let counted = reader.next().await.expect("a frame").expect("a message");
        assert_eq!((counted.frame_count, counted.exposure), (3, Some(exposure)));
        assert!(publisher.publish(&[P3::origin()], None).is_continue());
        publisher.expect(0);
        progress.send_modify(|p| p.finish(Ok(())));
        let last = reader.next().await.expect("a frame").expect("a message");
        assert_eq!((last.frame, last.frame_count), (1, 2));
        assert!(reader.next().await.is_none());
    }

    #[tokio::test]
    async fn nothing_is_left_of_a_simulation_that_is_forgotten() {
        let (progress, mut publisher) = run(9);
        let mut reader = follow(progress.subscribe(), 0);
        assert!(publisher.publish(&[P3::origin()], None).is_continue());
        progress.send_modify(Progress::forget);
        assert!(publisher.publish(&[P3::origin()], None).is_break());
        assert!(publisher.show(step(1)).is_break() && publisher.keep(vec![1].into()).is_break());
        progress.send_modify(|p| p.finish(Ok(())));
        assert_eq!(progress.borrow().outcome(), (0, Bytes::new()));
        let end = reader.next().await.expect("an end").expect_err("forgotten");
        assert_eq!(end.code(), Code::NotFound);
        assert!(reader.next().await.is_none());
    }
}
