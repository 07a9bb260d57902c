//! Many short rounds over the same few items, each round begun when all items have had the one before.
//!
//! A parallel loop a round wakes and puts to sleep its threads each time: with 0.15 ms of work a round a quarter of the
//! time went into that. Here threads stay and spin between rounds.

use super::Par;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Looks for the next round before a thread lets others run: about as long as waking a sleeping one takes.
const SPINS: usize = 4000;

struct Crew<'a, T, F> {
    items: Vec<(AtomicUsize, Mutex<&'a mut T>)>,
    rounds: usize,
    /// The round that runs.
    round: AtomicUsize,
    /// Items that it has left.
    left: AtomicUsize,
    broken: AtomicBool,
    f: F,
}

/// Calls `f(round, index, item)` for every item in every round; no item begins a round before all have ended the last.
/// A thread prefers the items it had, and takes over those whose thread is late. Threads that come late or never cost
/// time only, as the calling thread does what nobody else does.
pub fn rounds<T: Send>(
    par: Par,
    items: &mut [T],
    rounds: usize,
    f: impl Fn(usize, usize, &mut T) + Sync,
) {
    let threads = if par == Par::Seq {
        1
    } else {
        rayon::current_num_threads().min(items.len())
    };
    if threads <= 1 {
        for r in 0..rounds {
            items
                .iter_mut()
                .enumerate()
                .for_each(|(i, item)| f(r, i, item));
        }
        return;
    }
    let crew = Crew {
        left: AtomicUsize::new(items.len()),
        items: items
            .iter_mut()
            .map(|i| (AtomicUsize::new(0), Mutex::new(i)))
            .collect(),
        rounds,
        round: AtomicUsize::new(0),
        broken: AtomicBool::new(false),
        f,
    };
    rayon::in_place_scope(|scope| {
        let crew = &crew;
        for k in 1..threads {
            scope.spawn(move |_| crew.work(k));
        }
        crew.work(0);
    });
}

/// Says that a thread of the crew panicked, so that the others don't wait for it.
struct Alarm<'a>(&'a AtomicBool);

impl Drop for Alarm<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Release);
        }
    }
}

impl<T: Send, F: Fn(usize, usize, &mut T) + Sync> Crew<'_, T, F> {
    fn work(&self, first: usize) {
        let _alarm = Alarm(&self.broken);
        let n = self.items.len();
        let mut round = self.round.load(Ordering::Acquire);
        while round < self.rounds {
            for k in 0..n {
                let i = (first + k) % n;
                let (next, item) = &self.items[i];
                if next
                    .compare_exchange(round, round + 1, Ordering::AcqRel, Ordering::Relaxed)
                    .is_err()
                {
                    continue;
                }
                let Ok(mut item) = item.lock() else { return };
                (self.f)(round, i, &mut item);
                drop(item);
                if self.left.fetch_sub(1, Ordering::AcqRel) == 1 {
                    self.left.store(n, Ordering::Relaxed);
                    self.round.store(round + 1, Ordering::Release);
                }
            }
            let mut spins = 0usize;
            let before = round;
            loop {
                round = self.round.load(Ordering::Acquire);
                if round != before {
                    break;
                }
                if self.broken.load(Ordering::Acquire) {
                    return;
                }
                spins += 1;
                if spins.is_multiple_of(SPINS) {
                    std::thread::yield_now();
                } else {
                    std::hint::spin_loop();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::with_threads;
    use super::*;

    /// Every item adds up what its neighbour published in the round before.
    fn relay(threads: usize, items: usize, n: usize) -> Vec<u64> {
        let published: Vec<[Mutex<u64>; 2]> = (0..items)
            .map(|i| [Mutex::new(i as u64), Mutex::new(0)])
            .collect();
        let mut all = vec![0u64; items];
        with_threads(threads, || {
            rounds(Par::Rayon, &mut all, n, |r, i, mine| {
                let near = *published[(i + 1) % items][r % 2].lock().expect("whole");
                *mine = mine.wrapping_mul(31).wrapping_add(near);
                *published[i][(r + 1) % 2].lock().expect("whole") = *mine;
            });
        })
        .expect("threads");
        all
    }

    #[test]
    fn rounds_wait_for_each_other_at_any_thread_count() {
        for items in [1, 2, 3, 7] {
            let one = relay(1, items, 500);
            for threads in [2, 3, 8] {
                assert_eq!(
                    relay(threads, items, 500),
                    one,
                    "{threads} threads, {items} items"
                );
            }
        }
        rounds(Par::Rayon, &mut [0u8; 0], 3, |_, _, _| unreachable!());
        rounds(Par::Rayon, &mut [0u8; 2], 0, |_, _, _| unreachable!());
    }

    #[test]
    fn a_panic_in_one_ends_all() {
        let caught = std::panic::catch_unwind(|| {
            with_threads(2, || {
                rounds(Par::Rayon, &mut [0u8; 4], 9, |r, i, _| {
                    assert!(r < 3 || i != 2, "one")
                })
            })
        });
        assert!(caught.is_err());
    }
}
