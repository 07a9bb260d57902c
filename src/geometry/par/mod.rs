//! The only door to rayon: parallel loops and reductions whose bits do not depend on the thread count.
//!
//! Work is cut into chunks of a fixed size, never into one chunk a thread, and partial results are
//! combined in the order of the chunks. So sums come out the same with 1, 2 or N threads.

pub(crate) mod lockstep;

pub use lockstep::lockstep;

use rayon::prelude::*;

/// Use of threads by a step. Threads come from the caller's pool ([`with_threads`]) or the global one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Par {
    /// The calling thread only.
    Seq,
    /// As many threads as the current pool has.
    #[default]
    Rayon,
}

/// Starts the global pool, unless it runs: its threads take over the calling thread's priority.
pub fn start() {
    // An error means that it runs.
    let _ = rayon::ThreadPoolBuilder::new()
        .thread_name(|i| format!("par-{i}"))
        .build_global();
}

/// Runs `f` inside a pool of `threads` threads (0 = one per core).
///
/// # Errors
/// When the operating system refuses the threads.
pub fn with_threads<R: Send>(threads: usize, f: impl FnOnce() -> R + Send) -> Result<R, PoolError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| PoolError(e.to_string()))?;
    Ok(pool.install(f))
}

/// The thread pool could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start the thread pool: {0}")]
pub struct PoolError(String);

/// Calls `f(start_index, chunk)` on fixed-size chunks of `items`.
pub fn for_chunks<T: Send>(
    par: Par,
    items: &mut [T],
    chunk: usize,
    f: impl Fn(usize, &mut [T]) + Sync,
) {
    let chunk = chunk.max(1);
    match par {
        Par::Seq => items
            .chunks_mut(chunk)
            .enumerate()
            .for_each(|(i, c)| f(i * chunk, c)),
        Par::Rayon => items
            .par_chunks_mut(chunk)
            .enumerate()
            .for_each(|(i, c)| f(i * chunk, c)),
    }
}

/// `out[i] = f(i)` for all `i < n`, `chunk` at a time.
pub fn map_into<T: Send + Default + Clone>(
    par: Par,
    n: usize,
    chunk: usize,
    out: &mut Vec<T>,
    f: impl Fn(usize) -> T + Sync,
) {
    out.resize(n, T::default());
    for_chunks(par, out, chunk, |start, c| {
        for (k, slot) in c.iter_mut().enumerate() {
            *slot = f(start + k);
        }
    });
}

/// Runs two closures, in parallel when allowed, and returns both results.
pub fn join<A: Send, B: Send>(
    par: Par,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    match par {
        Par::Seq => (a(), b()),
        Par::Rayon => rayon::join(a, b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_the_same_at_any_thread_count() {
        let starts = |par| {
            let mut items = vec![0; 1003];
            for_chunks(par, &mut items, 64, |start, c| c.fill(start + c.len()));
            items
        };
        let seq = starts(Par::Seq);
        assert_eq!((seq[0], seq[1002]), (64, 960 + 43));
        for threads in [1, 2, 5] {
            let got = with_threads(threads, || starts(Par::Rayon)).expect("pool");
            assert_eq!(got, seq, "{threads} threads");
        }
    }

    #[test]
    fn map_and_join_see_every_index() {
        let mut out = Vec::new();
        map_into(Par::Rayon, 1000, 64, &mut out, |i| i * i);
        assert!(out.iter().enumerate().all(|(i, v)| *v == i * i));
        assert_eq!(join(Par::Rayon, || 1, || 2), (1, 2));
    }
}
