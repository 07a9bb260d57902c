//! Task of one session: however it ends, its place is freed, and a panic costs only itself.

use crate::sessions::{Sessions, brief};
use futures::FutureExt;
use std::future::Future;
use std::panic::AssertUnwindSafe;

/// Reason of an end by a panic.
pub const PANICKED: &str = "a panic";

/// Runs the task of session `id` of `service` and returns the reason of its end; a panic is logged, counted and becomes
/// [`PANICKED`].
pub async fn run(
    service: &'static str,
    id: &str,
    task: impl Future<Output = &'static str>,
) -> &'static str {
    // The state that panicked is dropped with the task; nothing shared is left half changed.
    AssertUnwindSafe(task)
        .catch_unwind()
        .await
        .unwrap_or_else(|_| {
            metrics::counter!("tryon_session_panics", "service" => service).increment(1);
            tracing::error!(service, session = %brief(id), "the task of a session panicked");
            PANICKED
        })
}

/// Place of a session in its service's directory. Dropping it frees the place, unless another session has taken it.
pub struct Place<H> {
    directory: Sessions<H>,
    id: String,
    /// Gauge of open sessions.
    gauge: &'static str,
    /// The session of a handle has ended.
    is_over: fn(&H) -> bool,
}

impl<H> Place<H> {
    /// Place `id` of `directory`, whose number of sessions is shown as `gauge`.
    pub fn new(
        directory: Sessions<H>,
        id: &str,
        gauge: &'static str,
        is_over: fn(&H) -> bool,
    ) -> Self {
        Self {
            directory,
            id: id.into(),
            gauge,
            is_over,
        }
    }
}

impl<H> Drop for Place<H> {
    fn drop(&mut self) {
        // After an end on request the id may name another session already.
        self.directory.remove_if(&self.id, self.is_over);
        metrics::gauge!(self.gauge).set(self.directory.len() as f64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sessions::Opened;
    use tokio::sync::mpsc;

    #[tokio::test]
    async fn a_panic_is_the_end_of_one_session_and_frees_its_place() {
        let directory = Sessions::<mpsc::Sender<()>>::new(1);
        let (commands, inbox) = mpsc::channel::<()>(1);
        directory.open("a", || commands);
        let task = async move {
            let _inbox = inbox;
            if true {
                panic!("on purpose");
            }
            "never"
        };
        let place = Place::new(directory.clone(), "a", "test", |c| c.is_closed());
        assert_eq!(run("test", "a", task).await, PANICKED);
        drop(place);
        assert!(directory.is_empty());
    }

    #[test]
    fn the_place_of_a_successor_is_left_alone() {
        let directory = Sessions::<mpsc::Sender<()>>::new(1);
        let place = Place::new(directory.clone(), "a", "test", |c| c.is_closed());
        let (commands, _inbox) = mpsc::channel(1);
        directory.open("a", || commands);
        drop(place);
        assert!(matches!(
            directory.open("a", || unreachable!("it is open")),
            Opened::Found(_)
        ));
    }
}
