//! Queue of one slot: the newest value wins, losses are counted.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::Notify;

struct Shared<T> {
    slot: Mutex<Option<T>>,
    dropped: AtomicU64,
    closed: AtomicBool,
    arrived: Notify,
}

/// Writing end.
pub struct Sender<T>(Arc<Shared<T>>);

/// Reading end.
pub struct Receiver<T>(Arc<Shared<T>>);

/// An empty queue and its two ends.
pub fn channel<T>() -> (Sender<T>, Receiver<T>) {
    let shared = Arc::new(Shared {
        slot: Mutex::new(None),
        dropped: AtomicU64::new(0),
        closed: AtomicBool::new(false),
        arrived: Notify::new(),
    });
    (Sender(shared.clone()), Receiver(shared))
}

impl<T> Sender<T> {
    /// Stores a value without waiting; a replaced one is counted. `false` when the receiver is gone.
    pub fn send(&self, value: T) -> bool {
        let old = self
            .0
            .slot
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .replace(value);
        if old.is_some() {
            self.0.dropped.fetch_add(1, Ordering::Relaxed);
        }
        self.0.arrived.notify_one();
        !self.is_closed()
    }
    /// Counts a value that was not even made.
    pub fn skip(&self) {
        self.0.dropped.fetch_add(1, Ordering::Relaxed);
    }
    /// A value waits to be taken.
    pub fn is_waiting(&self) -> bool {
        (self.0.slot.lock())
            .unwrap_or_else(PoisonError::into_inner)
            .is_some()
    }
    /// The receiver is gone.
    pub fn is_closed(&self) -> bool {
        self.0.closed.load(Ordering::Acquire)
    }
    /// Values replaced before anyone took them.
    pub fn dropped(&self) -> u64 {
        self.0.dropped.load(Ordering::Relaxed)
    }
}

impl<T> Drop for Sender<T> {
    fn drop(&mut self) {
        self.0.closed.store(true, Ordering::Release);
        self.0.arrived.notify_one();
    }
}

impl<T> Drop for Receiver<T> {
    fn drop(&mut self) {
        self.0.closed.store(true, Ordering::Release);
    }
}

impl<T> Receiver<T> {
    /// The newest value, waiting for one; `None` when the sender is gone and nothing waits. Cancel safe.
    pub async fn recv(&mut self) -> Option<T> {
        loop {
            if let Some(v) = self.try_recv() {
                return Some(v);
            }
            if self.0.closed.load(Ordering::Acquire) {
                return self.try_recv();
            }
            self.0.arrived.notified().await;
        }
    }
    /// The newest value, if one waits.
    pub fn try_recv(&mut self) -> Option<T> {
        self.0
            .slot
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }
    /// The sender is gone; a value may still wait.
    pub fn is_closed(&self) -> bool {
        self.0.closed.load(Ordering::Acquire)
    }
    /// Counts a value that was taken and not used.
    pub fn discard(&self) {
        self.0.dropped.fetch_add(1, Ordering::Relaxed);
    }
    /// Values replaced, skipped or discarded.
    pub fn dropped(&self) -> u64 {
        self.0.dropped.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn newest_value_wins_and_losses_are_counted() {
        let (tx, mut rx) = channel();
        for i in 0..5 {
            assert!(tx.send(i));
        }
        assert_eq!(rx.recv().await, Some(4));
        assert_eq!(rx.dropped(), 4);
        assert_eq!(rx.try_recv(), None);
        let waiting = tokio::spawn(async move { (rx.recv().await, rx.recv().await) });
        tokio::task::yield_now().await;
        tx.send(9);
        tokio::task::yield_now().await;
        drop(tx);
        assert_eq!(waiting.await.expect("ends"), (Some(9), None));
    }

    #[test]
    fn send_reports_a_dropped_receiver() {
        let (tx, rx) = channel();
        drop(rx);
        assert!(!tx.send(1));
    }
}
