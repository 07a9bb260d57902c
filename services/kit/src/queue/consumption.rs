//! Consumption of what was sent on one connection, as far as its reader's transport reports it.

use futures::task::AtomicWaker;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::watch;

/// Bytes of messages on a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) sent: u64,
    /// Those that the reader's application has taken; up to a message more.
    pub(crate) granted: u64,
    /// Smallest grant so far: readers report in steps.
    pub(crate) step: u32,
}

/// Consumption of one connection. Clones share it.
#[derive(Clone, Debug)]
pub struct Consumption(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    counts: watch::Sender<Counts>,
    is_asked: AtomicBool,
    connection: AtomicWaker,
}

impl Default for Consumption {
    fn default() -> Self {
        let counts = Counts {
            sent: 0,
            granted: 0,
            step: u32::MAX,
        };
        Self(Arc::new(Shared {
            counts: watch::Sender::new(counts),
            is_asked: AtomicBool::new(false),
            connection: AtomicWaker::new(),
        }))
    }
}

impl Consumption {
    /// Bytes so far; a change is a grant.
    pub(crate) fn counts(&self) -> watch::Receiver<Counts> {
        self.0.counts.subscribe()
    }

    /// Has the connection ask its reader for a report.
    pub(crate) fn ask(&self) {
        self.0.is_asked.store(true, Ordering::Release);
        self.0.connection.wake();
    }

    /// A report is asked for; if not, the task is woken when it is.
    pub(crate) fn is_asked(&self, cx: &std::task::Context<'_>) -> bool {
        self.0.connection.register(cx.waker());
        self.0.is_asked.load(Ordering::Acquire)
    }

    /// The reader has been asked.
    pub(crate) fn on_asked(&self) {
        self.0.is_asked.store(false, Ordering::Release);
    }

    pub(crate) fn send(&self, bytes: u64) {
        self.0.counts.send_if_modified(|c| {
            c.sent = c.sent.wrapping_add(bytes);
            false
        });
    }

    /// Counts `bytes` as granted, by a report of `step` bytes.
    pub(crate) fn grant(&self, bytes: u64, step: u32) {
        self.0.counts.send_modify(|c| {
            c.granted = c.granted.wrapping_add(bytes);
            c.step = c.step.min(step);
        });
    }

    /// A stream has ended with so many bytes sent and granted: the difference is granted.
    pub(crate) fn settle(&self, sent: u64, granted: u64) {
        let rest = sent.wrapping_sub(granted);
        self.0
            .counts
            .send_modify(|c| c.granted = c.granted.wrapping_add(rest));
    }
}
