//! The newest pair of a camera, until the reader takes it.

use super::DeviceError;
use super::pairing::ExposurePair;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

#[derive(Default)]
struct State {
    /// And when it came.
    waiting: Option<(ExposurePair, Instant)>,
    /// The camera has gone.
    fault: Option<DeviceError>,
    is_closed: bool,
    /// Pairs replaced by newer ones, or too old when the reader came.
    dropped: u64,
}

/// One place for a pair. A reader that is away for long does not get a picture of then.
pub(crate) struct Newest {
    state: Mutex<State>,
    changed: Condvar,
    /// Age from which a pair is not given.
    stale: Duration,
}

impl Newest {
    pub(crate) fn new(stale: Duration) -> Self {
        Self {
            state: Mutex::default(),
            changed: Condvar::new(),
            stale,
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a pair in place of the one that waits.
    pub(crate) fn put(&self, pair: ExposurePair) {
        let mut state = self.state();
        if !state.is_closed {
            let before = state.waiting.replace((pair, Instant::now()));
            state.dropped += u64::from(before.is_some());
            self.changed.notify_one();
        }
    }

    /// Ends the frames by a fault.
    pub(crate) fn fail(&self, fault: DeviceError) {
        self.state().fault.get_or_insert(fault);
        self.changed.notify_all();
    }

    /// Waits for a pair.
    ///
    /// # Errors
    /// The camera's fault, again at each call.
    pub(crate) fn take(&self) -> Result<ExposurePair, DeviceError> {
        let mut state = self.state();
        loop {
            match state.waiting.take() {
                Some((pair, came)) if came.elapsed() <= self.stale => return Ok(pair),
                Some(_) => state.dropped += 1,
                None => {}
            }
            if let Some(fault) = &state.fault {
                return Err(fault.clone());
            }
            let woken = self.changed.wait(state);
            state = woken.unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Takes no more pairs: the reader has gone.
    pub(crate) fn close(&self) {
        let mut state = self.state();
        (state.is_closed, state.waiting) = (true, None);
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.state().is_closed
    }

    /// Pairs that no reader got.
    pub(crate) fn dropped(&self) -> u64 {
        self.state().dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Stream;
    use crate::driver::SensorImage;

    fn pair(number: u64) -> ExposurePair {
        ExposurePair {
            number,
            depth: SensorImage {
                stream: Stream::Depth,
                time_ns: number,
                bytes: vec![],
            },
            color: None,
        }
    }

    #[test]
    fn the_newest_wins_and_replaced_ones_are_counted() {
        let newest = Newest::new(Duration::from_secs(60));
        (1..=3).for_each(|n| newest.put(pair(n)));
        assert_eq!(newest.take().expect("there").number, 3);
        assert_eq!(newest.dropped(), 2);
        newest.put(pair(4));
        newest.fail(DeviceError::driver("openni:1", "depth", "gone"));
        // The last one before the fault is still given.
        assert_eq!(newest.take().expect("there").number, 4);
        for _ in 0..2 {
            let fault = newest.take().expect_err("gone").to_string();
            assert_eq!(fault, "openni:1: `depth`: gone");
        }
    }

    #[test]
    fn a_pair_of_before_the_reader_came_is_not_given() {
        let newest = Newest::new(Duration::ZERO);
        newest.put(pair(1));
        #[allow(clippy::disallowed_methods)] // the age of an image is the matter
        std::thread::sleep(Duration::from_millis(2));
        newest.fail(DeviceError::driver("openni:1", "depth", "gone"));
        assert!(newest.take().is_err());
        assert_eq!(newest.dropped(), 1);
    }
}
