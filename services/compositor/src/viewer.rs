//! One viewer: its format, its rate, its queue.

use futures::Stream;
use tokio::sync::mpsc;
use tokio::time::{Duration, Instant};
use tonic::Status;
use tryon_kit::queue::latest;
use tryon_proto::convert::request::PictureFormat;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::{Picture, StreamFramesResponse, TryOnStatus};

/// Statuses that wait for a slow reader. They are never dropped: a reader that fills the queue is cut off.
const STATUSES: usize = 64;

/// The writing end.
pub(crate) struct Viewer {
    pub(crate) format: PictureFormat,
    pictures: latest::Sender<Picture>,
    statuses: mpsc::Sender<TryOnStatus>,
    next: Instant,
}

/// The reading end.
pub(crate) struct Reader {
    pictures: latest::Receiver<Picture>,
    statuses: mpsc::Receiver<TryOnStatus>,
}

/// A viewer and its reader.
pub(crate) fn viewer(format: PictureFormat) -> (Viewer, Reader) {
    let (pictures, p) = latest::channel();
    let (statuses, s) = mpsc::channel(STATUSES);
    (
        Viewer {
            format,
            pictures,
            statuses,
            next: Instant::now(),
        },
        Reader {
            pictures: p,
            statuses: s,
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
        if let Some(rate) = self.format.max_rate {
            // Counted from the time it was due: the rate is met on average, without bursts after a gap.
            let step = Duration::from_secs_f32(1.0 / rate);
            let now = Instant::now();
            self.next = (self.next + step).max(now.checked_sub(step).unwrap_or(now));
        }
        self.pictures.send(p);
    }
    /// Queues a status; `false` when the reader is gone or its queue is full.
    pub(crate) fn status(&self, s: TryOnStatus) -> bool {
        self.statuses.try_send(s).is_ok()
    }
    pub(crate) fn is_gone(&self) -> bool {
        self.statuses.is_closed()
    }
}

impl Reader {
    /// Statuses in order and before pictures; ends when the viewer is dropped.
    pub(crate) fn stream(self) -> impl Stream<Item = Result<StreamFramesResponse, Status>> {
        futures::stream::unfold(self, |mut r| async move {
            let event = tokio::select! {
                biased;
                Some(s) = r.statuses.recv() => Event::Status(s),
                Some(p) = r.pictures.recv() => Event::Picture(Picture { dropped: r.pictures.dropped(), ..p }),
                else => return None,
            };
            Some((Ok(StreamFramesResponse { event: Some(event) }), r))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio_stream::StreamExt;

    #[tokio::test]
    async fn slow_reader_receives_every_status_and_the_newest_picture() {
        let (mut v, r) = viewer(PictureFormat {
            size: None,
            quality: 80,
            max_rate: None,
        });
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
            .map(|m| m.expect("fine").event.expect("something"))
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
