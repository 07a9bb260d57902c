//! The newest frame of a sender, until the reader takes it.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use tokio::sync::mpsc::Sender;
use tokio_util::sync::CancellationToken;
use tonic::Status;
use tryon_proto::v1::{CameraFrame, FrameOutcome, PublishFramesResponse};

/// Answers to a sender.
pub(super) type Answers = Sender<Result<PublishFramesResponse, Status>>;

struct State {
    waiting: Option<CameraFrame>,
    /// Dropped on closing: the call ends with the last holder.
    answers: Option<Answers>,
    /// Frames replaced by newer ones.
    replaced: u64,
}

/// One place for a frame, with the answers of all that pass through it.
pub(crate) struct Newest {
    state: Mutex<State>,
    changed: Condvar,
    closed: CancellationToken,
}

impl Newest {
    pub(super) fn new(answers: Answers) -> Self {
        Self {
            state: Mutex::new(State {
                waiting: None,
                answers: Some(answers),
                replaced: 0,
            }),
            changed: Condvar::new(),
            closed: CancellationToken::new(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a frame in place of the one that waits.
    pub(super) fn put(&self, frame: CameraFrame) {
        let mut state = self.state();
        let before = state.waiting.replace(frame);
        state.replaced += u64::from(before.is_some());
        drop(state);
        self.changed.notify_one();
        if let Some(before) = before {
            self.answer(before.number, FrameOutcome::Replaced, String::new());
        }
    }

    /// Waits for a frame; `None` once closed.
    pub(super) fn take(&self) -> Option<CameraFrame> {
        let mut state = self.state();
        while !self.closed.is_cancelled() {
            if let Some(frame) = state.waiting.take() {
                return Some(frame);
            }
            let woken = self.changed.wait(state);
            state = woken.unwrap_or_else(PoisonError::into_inner);
        }
        None
    }

    /// Answers a frame. A sender that reads no answers gets no more than wait for it.
    pub(super) fn answer(&self, number: u64, outcome: FrameOutcome, detail: String) {
        let state = self.state();
        if let Some(answers) = &state.answers {
            let _ = answers.try_send(Ok(PublishFramesResponse {
                number,
                outcome: outcome.into(),
                detail,
                replaced: state.replaced,
            }));
        }
    }

    /// Takes and gives no more frames.
    pub(crate) fn close(&self) {
        let mut state = self.state();
        (state.waiting, state.answers) = (None, None);
        self.closed.cancel();
        drop(state);
        self.changed.notify_all();
    }

    /// Resolves once closed.
    pub(super) async fn closed(&self) {
        self.closed.cancelled().await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use tokio::sync::mpsc;

    fn frame(number: u64) -> CameraFrame {
        CameraFrame {
            number,
            ..CameraFrame::default()
        }
    }

    #[test]
    fn the_newest_wins_and_each_replaced_one_is_answered() {
        let (answers, mut told) = mpsc::channel(8);
        let newest = Newest::new(answers);
        (1..=3).for_each(|n| newest.put(frame(n)));
        assert_eq!(newest.take().map(|f| f.number), Some(3));
        newest.answer(3, FrameOutcome::Taken, String::new());
        let mut next = || {
            told.try_recv()
                .ok()
                .and_then(Result::ok)
                .map(|a| (a.number, a.replaced))
        };
        assert_eq!(
            [next(), next(), next()],
            [Some((1, 1)), Some((2, 2)), Some((3, 2))]
        );
        assert_eq!(next(), None);
    }

    #[test]
    fn closing_wakes_who_waits() {
        let newest = Arc::new(Newest::new(mpsc::channel(1).0));
        let waiting = std::thread::spawn({
            let newest = newest.clone();
            move || newest.take().is_none()
        });
        newest.close();
        assert!(waiting.join().expect("ended"));
        newest.put(frame(1));
        assert!(newest.take().is_none());
    }
}
