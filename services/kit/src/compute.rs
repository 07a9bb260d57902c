//! Compute pool: threads for computation, so that async workers only ever wait.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use tokio::sync::oneshot;
use tryon_geometry::par::{PoolError, with_threads};

type Job = Box<dyn FnOnce() + Send>;

/// Niceness of background threads: a third of another thread's share where both want a processor (Linux, CFS weights). A
/// larger one starves a camera on a machine without a free processor.
const BACKGROUND_NICENESS: i32 = 5;

/// Fixed number of threads that run jobs in order of arrival.
///
/// The queue is unbounded: every session has at most one job under way, sessions are bounded, and jobs that nobody waits for
/// any more are left out.
pub struct Pool {
    jobs: Mutex<mpsc::Sender<Job>>,
}

/// Job without a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ComputeError {
    /// The job panicked; its state is lost, the pool goes on.
    #[error("the computation panicked")]
    Panicked,
    /// The pool is shutting down.
    #[error("the compute pool is gone")]
    Gone,
}

/// Runs jobs until the pool is gone.
fn serve(jobs: &Mutex<mpsc::Receiver<Job>>) {
    loop {
        // The lock is held while waiting: the other idle threads wait for it.
        let job = jobs.lock().unwrap_or_else(PoisonError::into_inner).recv();
        match job {
            Ok(job) => job(),
            Err(mpsc::RecvError) => return,
        }
    }
}

/// Lowers the priority of the calling thread and of those that it starts.
fn lower_priority(niceness: i32) {
    // Of this thread alone on Linux; a refusal costs only the priority.
    let _ = rustix::process::nice(niceness);
}

/// Runs `f` with parallel loops on threads of its own, one for each core, at low priority like [`Pool::background`]. The
/// calling thread, which waits, keeps the low priority.
///
/// # Errors
/// When the system refuses the threads.
pub fn run_in_background<R: Send>(f: impl FnOnce() -> R + Send) -> Result<R, PoolError> {
    lower_priority(BACKGROUND_NICENESS);
    with_threads(0, f)
}

impl Pool {
    /// Starts `threads` threads; 0 means one for each core.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn new(threads: usize) -> std::io::Result<Arc<Self>> {
        let n = if threads == 0 {
            std::thread::available_parallelism().map_or(2, usize::from)
        } else {
            threads
        };
        Self::start(n, "compute", 0)
    }

    /// Starts one thread at low priority, for work that has time: it gets what the threads of [`Self::new`] leave. Its
    /// jobs may wait for a device.
    ///
    /// # Errors
    /// When the system refuses the thread.
    pub fn background(name: &str) -> std::io::Result<Arc<Self>> {
        Self::start(1, name, BACKGROUND_NICENESS)
    }

    fn start(threads: usize, name: &str, niceness: i32) -> std::io::Result<Arc<Self>> {
        // Here, lest a background thread be the first to need them: they would take over its priority.
        tryon_geometry::par::start();
        let (tx, rx) = mpsc::channel::<Job>();
        let rx = Arc::new(Mutex::new(rx));
        for i in 0..threads {
            let rx = rx.clone();
            std::thread::Builder::new()
                .name(format!("{name}-{i}"))
                .spawn(move || {
                    if niceness != 0 {
                        lower_priority(niceness);
                    }
                    serve(&rx);
                })?;
        }
        Ok(Arc::new(Self {
            jobs: Mutex::new(tx),
        }))
    }

    /// Runs `f` on the pool and waits for its result. Dropping the future discards the result of a job that has begun;
    /// one that still waits is left out, so that callers who come and go faster than the pool works leave no backlog.
    ///
    /// # Errors
    /// [`ComputeError`] when the job panicked or the pool is gone.
    pub async fn run<T: Send + 'static>(
        &self,
        f: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ComputeError> {
        let (tx, rx) = oneshot::channel();
        let job: Job = Box::new(move || {
            if tx.is_closed() {
                return;
            }
            // A panic loses the state that moved into the job; nothing shared is left half changed.
            let answer = catch_unwind(AssertUnwindSafe(f));
            let _ = tx.send(answer);
        });
        self.jobs
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .send(job)
            .map_err(|_| ComputeError::Gone)?;
        rx.await
            .map_err(|_| ComputeError::Gone)?
            .map_err(|_| ComputeError::Panicked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[tokio::test]
    async fn jobs_answer_and_a_panic_costs_only_itself() {
        let pool = Pool::new(2).expect("threads");
        assert_eq!(pool.run(|| 6 * 7).await, Ok(42));
        assert_eq!(
            pool.run(|| -> i32 { panic!("on purpose") }).await,
            Err(ComputeError::Panicked)
        );
        assert_eq!(pool.run(|| 1).await, Ok(1));
    }

    #[tokio::test]
    async fn jobs_that_nobody_waits_for_are_left_out() {
        let pool = Pool::new(1).expect("a thread");
        let (release, held) = mpsc::channel::<()>();
        let first = pool.run(move || held.recv());
        let ran = Arc::new(AtomicUsize::new(0));
        let count = |ran: &Arc<AtomicUsize>| {
            let ran = ran.clone();
            move || ran.fetch_add(1, Ordering::Relaxed)
        };
        tokio::pin!(first);
        assert!(futures::poll!(&mut first).is_pending());
        for _ in 0..100 {
            let mut left = Box::pin(pool.run(count(&ran)));
            assert!(futures::poll!(&mut left).is_pending());
        }
        let mut last = Box::pin(pool.run(count(&ran)));
        assert!(futures::poll!(&mut last).is_pending());
        release.send(()).expect("held");
        assert_eq!(last.await, Ok(0));
    }

    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn only_background_threads_step_back() {
        let niceness = || rustix::process::getpriority_process(None).expect("known");
        let usual = Pool::new(1).expect("a thread");
        let background = Pool::background("source").expect("a thread");
        let low = background.run(niceness).await.expect("runs");
        let own = usual.run(niceness).await.expect("runs");
        assert_eq!(low, (own + BACKGROUND_NICENESS).min(19));
        assert_eq!(own, niceness());
        let parallel = std::thread::spawn(move || run_in_background(niceness));
        let parallel = parallel.join().expect("no panic").expect("threads");
        assert_eq!(parallel, low);
    }
}
