//! Flow of frames and pictures: where it stands still although somebody waits for it, and the likely cause. Told by
//! `/readyz/all`, by the gauge `tryon_stalled` and once in the log.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::time::Instant;

/// Time that a flow may stand still: a service that starts again takes as long.
const PATIENCE: Duration = Duration::from_secs(3);

/// A flow that stands still.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Stall {
    service: &'static str,
    cause: String,
}

/// Flows of a process that stand still, by name. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct Stalls(Arc<Mutex<BTreeMap<String, Stall>>>);

impl Stalls {
    /// A flow of a service, such as `camera store/front`.
    pub fn flow(&self, service: &'static str, name: String) -> Flow {
        Flow {
            stalls: self.clone(),
            service,
            name,
            waits_since: None,
            is_told: false,
        }
    }

    /// A line for each flow that stands still.
    pub fn lines(&self) -> Vec<String> {
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let line = |(name, stall): (&String, &Stall)| format!("{name}: {}", stall.cause);
        all.iter().map(line).collect()
    }

    fn set(&self, service: &'static str, name: &str, stall: Option<Stall>) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match stall {
            Some(stall) => drop(all.insert(name.to_owned(), stall)),
            None => drop(all.remove(name)),
        }
        let count = all.values().filter(|s| s.service == service).count();
        metrics::gauge!("tryon_stalled", "service" => service).set(count as f64);
    }
}

/// One flow of frames or pictures. Dropping it ends its stall.
#[derive(Debug)]
pub struct Flow {
    stalls: Stalls,
    service: &'static str,
    name: String,
    waits_since: Option<Instant>,
    is_told: bool,
}

impl Flow {
    /// Something came, or nobody waits for it.
    pub fn moves(&mut self) {
        self.waits_since = None;
        if std::mem::take(&mut self.is_told) {
            tracing::info!(service = self.service, flow = self.name, "flows again");
            self.stalls.set(self.service, &self.name, None);
        }
    }

    /// Nothing came since the last sign of motion although somebody waits; `cause` is the likely one. To be called
    /// several times a second meanwhile.
    pub fn waits(&mut self, cause: impl FnOnce() -> String) {
        self.waits_at(Instant::now(), cause);
    }

    fn waits_at(&mut self, now: Instant, cause: impl FnOnce() -> String) {
        let since = *self.waits_since.get_or_insert(now);
        if self.is_told || now.duration_since(since) < PATIENCE {
            return;
        }
        self.is_told = true;
        let stall = Stall {
            service: self.service,
            cause: cause(),
        };
        tracing::warn!(
            service = self.service,
            flow = self.name,
            cause = stall.cause,
            "stands still"
        );
        self.stalls.set(self.service, &self.name, Some(stall));
    }
}

impl Drop for Flow {
    fn drop(&mut self) {
        if self.is_told {
            self.stalls.set(self.service, &self.name, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flow_that_stands_still_is_told_until_it_moves() {
        let stalls = Stalls::default();
        let mut flow = stalls.flow("tracking", "camera store/front".into());
        let begun = Instant::now();
        let waits = |flow: &mut Flow, share: f64| {
            flow.waits_at(begun + PATIENCE.mul_f64(share), || "the router".into());
        };
        waits(&mut flow, 0.0);
        flow.moves();
        waits(&mut flow, 0.5);
        waits(&mut flow, 1.4);
        assert_eq!(stalls.lines(), [""; 0], "it had moved meanwhile");
        waits(&mut flow, 1.5);
        assert_eq!(stalls.lines(), ["camera store/front: the router"]);
        flow.moves();
        assert_eq!(stalls.lines(), [""; 0]);
        waits(&mut flow, 2.0);
        waits(&mut flow, 3.0);
        assert_eq!(stalls.lines().len(), 1);
        drop(flow);
        assert_eq!(stalls.lines(), [""; 0], "nobody waits any more");
    }
}
