//! One viewer: its format, its rate, its queue, and what it has acknowledged.

use futures::Stream;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::sync::mpsc::error::TrySendError;
use tokio::time::Instant;
use tonic::Status;
use tryon_kit::queue::consumption::Consumption;
use tryon_kit::queue::latest;
use tryon_kit::queue::pace::Pace;
use tryon_kit::sessions::random_u64;
use tryon_proto::Message;
use tryon_proto::convert::request::PictureFormat;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::{Picture, StreamFramesResponse, TryOnState, TryOnStatus};

/// Statuses that wait for a slow reader. They are never dropped: a reader that fills the queue is cut off.
const STATUSES: usize = 64;
/// Time without an acknowledgement, while pictures are on the way, after which a reader is cut off.
const UNACKNOWLEDGED: Duration = Duration::from_secs(10);
/// Time without an acknowledgement after which a reader may be a lost kiosk, which must not keep the camera on.
const LOST: Duration = Duration::from_secs(2);
/// Age in the queue above which a picture is not sent any more: the next one is made within an exposure.
const FRESH: Duration = Duration::from_millis(100);
/// Bytes before each message: a flag and a length.
const GRPC_PREFIX: usize = 5;

/// The writing end.
pub(crate) struct Viewer {
    pub(crate) format: PictureFormat,
    /// Peer of its connection, which viewers on one connection have in common.
    pub(crate) connection: Option<SocketAddr>,
    /// Random name of its stream.
    stream: u64,
    /// Number of the newest message, and of the newest one acknowledged.
    sent: u64,
    acknowledged: u64,
    /// Last acknowledgement, or first message after one.
    moved: Instant,
    /// Last message, or picture that was left out.
    told: Instant,
    pictures: latest::Sender<QueuedPicture>,
    statuses: mpsc::Sender<(u64, TryOnStatus)>,
    next: Instant,
    /// Set when the reader is cut off for its slowness.
    is_cut_off: Arc<AtomicBool>,
}

/// Picture with its number and the time since which it waits.
struct QueuedPicture {
    queued: Instant,
    number: u64,
    picture: Picture,
}

/// The reading end.
pub(crate) struct Reader {
    try_on: String,
    stream: u64,
    /// The viewer waits for acknowledgements.
    is_acknowledged: bool,
    pictures: latest::Receiver<QueuedPicture>,
    statuses: mpsc::Receiver<(u64, TryOnStatus)>,
    is_cut_off: Arc<AtomicBool>,
    end: End,
    pace: Pace,
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

/// A viewer of a try-on, on that connection, and its reader.
pub(crate) fn viewer(
    try_on: &str,
    format: PictureFormat,
    connection: Option<SocketAddr>,
) -> (Viewer, Reader) {
    let (pictures, p) = latest::channel();
    let (statuses, s) = mpsc::channel(STATUSES);
    let (is_cut_off, stream) = (Arc::<AtomicBool>::default(), random_u64());
    (
        Viewer {
            format,
            connection,
            stream,
            sent: 0,
            acknowledged: 0,
            moved: Instant::now(),
            told: Instant::now(),
            pictures,
            statuses,
            next: Instant::now(),
            is_cut_off: is_cut_off.clone(),
        },
        Reader {
            try_on: try_on.into(),
            stream,
            is_acknowledged: format.window.is_some(),
            pictures: p,
            statuses: s,
            is_cut_off,
            end: End::Open,
            pace: Pace::new(None),
        },
    )
}

impl Viewer {
    /// Its rate allows a picture now.
    pub(crate) fn wants(&self) -> bool {
        self.next <= Instant::now()
    }
    /// It has not taken what was made for it: more would only wait.
    pub(crate) fn is_behind(&self) -> bool {
        let on_the_way = self.sent - self.acknowledged;
        let is_full = (self.format.window).is_some_and(|w| on_the_way >= u64::from(w));
        is_full || self.pictures.is_waiting()
    }
    /// Queues a picture in place of one that still waits.
    pub(crate) fn picture(&mut self, p: Picture) {
        self.wait_a_turn();
        let queued = QueuedPicture {
            queued: Instant::now(),
            number: self.next_number(),
            picture: p,
        };
        self.pictures.send(queued);
    }
    fn next_number(&mut self) -> u64 {
        self.told = Instant::now();
        if self.sent == self.acknowledged {
            self.moved = self.told;
        }
        self.sent += 1;
        self.sent
    }
    /// Counts a picture that was not made because the reader is behind.
    pub(crate) fn skip(&mut self) {
        // It has something to read, and the next picture comes as soon as it has.
        self.told = Instant::now();
        self.wait_a_turn();
        self.pictures.skip();
    }
    /// Counted from the time it was due: the rate is met on average, without bursts after a gap.
    fn wait_a_turn(&mut self) {
        let (step, now) = (self.format.interval, Instant::now());
        self.next = (self.next + step).max(now.checked_sub(step).unwrap_or(now));
    }
    /// Takes an acknowledgement, if it is of this stream and new.
    pub(crate) fn acknowledge(&mut self, stream: u64, number: u64) {
        if stream == self.stream && number > self.acknowledged {
            self.acknowledged = number.min(self.sent);
            self.moved = Instant::now();
        }
    }
    /// Messages are on the way to it, and it has acknowledged none for that long.
    fn is_silent_for(&self, time: Duration) -> bool {
        let is_awaited = self.format.window.is_some() && self.sent > self.acknowledged;
        is_awaited && self.moved.elapsed() > time
    }
    /// It takes its pictures, as far as it tells.
    pub(crate) fn is_watching(&self) -> bool {
        !self.is_silent_for(LOST)
    }
    /// The reader has gone, or acknowledges nothing: then it is cut off.
    pub(crate) fn is_over(&self) -> bool {
        let is_stuck = self.is_silent_for(UNACKNOWLEDGED);
        if is_stuck {
            self.is_cut_off.store(true, Ordering::Release);
        }
        is_stuck || self.statuses.is_closed()
    }
    /// Queues a status; `false` when the reader is gone or its queue is full. One that acknowledges and is behind gets only
    /// the end: the next picture or [`Self::repeat`] has the state of then.
    pub(crate) fn status(&mut self, s: TryOnStatus) -> bool {
        if self.format.window.is_some() && self.is_behind() && !is_end(&s) {
            return !self.statuses.is_closed();
        }
        let number = self.next_number();
        let sent = self.statuses.try_send((number, s));
        if matches!(sent, Err(TrySendError::Full(_))) {
            self.is_cut_off.store(true, Ordering::Release);
        }
        sent.is_ok()
    }
    /// Repeats the status when nothing was sent for `interval`. A reader that is behind has something to read.
    pub(crate) fn repeat(&mut self, s: &TryOnStatus, interval: Duration) -> bool {
        let is_due = self.told.elapsed() >= interval && !self.is_behind();
        !is_due || self.status(s.clone())
    }
}

fn is_end(s: &TryOnStatus) -> bool {
    matches!(s.state(), TryOnState::Closed | TryOnState::Draining)
}

impl Reader {
    /// Holds pictures back by what the reader's connection reports, unless it acknowledges messages itself.
    pub(crate) fn paced_by(self, connection: Option<Consumption>) -> Self {
        let connection = connection.filter(|_| !self.is_acknowledged);
        let pace = Pace::new(connection);
        Self { pace, ..self }
    }

    /// Statuses in order and before pictures. Ends when the viewer is dropped: with OK after CLOSED or DRAINING, else
    /// with the error that names the try-on.
    pub(crate) fn stream(self) -> impl Stream<Item = Result<StreamFramesResponse, Status>> {
        futures::stream::unfold(self, |mut r| async move {
            let (number, event) = tokio::select! {
                biased;
                Some((number, s)) = r.statuses.recv() => {
                    if is_end(&s) {
                        r.end = End::Announced;
                    }
                    (number, Event::Status(s))
                }
                Some((number, p)) = next_picture(&mut r.pictures, &mut r.pace, r.is_acknowledged) => (number, Event::Picture(p)),
                else => return r.fault().map(|s| (Err(s), Self { end: End::Told, ..r })),
            };
            let message = StreamFramesResponse {
                event: Some(event),
                stream: r.stream,
                number,
            };
            r.pace_by(&message);
            Some((Ok(message), r))
        })
    }

    fn pace_by(&mut self, message: &StreamFramesResponse) {
        let bytes = GRPC_PREFIX + message.encoded_len();
        match message.event {
            Some(Event::Picture(_)) => self.pace.hand(bytes),
            _ => self.pace.pass(bytes),
        }
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

/// The next picture and its number, once the pace lets it follow; one that waited for too long is dropped unless its
/// acknowledgement is awaited. Cancel safe.
async fn next_picture(
    pictures: &mut latest::Receiver<QueuedPicture>,
    pace: &mut Pace,
    is_awaited: bool,
) -> Option<(u64, Picture)> {
    loop {
        let has_room = pace.has_room() || pictures.is_closed();
        let next = tokio::select! {
            biased;
            next = pictures.recv(), if has_room => next?,
            () = pace.changed() => continue,
        };
        if is_awaited || next.queued.elapsed() <= FRESH {
            let dropped = pictures.dropped();
            let picture = Picture {
                dropped,
                ..next.picture
            };
            return Some((next.number, picture));
        }
        pictures.discard();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio_stream::StreamExt;
    use tonic::Code;

    const FORMAT: PictureFormat = PictureFormat {
        size: None,
        is_cropped: false,
        quality: 80,
        interval: Duration::ZERO,
        window: None,
    };

    fn status(state: TryOnState) -> TryOnStatus {
        TryOnStatus {
            state: state.into(),
            ..TryOnStatus::default()
        }
    }

    #[tokio::test]
    async fn an_end_that_nobody_announced_is_internal_and_names_the_try_on() {
        let (mut v, r) = viewer("shopper", FORMAT, None);
        v.status(status(TryOnState::Live));
        drop(v);
        let all: Vec<_> = r.stream().collect().await;
        let fault = all[1].as_ref().expect_err("an end without CLOSED");
        assert_eq!((all.len(), fault.code()), (2, Code::Internal));
        assert!(fault.message().contains("`shopper`"), "{fault}");
    }

    #[tokio::test]
    async fn an_announced_end_is_ok_and_a_full_queue_is_told() {
        let (mut v, r) = viewer("shopper", FORMAT, None);
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

        let (mut v, r) = viewer("shopper", FORMAT, None);
        while v.status(status(TryOnState::Live)) {}
        drop(v);
        let last = r.stream().collect::<Vec<_>>().await.pop().expect("an end");
        assert_eq!(last.expect_err("cut off").code(), Code::ResourceExhausted);
    }

    #[tokio::test]
    async fn slow_reader_receives_every_status_and_the_newest_picture() {
        let (mut v, r) = viewer("shopper", FORMAT, None);
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

    #[tokio::test]
    async fn a_full_window_waits_for_acknowledgements_and_skips_count() {
        let format = PictureFormat {
            window: Some(2),
            ..FORMAT
        };
        let (mut v, mut r) = viewer("shopper", format, None);
        for number in 1..=2 {
            assert!(!v.is_behind());
            v.picture(Picture::default());
            let (n, p) = next_picture(&mut r.pictures, &mut r.pace, true)
                .await
                .expect("queued");
            assert_eq!((n, p.dropped), (number, 0));
        }
        assert!(v.is_behind(), "two are on the way");
        v.skip();
        v.acknowledge(v.stream.wrapping_add(1), 2);
        assert!(v.is_behind(), "another stream's");
        v.acknowledge(v.stream, 1_000_000);
        v.acknowledge(v.stream, 1);
        assert_eq!((v.is_behind(), v.acknowledged), (false, 2));
        v.picture(Picture::default());
        let (_, p) = next_picture(&mut r.pictures, &mut r.pace, true)
            .await
            .expect("queued");
        assert_eq!(p.dropped, 1);
    }

    #[tokio::test]
    async fn a_reader_that_is_behind_gets_no_status_but_the_end() {
        let format = PictureFormat {
            window: Some(1),
            ..FORMAT
        };
        let (mut v, r) = viewer("shopper", format, None);
        assert!(v.status(status(TryOnState::Opening)));
        assert!(
            v.status(status(TryOnState::Live))
                && v.repeat(&status(TryOnState::Live), Duration::ZERO)
        );
        v.acknowledge(v.stream, 1);
        assert!(v.repeat(&status(TryOnState::Degraded), Duration::ZERO));
        assert!(v.status(status(TryOnState::Closed)));
        drop(v);
        let all: Vec<_> = r.stream().filter_map(Result::ok).collect().await;
        let states = all.iter().map(|m| match &m.event {
            Some(Event::Status(s)) => (m.number, s.state()),
            _ => panic!("a picture"),
        });
        let wanted = [
            (1, TryOnState::Opening),
            (2, TryOnState::Degraded),
            (3, TryOnState::Closed),
        ];
        assert_eq!(states.collect::<Vec<_>>(), wanted);
    }

    #[tokio::test]
    async fn a_reader_that_acknowledges_nothing_is_cut_off() {
        let format = PictureFormat {
            window: Some(1),
            ..FORMAT
        };
        let (mut v, r) = viewer("shopper", format, None);
        let long_ago = Instant::now().checked_sub(2 * UNACKNOWLEDGED);
        v.moved = long_ago.expect("the machine has run for a while");
        assert!(!v.is_over(), "there was no picture");
        v.picture(Picture::default());
        assert!(!v.is_over());
        v.moved = long_ago.expect("as above");
        assert!(v.is_over());
        drop(v);
        let last = r.stream().collect::<Vec<_>>().await.pop().expect("an end");
        assert_eq!(last.expect_err("cut off").code(), Code::ResourceExhausted);
    }

    #[tokio::test]
    async fn pictures_that_waited_for_too_long_are_not_sent() {
        let (mut v, mut r) = viewer("shopper", FORMAT, None);
        v.picture(Picture::default());
        assert!(v.is_behind());
        tokio::time::sleep(2 * FRESH).await;
        let next =
            tokio::spawn(async move { next_picture(&mut r.pictures, &mut r.pace, false).await });
        tokio::task::yield_now().await;
        assert!(!v.is_behind());
        v.picture(Picture::default());
        let (number, p) = next.await.expect("ends").expect("a picture");
        assert_eq!((number, p.dropped), (2, 1));
    }

    #[tokio::test]
    async fn a_picture_on_the_way_holds_back_the_next_unless_messages_are_acknowledged() {
        for (window, expected) in [(None, 1), (Some(8), 2)] {
            let (mut v, r) = viewer("shopper", PictureFormat { window, ..FORMAT }, None);
            let mut stream = Box::pin(r.paced_by(Some(Consumption::default())).stream());
            let mut got = 0;
            for _ in 0..2 {
                v.picture(Picture::default());
                let next = tokio::time::timeout(FRESH / 2, stream.next());
                got += usize::from(next.await.is_ok());
            }
            assert_eq!(got, expected, "{window:?}");
            assert_eq!(v.is_behind(), got == 1);
            v.status(status(TryOnState::Closed));
            drop(v);
            let rest: Vec<_> = stream.collect().await;
            assert!(rest.iter().all(Result::is_ok), "an end that was announced");
        }
    }
}
