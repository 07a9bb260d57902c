//! Many short iterations over the same few items in lockstep: a spin barrier between iterations.
//!
//! A parallel loop wakes its threads once an iteration, a quarter of the time at 0.15 ms of work. Here threads stay and
//! spin between iterations.

use super::Par;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Polls of the barrier before a thread yields its core: about as long as waking a sleeping thread takes.
const SPINS_BEFORE_YIELD: usize = 4000;

/// Items and the barrier that separates their iterations.
struct SpinBarrier<'a, T, F> {
    /// Next iteration of each item, and the item.
    items: Vec<(AtomicUsize, Mutex<&'a mut T>)>,
    iterations: usize,
    /// Iteration that runs.
    current: AtomicUsize,
    /// Items that have not ended it.
    pending: AtomicUsize,
    panicked: AtomicBool,
    f: F,
}

/// Calls `f(iteration, index, item)` for every item in every iteration; none begins before all items ended the last.
///
/// A thread prefers the items it had, and takes over those of late threads. The calling thread does what no other does,
/// so missing threads cost time only.
pub fn lockstep<T: Send>(
    par: Par,
    items: &mut [T],
    iterations: usize,
    f: impl Fn(usize, usize, &mut T) + Sync,
) {
    let threads = match par {
        Par::Seq => 1,
        Par::Rayon => rayon::current_num_threads().min(items.len()),
    };
    if threads <= 1 {
        for k in 0..iterations {
            let items = items.iter_mut().enumerate();
            items.for_each(|(i, item)| f(k, i, item));
        }
        return;
    }
    let barrier = SpinBarrier {
        pending: AtomicUsize::new(items.len()),
        items: items
            .iter_mut()
            .map(|i| (AtomicUsize::new(0), Mutex::new(i)))
            .collect(),
        iterations,
        current: AtomicUsize::new(0),
        panicked: AtomicBool::new(false),
        f,
    };
    rayon::in_place_scope(|scope| {
        let barrier = &barrier;
        for k in 1..threads {
            scope.spawn(move |_| barrier.run(k));
        }
        barrier.run(0);
    });
}

/// Records on drop that its thread panics, so that the others stop waiting.
struct PanicFlag<'a>(&'a AtomicBool);

impl Drop for PanicFlag<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Release);
        }
    }
}

impl<T: Send, F: Fn(usize, usize, &mut T) + Sync> SpinBarrier<'_, T, F> {
    /// Takes part in all iterations, in each from item `first` on.
    fn run(&self, first: usize) {
        let _flag = PanicFlag(&self.panicked);
        let n = self.items.len();
        let mut iteration = self.current.load(Ordering::Acquire);
        while iteration < self.iterations {
            for k in 0..n {
                if self.try_item((first + k) % n, iteration).is_none() {
                    return;
                }
            }
            match self.wait_after(iteration) {
                Some(next) => iteration = next,
                None => return,
            }
        }
    }
    /// Does one item unless another thread has it; `None` when that thread panicked.
    fn try_item(&self, i: usize, iteration: usize) -> Option<()> {
        let (next, item) = &self.items[i];
        let taken = next.compare_exchange(
            iteration,
            iteration + 1,
            Ordering::AcqRel,
            Ordering::Relaxed,
        );
        if taken.is_err() {
            return Some(());
        }
        let mut item = item.lock().ok()?;
        (self.f)(iteration, i, &mut item);
        drop(item);
        if self.pending.fetch_sub(1, Ordering::AcqRel) == 1 {
            self.pending.store(self.items.len(), Ordering::Relaxed);
            self.current.store(iteration + 1, Ordering::Release);
        }
        Some(())
    }
    /// Spins until `iteration` has ended and returns the next; `None` when a thread panicked.
    fn wait_after(&self, iteration: usize) -> Option<usize> {
        let mut spins = 0usize;
        loop {
            let next = self.current.load(Ordering::Acquire);
            if next != iteration {
                return Some(next);
            }
            if self.panicked.load(Ordering::Acquire) {
                return None;
            }
            spins += 1;
            if spins.is_multiple_of(SPINS_BEFORE_YIELD) {
                std::thread::yield_now();
            } else {
                std::hint::spin_loop();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::with_threads;
    use super::*;

    /// Every item adds up what its neighbour published in the last iteration.
    fn relay(threads: usize, items: usize, n: usize) -> Vec<u64> {
        let published: Vec<[Mutex<u64>; 2]> = (0..items)
            .map(|i| [Mutex::new(i as u64), Mutex::new(0)])
            .collect();
        let mut all = vec![0u64; items];
        with_threads(threads, || {
            lockstep(Par::Rayon, &mut all, n, |r, i, mine| {
                let near = *published[(i + 1) % items][r % 2].lock().expect("whole");
                *mine = mine.wrapping_mul(31).wrapping_add(near);
                *published[i][(r + 1) % 2].lock().expect("whole") = *mine;
            });
        })
        .expect("threads");
        all
    }

    #[test]
    fn iterations_wait_for_each_other_at_any_thread_count() {
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
        lockstep(Par::Rayon, &mut [0u8; 0], 3, |_, _, _| unreachable!());
        lockstep(Par::Rayon, &mut [0u8; 2], 0, |_, _, _| unreachable!());
    }

    #[test]
    fn a_panic_of_one_thread_ends_all() {
        let caught = std::panic::catch_unwind(|| {
            with_threads(2, || {
                lockstep(Par::Rayon, &mut [0u8; 4], 9, |r, i, _| {
                    assert!(r < 3 || i != 2, "one")
                })
            })
        });
        assert!(caught.is_err());
    }
}
