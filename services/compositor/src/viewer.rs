//! One viewer: its format, its rate, its queue.

use futures::Stream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::mpsc;
use tokio::sync::mpsc::error::TrySendError;
use tokio::time::Instant;
use tonic::Status;
use tryon_kit::queue::latest;
use tryon_proto::convert::request::PictureFormat;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::{Picture, StreamFramesResponse, TryOnState, TryOnStatus};

/// Statuses that wait for a slow reader. They are never dropped: a reader that fills the queue is cut off.
const STATUSES: usize = 64;

/// The writing end.
pub(crate) struct Viewer {
    pub(crate) format: PictureFormat,
    pictures: latest::Sender<Picture>,
    statuses: mpsc::Sender<TryOnStatus>,
    next: Instant,
    /// Set when the reader is cut off for its slowness.
    is_cut_off: Arc<AtomicBool>,
}

/// The reading end.
pub(crate) struct Reader {
    try_on: String,
    pictures: latest::Receiver<Picture>,
    statuses: mpsc::Receiver<TryOnStatus>,
    is_cut_off: Arc<AtomicBool>,
    end: End,
}

/// End of a stream as far as its messages have announced it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    /// No end was announced.
    Open,
    /// A status with CLOSED or DRAINING has been sent.
    Announced,
    /// The status of the end has been sent.
    Told,
}

/// A viewer of a try-on and its reader.
pub(crate) fn viewer(try_on: &str, format: PictureFormat) -> (Viewer, Reader) {
    let (pictures, p) = latest::channel();
    let (statuses, s) = mpsc::channel(STATUSES);
    let is_cut_off = Arc::<AtomicBool>::default();
    (
        Viewer {
            format,
            pictures,
            statuses,
            next: Instant::now(),
            is_cut_off: is_cut_off.clone(),
        },
        Reader {
            try_on: try_on.into(),
            pictures: p,
            statuses: s,
            is_cut_off,
            end: End::Open,
        },
    )
}

impl Viewer {
    /// Its rate allows a picture now.
    pub(crate) fn wants(&self) -> bool {
        self.next <= Instant::now()
    }
    /// Queues a picture in place of one that still waits.
    pub(crate) fn picture(&mut self, p: Picture) {
        // Counted from the time it was due: the rate is met on average, without bursts after a gap.
        let (step, now) = (self.format.interval, Instant::now());
        self.next = (self.next + step).max(now.checked_sub(step).unwrap_or(now));
        self.pictures.send(p);
    }
    /// Queues a status; `false` when the reader is gone or its queue is full.
    pub(crate) fn status(&self, s: TryOnStatus) -> bool {
        let sent = self.statuses.try_send(s);
        if matches!(sent, Err(TrySendError::Full(_))) {
            self.is_cut_off.store(true, Ordering::Release);
        }
        sent.is_ok()
    }
    pub(crate) fn is_gone(&self) -> bool {
        self.statuses.is_closed()
    }
}

impl Reader {
    /// Statuses in order and before pictures. Ends when the viewer is dropped: with OK after CLOSED or DRAINING, else
    /// with the error that names the try-on.
    pub(crate) fn stream(self) -> impl Stream<Item = Result<StreamFramesResponse, Status>> {
        futures::stream::unfold(self, |mut r| async move {
            let event = tokio::select! {
                biased;
                Some(s) = r.statuses.recv() => {
                    if matches!(s.state(), TryOnState::Closed | TryOnState::Draining) {
                        r.end = End::Announced;
                    }
                    Event::Status(s)
                }
                Some(p) = r.pictures.recv() => Event::Picture(Picture { dropped: r.pictures.dropped(), ..p }),
                else => return r.fault().map(|s| (Err(s), Self { end: End::Told, ..r })),
            };
            Some((Ok(StreamFramesResponse { event: Some(event) }), r))
        })
    }

    /// Status of an end that no message announced.
    fn fault(&self) -> Option<Status> {
        if self.end != End::Open {
            return None;
        }
        if self.is_cut_off.load(Ordering::Acquire) {
            let why = format!("the reader of try-on `{}` is too slow", self.try_on);
            return Some(Status::resource_exhausted(why));
        }
        Some(Status::internal(format!(
            "try-on `{}` has failed; open it again",
            self.try_on
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::time::Duration;
    use tokio_stream::StreamExt;
    use tonic::Code;

    const FORMAT: PictureFormat = PictureFormat {
        size: None,
        quality: 80,
        interval: Duration::ZERO,
    };

    fn status(state: TryOnState) -> TryOnStatus {
        TryOnStatus {
            state: state.into(),
            ..TryOnStatus::default()
        }
    }

    #[tokio::test]
    async fn an_end_that_nobody_announced_is_internal_and_names_the_try_on() {
        let (v, r) = viewer("shopper", FORMAT);
        v.status(status(TryOnState::Live));
        drop(v);
        let all: Vec<_> = r.stream().collect().await;
        let fault = all[1].as_ref().expect_err("an end without CLOSED");
        assert_eq!((all.len(), fault.code()), (2, Code::Internal));
        assert!(fault.message().contains("`shopper`"), "{fault}");
    }

    #[tokio::test]
    async fn an_announced_end_is_ok_and_a_full_queue_is_told() {
        let (v, r) = viewer("shopper", FORMAT);
        v.status(status(TryOnState::Closed));
        drop(v);
        assert_eq!(
            r.stream()
                .filter(|m| m.is_err())
                .collect::<Vec<_>>()
                .await
                .len(),
            0
        );

        let (v, r) = viewer("shopper", FORMAT);
        while v.status(status(TryOnState::Live)) {}
        drop(v);
        let last = r.stream().collect::<Vec<_>>().await.pop().expect("an end");
        assert_eq!(last.expect_err("cut off").code(), Code::ResourceExhausted);
    }

    #[tokio::test]
    async fn slow_reader_receives_every_status_and_the_newest_picture() {
        let (mut v, r) = viewer("shopper", FORMAT);
        for i in 0..5 {
            v.picture(Picture {
                width: i,
                ..Picture::default()
            });
            assert!(v.status(TryOnStatus {
                age: i as f32,
                ..TryOnStatus::default()
            }));
        }
        drop(v);
        let all: Vec<_> = r
            .stream()
            .filter_map(Result::ok)
            .map(|m| m.event.expect("something"))
            .collect()
            .await;
        let ages: Vec<f32> = all
            .iter()
            .filter_map(|e| {
                if let Event::Status(s) = e {
                    Some(s.age)
                } else {
                    None
                }
            })
            .collect();
        assert_eq!(ages, [0.0, 1.0, 2.0, 3.0, 4.0]);
        let last = all.iter().find_map(|e| {
            if let Event::Picture(p) = e {
                Some((p.width, p.dropped))
            } else {
                None
            }
        });
        assert_eq!(last, Some((4, 4)));
    }
}
