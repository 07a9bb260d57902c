//! Budget of each peer: a token bucket by address. Calls, failed attempts.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Most peers that are remembered; those with a full budget make place.
const MAX_PEERS: usize = 4096;

/// Number of events that a peer may cause.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Allowance {
    /// At once.
    pub(crate) burst: f64,
    /// Again, each second.
    pub(crate) per_second: f64,
}

/// Budget of one peer, or of one connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bucket {
    allowance: Allowance,
    /// Events that were left at `at`.
    left: f64,
    at: Instant,
}

impl Bucket {
    pub(crate) fn full(allowance: Allowance, at: Instant) -> Self {
        Self {
            allowance,
            left: allowance.burst,
            at,
        }
    }

    /// Takes one event, if one is left.
    pub(crate) fn take(&mut self, now: Instant) -> bool {
        let left = self.left(now);
        let is_left = left >= 1.0;
        (self.left, self.at) = (if is_left { left - 1.0 } else { left }, now);
        is_left
    }

    /// Adds what the time and `earned` give; no more than the burst is kept.
    pub(crate) fn earn(&mut self, earned: f64, now: Instant) {
        (self.left, self.at) = (self.left_with(earned, now), now);
    }

    /// Pays for `events`; false when the budget is overdrawn.
    pub(crate) fn pay(&mut self, events: f64) -> bool {
        self.left -= events;
        self.left >= 0.0
    }

    fn left(&self, now: Instant) -> f64 {
        self.left_with(0.0, now)
    }

    fn left_with(&self, earned: f64, now: Instant) -> f64 {
        let gained = now.saturating_duration_since(self.at).as_secs_f64();
        (self.left + gained * self.allowance.per_second + earned).min(self.allowance.burst)
    }
}

/// Buckets of all peers.
pub(crate) struct PeerBudget {
    allowance: Allowance,
    peers: Mutex<HashMap<IpAddr, Bucket>>,
}

impl PeerBudget {
    pub(crate) fn new(allowance: Allowance) -> Self {
        Self {
            allowance,
            peers: Mutex::default(),
        }
    }

    /// The peer has no event left.
    pub(crate) fn is_spent(&self, peer: IpAddr, now: Instant) -> bool {
        let peers = self.peers.lock().unwrap_or_else(PoisonError::into_inner);
        (peers.get(&group(peer))).is_some_and(|b| b.left(now) < 1.0)
    }

    /// Takes one event from the budget of the peer, if one is left.
    pub(crate) fn take(&self, peer: IpAddr, now: Instant) -> bool {
        let mut peers = self.peers.lock().unwrap_or_else(PoisonError::into_inner);
        if peers.len() >= MAX_PEERS {
            peers.retain(|_, b| b.left(now) < self.allowance.burst);
        }
        if peers.len() >= MAX_PEERS {
            // A flood from thousands of addresses: forgetting it keeps memory bounded, and costs it one burst each.
            peers.clear();
        }
        let full = Bucket::full(self.allowance, now);
        peers.entry(group(peer)).or_insert(full).take(now)
    }
}

/// Addresses that are counted together: one customer of a network holds a whole /64 of IPv6.
pub(crate) fn group(peer: IpAddr) -> IpAddr {
    match peer.to_canonical() {
        IpAddr::V6(a) => Ipv6Addr::from(u128::from(a) & (u128::MAX << 64)).into(),
        v4 => v4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_peer_spends_its_own_budget_and_gets_it_back() {
        let budget = PeerBudget::new(Allowance {
            burst: 3.0,
            per_second: 0.5,
        });
        let (now, a) = (Instant::now(), IpAddr::from([10, 0, 0, 1]));
        assert!((0..3).all(|_| budget.take(a, now)) && !budget.take(a, now));
        assert!(budget.is_spent(a, now));
        assert!(budget.is_spent("::ffff:10.0.0.1".parse().expect("an address"), now));
        assert!(!budget.is_spent(IpAddr::from([10, 0, 0, 2]), now));
        assert!(budget.is_spent(a, now + Duration::from_secs(1)));
        assert!(!budget.is_spent(a, now + Duration::from_secs(2)));
        let neighbours = ["2001:db8::1", "2001:db8::2"].map(|a| a.parse().expect("an address"));
        assert!((0..3).all(|_| budget.take(neighbours[0], now)));
        assert!(budget.is_spent(neighbours[1], now));
    }

    #[test]
    fn memory_is_bounded() {
        let budget = PeerBudget::new(Allowance {
            burst: 3.0,
            per_second: 0.5,
        });
        let now = Instant::now();
        for i in 0..3 * MAX_PEERS as u32 {
            budget.take(IpAddr::from(i.to_be_bytes()), now);
        }
        let peers = budget.peers.lock().expect("not poisoned");
        assert!(peers.len() <= MAX_PEERS);
    }
}
