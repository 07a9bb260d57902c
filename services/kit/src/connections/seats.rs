//! Seats of one port, and which connection ends for a newcomer.
//!
//! A connection is silent until its first byte (behind TLS: until its handshake is over), a stranger until a call of it
//! passes the gate of `auth`, and proven from then on. Proven ones are never evicted.

use super::Limits;
use crate::call_rate;
use crate::peer_budget::{Bucket, group};
use futures::task::AtomicWaker;
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

/// Age up to which silent connections stay while there are strangers to evict. A newcomer says its first byte in it,
/// also while others connect without a pause. Longer: silent connections displace strangers.
const GRACE: Duration = Duration::from_secs(1);
/// Failed proofs after which a connection that has proved nothing ends at the next one.
const FAILED_PROOFS: u32 = 8;

/// Seat of one connection, and what its calls have shown.
pub(crate) struct Seat {
    /// Place in the order of arrival.
    number: u64,
    /// Address under which it is counted; `None` for this machine's own.
    peer: Option<IpAddr>,
    arrived: Instant,
    has_spoken: AtomicBool,
    is_proven: AtomicBool,
    has_called: AtomicBool,
    failed_proofs: AtomicU32,
    /// Budget of its calls once it is proven.
    calls: Mutex<Bucket>,
    is_ended: AtomicBool,
    waker: AtomicWaker,
    directory: Directory,
}

impl Seat {
    fn new(number: u64, peer: Option<IpAddr>, directory: Directory) -> Self {
        let arrived = Instant::now();
        Self {
            number,
            peer,
            arrived,
            has_spoken: AtomicBool::new(false),
            is_proven: AtomicBool::new(false),
            has_called: AtomicBool::new(false),
            failed_proofs: AtomicU32::new(0),
            calls: Mutex::new(Bucket::full(call_rate::ALLOWANCE, arrived)),
            is_ended: AtomicBool::new(false),
            waker: AtomicWaker::new(),
            directory,
        }
    }

    /// Seat of a connection of no port.
    #[cfg(test)]
    pub(crate) fn alone() -> Arc<Self> {
        Arc::new(Self::new(0, None, Directory::default()))
    }

    /// The first byte has come.
    pub(crate) fn speak(&self) {
        self.has_spoken.store(true, Ordering::Relaxed);
    }

    /// A call passed the gate: the connection is not evicted any more.
    pub(crate) fn prove(&self) {
        if !self.is_proven.swap(true, Ordering::Relaxed) {
            self.directory.with(|s| s.unproven.remove(&self.number));
        }
    }

    /// A call has passed the gate.
    pub(crate) fn is_proven(&self) -> bool {
        self.is_proven.load(Ordering::Relaxed)
    }

    /// No proof on this connection has failed.
    pub(crate) fn is_clean(&self) -> bool {
        self.failed_proofs.load(Ordering::Relaxed) == 0
    }

    /// Counts a failed proof; ends the connection when there are too many. One that is proven stays: a proxy may send
    /// the calls of many users on it.
    pub(crate) fn fail_proof(&self) {
        let before = self.failed_proofs.fetch_add(1, Ordering::Relaxed);
        if before >= FAILED_PROOFS && !self.is_proven() {
            metrics::counter!("tryon_connections_unproven").increment(1);
            self.end();
        }
    }

    /// Takes a call from the connection's own budget: its first one, and those of a proven connection. `None` when
    /// the budget of its address decides.
    pub(crate) fn take_call(&self, now: Instant) -> Option<bool> {
        let is_first = !self.has_called.swap(true, Ordering::Relaxed);
        let mut calls = self.calls.lock().unwrap_or_else(PoisonError::into_inner);
        (is_first || self.is_proven()).then(|| calls.take(now))
    }

    /// Ends the connection at its next read or write.
    pub(crate) fn end(&self) {
        self.is_ended.store(true, Ordering::Release);
        self.waker.wake();
    }

    /// Ready once the connection must end; else the task is woken when it must.
    pub(super) fn poll_end(&self, cx: &Context<'_>) -> Poll<()> {
        self.waker.register(cx.waker());
        if self.is_ended() {
            return Poll::Ready(());
        }
        Poll::Pending
    }

    /// The connection must end.
    pub(crate) fn is_ended(&self) -> bool {
        self.is_ended.load(Ordering::Acquire)
    }

    /// Gives the seat back.
    pub(super) fn leave(&self) {
        self.directory.with(|s| {
            s.unproven.remove(&self.number);
            s.taken -= 1;
            if let Some(ip) = self.peer
                && let Some(count) = s.peers.get_mut(&ip)
            {
                *count -= 1;
                if *count == 0 {
                    s.peers.remove(&ip);
                }
            }
        });
    }
}

/// Taken seats.
#[derive(Default)]
struct Seats {
    next: u64,
    taken: usize,
    /// Taken seats by address, of other machines.
    peers: BTreeMap<IpAddr, usize>,
    /// Silent connections and strangers in order of arrival.
    unproven: BTreeMap<u64, Arc<Seat>>,
}

/// Seats of a port. Clones share them.
#[derive(Clone, Default)]
pub(super) struct Directory(Arc<Mutex<Seats>>);

impl Directory {
    fn with<R>(&self, f: impl FnOnce(&mut Seats) -> R) -> R {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes a seat, if need be that of an unproven connection: of the same address when that has too many, else of any.
    /// `None` when all are proven.
    pub(super) fn take(&self, limits: &Limits, peer: Option<IpAddr>) -> Option<Arc<Seat>> {
        self.with(|s| {
            let of_peer = peer.map_or(0, |ip| s.peers.get(&ip).copied().unwrap_or(0));
            let is_peer_full = of_peer >= limits.per_peer;
            if is_peer_full || s.taken >= limits.connections {
                let rivals = s.unproven.values();
                let rivals = rivals.filter(|r| !is_peer_full || r.peer == peer);
                let number = victim(rivals, Instant::now())?;
                s.unproven.remove(&number)?.end();
                metrics::counter!("tryon_connections_evicted").increment(1);
            }
            let seat = Arc::new(Seat::new(s.next, peer, self.clone()));
            s.next += 1;
            s.taken += 1;
            if let Some(ip) = peer {
                *s.peers.entry(ip).or_default() += 1;
            }
            s.unproven.insert(seat.number, seat.clone());
            Some(seat)
        })
    }
}

/// Connection that ends for a newcomer, of `rivals` in order of arrival: the oldest one that had time to speak and did
/// not, else the oldest stranger, else the oldest.
fn victim<'a>(rivals: impl Iterator<Item = &'a Arc<Seat>>, now: Instant) -> Option<u64> {
    let (mut stranger, mut oldest) = (None, None);
    for r in rivals {
        if r.has_spoken.load(Ordering::Relaxed) {
            stranger = stranger.or(Some(r.number));
        } else if now.saturating_duration_since(r.arrived) > GRACE {
            return Some(r.number);
        }
        oldest = oldest.or(Some(r.number));
    }
    stranger.or(oldest)
}

/// Group of addresses whose connections are counted together; `None` for this machine's own.
pub(super) fn counted(peer: SocketAddr) -> Option<IpAddr> {
    Some(group(peer.ip())).filter(|_| !peer.ip().to_canonical().is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(connections: usize, per_peer: usize) -> Limits {
        Limits {
            connections,
            per_peer,
            ..Limits::default()
        }
    }

    fn address(text: &str) -> Option<IpAddr> {
        counted(text.parse().expect("an address"))
    }

    /// Takes `n` seats of this machine.
    fn take(seats: &Directory, limits: &Limits, n: usize) -> Vec<Arc<Seat>> {
        let one = |_| seats.take(limits, None).expect("a seat");
        (0..n).map(one).collect()
    }

    #[test]
    fn another_machine_has_its_share_of_the_seats_and_this_one_all() {
        let (seats, limits) = (Directory::default(), limits(512, 2));
        let far = [(); 2].map(|()| seats.take(&limits, address("192.0.2.1:9")).expect("a seat"));
        far.iter().for_each(|s| s.prove());
        assert!(seats.take(&limits, address("192.0.2.1:9")).is_none());
        let near = address("[::ffff:127.0.0.1]:9");
        assert!((0..3).all(|_| seats.take(&limits, near).is_some()));
        assert_eq!(seats.with(|s| (s.taken, s.peers.len())), (5, 1));
        far.iter().for_each(|s| s.leave());
        assert_eq!(seats.with(|s| (s.taken, s.peers.len())), (3, 0));
    }

    #[test]
    fn a_customer_with_a_whole_network_of_ipv6_has_one_share() {
        let (seats, limits) = (Directory::default(), limits(512, 8));
        let take = |i: usize| seats.take(&limits, address(&format!("[2001:db8::{i:x}]:9")));
        let taken: Vec<_> = (0..64).filter_map(take).collect();
        assert_eq!(taken.iter().filter(|s| !s.is_ended()).count(), 8);
        assert!(
            !seats
                .take(&limits, address("[2001:db8:0:1::]:9"))
                .expect("other")
                .is_ended()
        );
        assert_eq!(taken.iter().filter(|s| !s.is_ended()).count(), 8);
    }

    #[test]
    fn silence_is_evicted_first_then_strangers_by_age_and_proof_never() {
        let (seats, limits) = (Directory::default(), limits(5, 64));
        let all = take(&seats, &limits, 5);
        all[..3].iter().for_each(|s| s.speak());
        all[0].prove();
        let later = Instant::now() + 2 * GRACE;
        let order = |now| {
            let mut left: Vec<_> = seats.with(|s| s.unproven.values().cloned().collect());
            let next = || {
                let number = victim(left.iter(), now)?;
                left.retain(|s| s.number != number);
                Some(number)
            };
            std::iter::from_fn(next).collect::<Vec<_>>()
        };
        assert_eq!(order(later), [3, 4, 1, 2]);
        // Those that came just now have time to speak.
        assert_eq!(order(Instant::now()), [1, 2, 3, 4]);
    }

    #[test]
    fn a_newcomer_gets_in_beside_thousands_and_proven_ones_stay() {
        let (seats, limits) = (Directory::default(), limits(512, 64));
        let kiosk = seats.take(&limits, None).expect("a seat");
        kiosk.prove();
        for s in take(&seats, &limits, 2000) {
            s.speak();
        }
        let newcomer = seats.take(&limits, None).expect("a seat");
        take(&seats, &limits, 400).iter().for_each(|s| s.speak());
        assert!(!kiosk.is_ended() && !newcomer.is_ended());
        let proven = Directory::default();
        take(&proven, &limits, 512).iter().for_each(|s| s.prove());
        assert!(proven.take(&limits, None).is_none(), "all are proven");
    }

    #[test]
    fn strangers_of_an_address_end_for_its_newcomer_and_for_no_other() {
        let (seats, limits) = (Directory::default(), limits(512, 64));
        let (ours, theirs) = (address("192.0.2.1:9"), address("192.0.2.2:9"));
        let other = seats.take(&limits, theirs).expect("a seat");
        let flood: Vec<_> = (0..2000)
            .filter_map(|_| seats.take(&limits, ours))
            .collect();
        let newcomer = seats.take(&limits, ours).expect("a seat");
        assert!(!newcomer.is_ended() && !other.is_ended());
        assert_eq!(flood.iter().filter(|s| !s.is_ended()).count(), 63);
    }

    #[test]
    fn failed_proofs_end_a_connection_unless_it_is_proven() {
        let [bad, shared] = take(&Directory::default(), &limits(9, 9), 2)
            .try_into()
            .unwrap_or_else(|_| unreachable!());
        shared.prove();
        assert!(bad.is_clean());
        for _ in 0..FAILED_PROOFS {
            bad.fail_proof();
            assert!(!bad.is_ended() && !bad.is_clean());
        }
        bad.fail_proof();
        (0..100).for_each(|_| shared.fail_proof());
        assert!(bad.is_ended() && !shared.is_ended());
    }
}
