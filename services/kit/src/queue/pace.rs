//! Pace of a stream whose reader acknowledges nothing: the next message waits until the reader has taken those on the
//! way, as far as the windows of its connection show it.
//!
//! Libraries of gRPC grant a stream's window as the application takes its messages. Some grant each message, if they
//! have something to send, such as the answer to a PING; others grant half a window at a time, which shows nothing of
//! single messages. The streams of a connection are counted together: a slow one delays the others.

use super::consumption::{Consumption, Counts};
use std::collections::VecDeque;
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::Instant;

/// Most messages on the way to a reader that takes them at once. Less costs rate over long distances (3 a round trip),
/// more is what waits when such a reader becomes slow.
const QUICK_MESSAGES: usize = 3;
/// Time within which a quick reader takes a message, round trip included.
const QUICK: Duration = Duration::from_millis(250);
/// Messages in a row that a quick reader has taken so. One that takes a message a second begins with one or two.
const QUICK_IN_A_ROW: u32 = 4;
/// Time without any grant after which a reader counts as one that grants in large steps.
const UNREPORTED: Duration = Duration::from_millis(300);
/// The same while the steps are unknown: the first picture waits so long for a reader that has yet to begin. grpc-core
/// grants two messages at once if both have come before the first is read.
const FIRST_PATIENCE: Duration = Duration::from_millis(100);
/// Least time after which a message follows one that the reader seems not to have taken. Less than a second would queue
/// messages for a reader of one a second.
const PATIENCE: Duration = Duration::from_millis(1200);
/// Doublings of patience at most: longer pauses would look like an end.
const MOST_DOUBLINGS: u32 = 3;
/// First and longest pause before the reader is asked again, and patience is checked. Each question costs a frame in both
/// directions.
const ASK: (Duration, Duration) = (Duration::from_millis(5), Duration::from_millis(100));

/// Message that the reader has not taken.
#[derive(Clone, Copy, Debug)]
struct OnTheWay {
    /// Place of its last byte on the connection.
    end: u64,
    size: u64,
    handed: Instant,
}

impl OnTheWay {
    /// Half of it is enough: the rest is less than a step.
    fn is_taken(&self, counts: &Counts) -> bool {
        counts.granted + self.size / 2 >= self.end
    }

    /// It has left, so that the reader could have taken it. What its window does not take in waits here.
    fn is_sent(&self, counts: &Counts) -> bool {
        counts.sent + self.size / 8 >= self.end
    }
}

/// Steps in which a reader grants its window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Steps {
    Unknown,
    /// Half a message at most.
    Small,
    /// Grants say nothing of single messages, and nothing is held back.
    Large,
}

/// Pace of one stream.
pub struct Pace {
    /// `None` where the transport reports nothing.
    connection: Option<(Consumption, watch::Receiver<Counts>)>,
    on_the_way: VecDeque<OnTheWay>,
    steps: Steps,
    /// Size of the newest message that was handed on.
    size: u64,
    /// Place of the last byte of the newest message.
    end: u64,
    /// Time in which the last message taken was taken.
    delay: Duration,
    quick_in_a_row: u32,
    /// Messages handed on since then because patience was over.
    overdue: u32,
    /// Next question, and the pause after it.
    ask: (Instant, Duration),
}

impl Pace {
    /// Pace of a stream on that connection; none without one.
    pub fn new(connection: Option<Consumption>) -> Self {
        Self {
            connection: connection.map(|c| {
                let counts = c.counts();
                (c, counts)
            }),
            on_the_way: VecDeque::new(),
            steps: Steps::Unknown,
            size: 0,
            end: 0,
            delay: Duration::ZERO,
            quick_in_a_row: 0,
            overdue: 0,
            ask: (Instant::now(), ASK.0),
        }
    }

    /// Counts a message of so many bytes that is never held back. Those that are wait for it.
    pub fn pass(&mut self, bytes: usize) {
        if let Some(message) = self.place(bytes, Instant::now()) {
            self.put(message);
        }
    }

    /// Counts a message of so many bytes as handed on.
    pub fn hand(&mut self, bytes: usize) {
        self.hand_at(bytes, Instant::now());
    }

    fn hand_at(&mut self, bytes: usize, now: Instant) {
        if let Some(message) = self.place(bytes, now) {
            self.size = message.size;
            self.overdue += u32::from(self.on_the_way.len() >= self.most());
            self.put(message);
        }
    }

    /// Place of a message behind those before; `None` where nothing is reported.
    fn place(&mut self, bytes: usize, now: Instant) -> Option<OnTheWay> {
        let sent = self.connection.as_ref()?.1.borrow().sent;
        // With nothing on the way an error in the sizes so far is forgotten.
        let is_idle = self.on_the_way.is_empty();
        let begin = if is_idle { sent } else { self.end.max(sent) };
        let size = bytes as u64;
        self.end = begin + size;
        Some(OnTheWay {
            end: self.end,
            size,
            handed: now,
        })
    }

    fn put(&mut self, message: OnTheWay) {
        self.ask = (message.handed + ASK.0, ASK.0);
        self.on_the_way.push_back(message);
    }

    /// The next message may follow.
    pub fn has_room(&mut self) -> bool {
        self.has_room_at(Instant::now())
    }

    fn has_room_at(&mut self, now: Instant) -> bool {
        self.settle(now);
        let is_free = self.steps == Steps::Large || self.on_the_way.len() < self.most();
        is_free || self.is_overdue(now)
    }

    /// Most messages on the way.
    fn most(&self) -> usize {
        let is_quick = self.quick_in_a_row >= QUICK_IN_A_ROW;
        if is_quick { QUICK_MESSAGES } else { 1 }
    }

    /// The newest message has left, and waited for longer than this reader takes.
    fn is_overdue(&self, now: Instant) -> bool {
        let (Some((_, counts)), Some(newest)) = (&self.connection, self.on_the_way.back()) else {
            return true;
        };
        let age = now.duration_since(newest.handed);
        newest.is_sent(&counts.borrow()) && age >= self.patience()
    }

    /// Doubles with each message: a reader as slow as patience would never catch up.
    fn patience(&self) -> Duration {
        if self.steps == Steps::Unknown {
            return FIRST_PATIENCE;
        }
        PATIENCE.max(2 * self.delay) * (1 << self.overdue.min(MOST_DOUBLINGS))
    }

    /// Drops what the reader has taken.
    fn settle(&mut self, now: Instant) {
        let Some((_, counts)) = &mut self.connection else {
            return;
        };
        let counts = *counts.borrow_and_update();
        self.steps = match self.steps {
            _ if 2 * u64::from(counts.step) <= self.size => Steps::Small,
            Steps::Large => Steps::Large,
            // One large grant may be a whole window that is smaller than the message.
            _ if !self.is_unreported(&counts, now) => Steps::Unknown,
            _ => Steps::Large,
        };
        // A message is taken when a later one is.
        let last = self.on_the_way.iter().rposition(|m| m.is_taken(&counts));
        for m in self.on_the_way.drain(..last.map_or(0, |i| i + 1)) {
            (self.delay, self.overdue) = (now.duration_since(m.handed), 0);
            let is_quick = self.delay < QUICK;
            self.quick_in_a_row = if is_quick { self.quick_in_a_row + 1 } else { 0 };
        }
        if self.steps == Steps::Large {
            self.on_the_way.clear();
            self.overdue = 0;
        }
    }

    /// Everything on the way has left, and the reader has had its time to report.
    fn is_unreported(&self, counts: &Counts, now: Instant) -> bool {
        let (Some(oldest), Some(newest)) = (self.on_the_way.front(), self.on_the_way.back()) else {
            return false;
        };
        newest.is_sent(counts) && now.duration_since(oldest.handed) >= UNREPORTED
    }

    /// Waits until [`Self::has_room`] may have changed. Asks the reader now and then if there is no room. Cancel safe.
    pub async fn changed(&mut self) {
        let is_full = self.on_the_way.len() >= self.most();
        let Some((connection, counts)) = &mut self.connection else {
            return std::future::pending().await;
        };
        tokio::select! {
            // The sender lives as long as `connection`.
            _ = counts.changed() => (),
            () = tokio::time::sleep_until(self.ask.0), if is_full => {
                connection.ask();
                let pause = self.ask.1;
                self.ask = (Instant::now() + pause, (2 * pause).min(ASK.1));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES: usize = 100_000;
    const MS: Duration = Duration::from_millis(1);

    /// A stream whose reader has taken the first, small message, and its connection.
    fn stream(step: u32) -> (Pace, Consumption) {
        let connection = Consumption::default();
        let mut pace = Pace::new(Some(connection.clone()));
        pace.pass(80);
        assert!(!pace.has_room(), "the first message shows the steps");
        connection.send(80);
        connection.grant(80, step);
        assert!(pace.has_room());
        (pace, connection)
    }

    /// Hands a message on and sends it.
    fn hand(pace: &mut Pace, connection: &Consumption, now: Instant) {
        pace.hand_at(BYTES, now);
        connection.send(BYTES as u64);
    }

    #[test]
    fn a_slow_reader_has_one_message_on_the_way() {
        let ((mut pace, connection), mut now) = (stream(80), Instant::now());
        for _ in 0..10 {
            assert!(pace.has_room_at(now));
            hand(&mut pace, &connection, now);
            assert!(!pace.has_room_at(now + 999 * MS));
            now += 1000 * MS;
            connection.grant(BYTES as u64, BYTES as u32);
        }
    }

    #[test]
    fn a_quick_reader_has_three_until_it_slows_down() {
        let ((mut pace, connection), mut now) = (stream(80), Instant::now());
        // The first, small message was the first of them.
        for _ in 1..QUICK_IN_A_ROW {
            hand(&mut pace, &connection, now);
            assert!(!pace.has_room_at(now));
            now += 30 * MS;
            connection.grant(BYTES as u64, BYTES as u32);
            assert!(pace.has_room_at(now));
        }
        for _ in 0..QUICK_MESSAGES {
            assert!(pace.has_room_at(now));
            hand(&mut pace, &connection, now);
        }
        assert!(!pace.has_room_at(now));
        now += QUICK;
        connection.grant(3 * BYTES as u64, 3 * BYTES as u32);
        assert!(pace.has_room_at(now));
        hand(&mut pace, &connection, now);
        assert!(!pace.has_room_at(now), "one, as the last took long");
    }

    #[test]
    fn a_message_granted_ahead_is_no_drift() {
        let ((mut pace, connection), mut now) = (stream(80), Instant::now());
        // As grpc-core grants: beyond the message, and less with the next ones.
        for granted in [102_057, 126_342, 134_534, 68_964, 69_015, 134_500] {
            hand(&mut pace, &connection, now);
            now += 5 * MS;
            connection.grant(granted, granted as u32);
            assert!(pace.has_room_at(now), "{granted}");
        }
    }

    #[test]
    fn a_reader_that_grants_half_a_window_at_a_time_is_not_held_back() {
        let (connection, now) = (Consumption::default(), Instant::now());
        let mut pace = Pace::new(Some(connection.clone()));
        hand(&mut pace, &connection, now);
        assert!(!pace.has_room_at(now + FIRST_PATIENCE - MS));
        for i in 0..100 {
            assert!(pace.has_room_at(now + UNREPORTED), "{i}");
            hand(&mut pace, &connection, now + UNREPORTED);
            if i % 10 == 9 {
                connection.grant(1 << 20, 1 << 20);
            }
        }
    }

    #[test]
    fn steps_are_large_or_small_beside_the_message() {
        let ((mut pace, connection), now) = (stream(32_768), Instant::now());
        for (size, steps) in [
            (BYTES, Steps::Small),
            (20_000, Steps::Large),
            (BYTES, Steps::Small),
        ] {
            pace.hand_at(size, now);
            connection.send(size as u64);
            let has_room = pace.has_room_at(now + UNREPORTED);
            assert_eq!((has_room, pace.steps), (steps == Steps::Large, steps));
        }
    }

    #[test]
    fn a_window_smaller_than_a_message_is_no_large_step() {
        let (connection, now) = (Consumption::default(), Instant::now());
        let mut pace = Pace::new(Some(connection.clone()));
        pace.hand_at(BYTES, now);
        connection.send(65_535);
        assert!(!pace.has_room_at(now + 2 * PATIENCE), "the rest waits here");
        connection.grant(65_535, 16_384);
        connection.send(BYTES as u64 - 65_535);
        assert!(pace.has_room_at(now + 2 * PATIENCE));
    }

    #[test]
    fn a_message_that_passes_is_on_the_way_until_it_or_a_later_one_is_taken() {
        let ((mut pace, connection), now) = (stream(80), Instant::now());
        hand(&mut pace, &connection, now);
        pace.pass(80);
        connection.send(80);
        connection.grant(BYTES as u64, BYTES as u32);
        assert!(!pace.has_room_at(now));
        // Bytes that another stream's reader leaves unread.
        connection.send(1000);
        pace.hand_at(BYTES, now);
        connection.send(BYTES as u64);
        connection.grant(BYTES as u64, BYTES as u32);
        assert!(pace.has_room_at(now) && pace.on_the_way.is_empty());
    }

    #[test]
    fn patience_ends_and_doubles() {
        let ((mut pace, connection), mut now) = (stream(80), Instant::now());
        hand(&mut pace, &connection, now);
        for doublings in [0, 1, 2, 3, 3] {
            let patience = PATIENCE * (1 << doublings);
            assert!(!pace.has_room_at(now + patience - MS), "{doublings}");
            now += patience;
            assert!(pace.has_room_at(now), "{doublings}");
            hand(&mut pace, &connection, now);
        }
    }

    #[test]
    fn without_a_report_nothing_is_held_back() {
        let mut pace = Pace::new(None);
        for _ in 0..100 {
            pace.hand(BYTES);
            assert!(pace.has_room());
        }
    }

    #[tokio::test]
    async fn the_reader_is_asked_until_it_reports() {
        let (mut pace, connection) = stream(80);
        hand(&mut pace, &connection, Instant::now());
        let cx = std::task::Context::from_waker(std::task::Waker::noop());
        for _ in 0..3 {
            assert!(!pace.has_room() && !connection.is_asked(&cx));
            pace.changed().await;
            assert!(connection.is_asked(&cx));
            connection.on_asked();
        }
        let grant = async {
            tokio::task::yield_now().await;
            connection.grant(BYTES as u64, BYTES as u32);
        };
        tokio::join!(pace.changed(), grant);
        assert!(pace.has_room());
        let idle = tokio::time::timeout(200 * MS, pace.changed());
        assert!(idle.await.is_err(), "nothing is on the way");
    }
}
