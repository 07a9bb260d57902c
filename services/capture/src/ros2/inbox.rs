//! Messages that wait for the reader, undecoded: the newest of depth, the last ones of colour.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tryon_formats::live::LIVE_COLOR_IMAGES;
use zenoh::bytes::ZBytes;

/// Time without a reader after which messages are of no use: nobody may be seen any more, or the reader is stuck.
const IDLE: Duration = Duration::from_millis(500);

/// Stream of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stream {
    Depth,
    Color,
}

/// A message as it came.
#[derive(Clone, Debug)]
pub(super) struct Message {
    /// Type, if its key states one.
    pub(super) schema: Option<String>,
    pub(super) payload: ZBytes,
    pub(super) arrived: Instant,
    /// The same as the system's time, nanoseconds since 1970.
    pub(super) arrived_ns: u64,
    /// Number of the message among those of both streams.
    pub(super) number: u64,
}

#[derive(Default)]
struct State {
    depth: Option<Message>,
    color: VecDeque<Message>,
    /// The reader waits.
    is_reading: bool,
    /// End of its last wait.
    left: Option<Instant>,
    /// Messages that came.
    arrived: u64,
    /// Messages that newer ones replaced.
    dropped: u64,
}

impl State {
    fn is_read(&self) -> bool {
        self.is_reading || self.left.is_some_and(|l| l.elapsed() < IDLE)
    }
}

/// Messages of one camera.
#[derive(Default)]
pub(super) struct Inbox {
    state: Mutex<State>,
    arrived: Condvar,
}

impl Inbox {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps a message, made of its number, in place of the oldest of its stream. False if nobody reads: there is none then.
    pub(super) fn put(&self, stream: Stream, message: impl FnOnce(u64) -> Message) -> bool {
        let mut state = self.state();
        if !state.is_read() {
            return false;
        }
        state.arrived += 1;
        let message = message(state.arrived);
        let is_replaced = match stream {
            Stream::Depth => state.depth.replace(message).is_some(),
            Stream::Color => {
                state.color.push_back(message);
                let is_full = state.color.len() > LIVE_COLOR_IMAGES;
                is_full && state.color.pop_front().is_some()
            }
        };
        if is_replaced {
            state.dropped += 1;
            metrics::counter!("tryon_capture_ros2_dropped").increment(1);
        }
        drop(state);
        self.arrived.notify_one();
        true
    }

    /// Begins to read. What came before a pause is forgotten: it may show somebody who had not consented.
    pub(super) fn begin(&self) {
        let mut state = self.state();
        if !state.is_read() {
            state.depth = None;
            state.color.clear();
        }
        state.is_reading = true;
    }

    /// Ends to read, for a while or for good.
    pub(super) fn end(&self) {
        let mut state = self.state();
        state.is_reading = false;
        state.left = Some(Instant::now());
    }

    /// The newest depth; waits for it.
    pub(super) fn depth(&self) -> Message {
        let mut state = self.state();
        loop {
            if let Some(depth) = state.depth.take() {
                return depth;
            }
            let woken = self.arrived.wait(state);
            state = woken.unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The oldest colour; waits for one until `deadline`.
    pub(super) fn color(&self, deadline: Instant) -> Option<Message> {
        let mut state = self.state();
        loop {
            if let Some(color) = state.color.pop_front() {
                return Some(color);
            }
            let left = deadline.checked_duration_since(Instant::now())?;
            let woken = self.arrived.wait_timeout(state, left);
            state = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Somebody reads, or has done so a moment ago.
    pub(super) fn is_read(&self) -> bool {
        self.state().is_read()
    }

    /// Messages that newer ones replaced.
    pub(super) fn dropped(&self) -> u64 {
        self.state().dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(byte: u8) -> Message {
        Message {
            schema: None,
            payload: ZBytes::from(vec![byte]),
            arrived: Instant::now(),
            arrived_ns: 0,
            number: 0,
        }
    }

    fn byte(message: &Message) -> u8 {
        message.payload.to_bytes()[0]
    }

    #[test]
    fn nothing_is_kept_that_nobody_reads() {
        let inbox = Inbox::default();
        let unread = |_| -> Message { panic!("nobody asked for it") };
        assert!(!inbox.put(Stream::Depth, unread));
        inbox.begin();
        assert!(inbox.put(Stream::Color, |_| message(1)));
        inbox.end();
        // The reader is away for a moment.
        assert!(inbox.put(Stream::Color, |_| message(2)));
        inbox.state().left = Instant::now().checked_sub(IDLE);
        assert!(!inbox.put(Stream::Color, unread));
        inbox.begin();
        assert!(
            inbox.color(Instant::now()).is_none(),
            "it was before the pause"
        );
    }

    #[test]
    fn the_newest_depth_and_the_last_colors_wait() {
        let inbox = Inbox::default();
        inbox.begin();
        for k in 0..20 {
            assert!(inbox.put(Stream::Depth, |_| message(k)));
            assert!(inbox.put(Stream::Color, |_| message(k)));
        }
        assert_eq!(byte(&inbox.depth()), 19);
        let now = Instant::now();
        let colors: Vec<u8> = std::iter::from_fn(|| inbox.color(now))
            .map(|m| byte(&m))
            .collect();
        assert_eq!(colors, [12, 13, 14, 15, 16, 17, 18, 19]);
        assert_eq!(inbox.dropped(), 19 + 12);
    }

    #[test]
    fn who_waits_is_woken() {
        let inbox = std::sync::Arc::new(Inbox::default());
        inbox.begin();
        let waiting = std::thread::spawn({
            let inbox = inbox.clone();
            move || byte(&inbox.depth())
        });
        // The colour wakes the reader of depth too, who goes on waiting.
        inbox.put(Stream::Color, |_| message(1));
        inbox.put(Stream::Depth, |_| message(2));
        assert_eq!(waiting.join().expect("ended"), 2);
    }
}
