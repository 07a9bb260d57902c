//! Queue of keyframes and updates in order: keyframes are never lost, the oldest update is dropped first.
//!
//! An update depends on its keyframe only, so a dropped one loses a moment, not the stream. A new keyframe supersedes
//! everything before it, so at most one keyframe and `capacity` updates wait.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::Notify;

struct Inner<T> {
    key: Option<T>,
    updates: VecDeque<T>,
    dropped: u64,
    closed: bool,
}

struct Shared<T> {
    inner: Mutex<Inner<T>>,
    capacity: usize,
    arrived: Notify,
}

/// Writing end.
pub struct Sender<T>(Arc<Shared<T>>);

/// Reading end.
pub struct Receiver<T>(Arc<Shared<T>>);

/// Queue of one keyframe and `capacity` updates.
pub fn channel<T>(capacity: usize) -> (Sender<T>, Receiver<T>) {
    let inner = Inner {
        key: None,
        updates: VecDeque::new(),
        dropped: 0,
        closed: false,
    };
    let shared = Arc::new(Shared {
        inner: Mutex::new(inner),
        capacity: capacity.max(1),
        arrived: Notify::new(),
    });
    (Sender(shared.clone()), Receiver(shared))
}

impl<T> Shared<T> {
    fn with<R>(&self, f: impl FnOnce(&mut Inner<T>) -> R) -> R {
        f(&mut self.inner.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<T> Sender<T> {
    /// Queues a keyframe and drops everything before it. `false` when the receiver is gone.
    pub fn keyframe(&self, value: T) -> bool {
        let open = self.0.with(|q| {
            q.dropped += q.updates.len() as u64 + u64::from(q.key.is_some());
            q.updates.clear();
            q.key = Some(value);
            !q.closed
        });
        self.0.arrived.notify_one();
        open
    }
    /// Queues an update; a full queue drops its oldest one. `false` when the receiver is gone.
    pub fn update(&self, value: T) -> bool {
        let open = self.0.with(|q| {
            if q.updates.len() == self.0.capacity {
                q.updates.pop_front();
                q.dropped += 1;
            }
            q.updates.push_back(value);
            !q.closed
        });
        self.0.arrived.notify_one();
        open
    }
    /// The receiver is gone.
    pub fn is_closed(&self) -> bool {
        self.0.with(|q| q.closed)
    }
}

impl<T> Drop for Sender<T> {
    fn drop(&mut self) {
        self.0.with(|q| q.closed = true);
        self.0.arrived.notify_one();
    }
}

impl<T> Drop for Receiver<T> {
    fn drop(&mut self) {
        self.0.with(|q| q.closed = true);
    }
}

impl<T> Receiver<T> {
    /// The next value in order; `None` when the sender is gone and nothing waits. Cancel safe.
    pub async fn recv(&mut self) -> Option<T> {
        loop {
            let (next, closed) = self
                .0
                .with(|q| (q.key.take().or_else(|| q.updates.pop_front()), q.closed));
            if next.is_some() || closed {
                return next;
            }
            self.0.arrived.notified().await;
        }
    }
    /// Values dropped so far.
    pub fn dropped(&self) -> u64 {
        self.0.with(|q| q.dropped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn keyframes_are_kept_and_order_holds_for_a_slow_reader() {
        let (tx, mut rx) = channel(2);
        tx.keyframe("K1");
        for u in ["a", "b", "c"] {
            tx.update(u);
        }
        assert_eq!(rx.recv().await, Some("K1"));
        assert_eq!(rx.recv().await, Some("b"));
        tx.keyframe("K2");
        tx.update("d");
        assert_eq!(rx.dropped(), 2);
        drop(tx);
        assert_eq!(
            (rx.recv().await, rx.recv().await, rx.recv().await),
            (Some("K2"), Some("d"), None)
        );
    }
}
