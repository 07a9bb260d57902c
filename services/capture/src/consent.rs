//! Leases of consent of one camera, and the key that lives as long as any of them.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::Notify;
use tokio::time::Instant;
use tonic::Status;
use tryon_kit::seal::Sealer;
use tryon_kit::status::exhausted;
use tryon_proto::v1::FrameKey;

/// Most leases of one camera at a time.
const MAX_LEASES: usize = 64;

/// Leases by holder, and their key.
#[derive(Default)]
struct Held {
    ends: BTreeMap<String, Instant>,
    /// Drawn with the first lease, dropped with the last.
    sealer: Option<Arc<Sealer>>,
}

impl Held {
    /// Drops leases that have run out, and the key with the last of them.
    fn prune(&mut self) {
        let now = Instant::now();
        self.ends.retain(|_, end| *end > now);
        if self.ends.is_empty() {
            self.sealer = None;
        }
    }
}

/// Leases of one camera. Clones share them.
#[derive(Clone, Default)]
pub(crate) struct Leases(Arc<(Mutex<Held>, Notify)>);

impl Leases {
    fn with<R>(&self, f: impl FnOnce(&mut Held) -> R) -> R {
        let mut held = self.0.0.lock().unwrap_or_else(PoisonError::into_inner);
        held.prune();
        f(&mut held)
    }

    /// Holds or renews the lease of `holder` from now on; the key of the frames.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED at the most leases, UNAVAILABLE without random numbers.
    pub(crate) fn hold(&self, holder: &str, length: Duration) -> Result<FrameKey, Status> {
        let key = self.with(|held| {
            if held.ends.len() == MAX_LEASES && !held.ends.contains_key(holder) {
                return Err(exhausted("leases of consent", MAX_LEASES));
            }
            let sealer = match held.sealer.clone() {
                Some(sealer) => sealer,
                None => Arc::new(Sealer::draw().map_err(|e| Status::unavailable(e.to_string()))?),
            };
            let key = sealer.key().clone();
            held.sealer = Some(sealer);
            held.ends.insert(holder.into(), Instant::now() + length);
            Ok(key)
        });
        self.0.1.notify_one();
        key
    }

    /// Ends the lease of `holder`; one that does not run is no error.
    pub(crate) fn end(&self, holder: &str) {
        self.with(|held| {
            held.ends.remove(holder);
            held.prune();
        });
    }

    /// Sealing end of the key while a lease runs.
    pub(crate) fn sealer(&self) -> Option<Arc<Sealer>> {
        self.with(|held| held.sealer.clone())
    }

    /// Waits for a lease. One task waits at a time.
    pub(crate) async fn begun(&self) {
        while self.sealer().is_none() {
            self.0.1.notified().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: Duration = Duration::from_secs(600);
    const SHORT: Duration = Duration::from_millis(1);

    #[tokio::test]
    async fn a_lease_ends_by_itself_and_its_key_with_it() {
        let leases = Leases::default();
        assert!(leases.sealer().is_none());
        let first = leases.hold("a", LONG).expect("held");
        let same = leases.hold("b", SHORT).expect("held");
        assert_eq!(first.id, same.id, "leases that overlap share the key");
        tokio::time::sleep(2 * SHORT).await;
        assert!(leases.sealer().is_some(), "a still runs");
        leases.hold("a", SHORT).expect("renewed");
        tokio::time::sleep(2 * SHORT).await;
        assert!(leases.sealer().is_none());
        let next = leases.hold("a", LONG).expect("held");
        assert_ne!(first.id, next.id);
        assert_ne!(first.secret, next.secret);
    }

    #[test]
    fn an_ended_lease_ends_at_once_and_only_its_own() {
        let leases = Leases::default();
        leases.hold("a", LONG).expect("held");
        leases.hold("b", LONG).expect("held");
        leases.end("a");
        leases.end("nobody");
        assert!(leases.sealer().is_some());
        leases.end("b");
        assert!(leases.sealer().is_none());
        for i in 0..MAX_LEASES {
            leases.hold(&i.to_string(), LONG).expect("held");
        }
        leases.hold("0", LONG).expect("renewed");
        let full = leases.hold("one more", LONG).expect_err("full");
        assert_eq!(full.code(), tonic::Code::ResourceExhausted);
    }

    #[tokio::test]
    async fn who_waits_is_woken() {
        let leases = Leases::default();
        let waiting = tokio::spawn({
            let leases = leases.clone();
            async move { leases.begun().await }
        });
        leases.hold("a", LONG).expect("held");
        waiting.await.expect("woken");
    }
}
