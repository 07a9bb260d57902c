//! The whole chain from a client's view: contents and times of its messages.
#![allow(
    clippy::unwrap_used,
    missing_docs,
    unreachable_pub,
    clippy::print_stdout
)]

mod color;
mod consent;
mod faults;
mod fine;
mod kiosk;
mod requests;
mod restarts;
mod simulation;
mod tokens;
mod try_on;

/// Runs a client on a runtime of its own.
fn client<T>(f: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .expect("a runtime")
        .block_on(f)
}
