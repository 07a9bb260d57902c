//! Shutdown with a deadline: work has `grace` to finish, then it is cut.
//!
//! hyper's graceful shutdown alone can wait for an hour on one connection (hyper #4170).

use std::future::Future;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// End of a server.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drained {
    /// Everything finished by itself.
    Clean,
    /// The deadline cut something off.
    DeadlineHit,
}

/// Runs `work` until it ends by itself or `grace` has passed since `shutdown`.
///
/// # Errors
/// Passes on the error of `work`.
pub async fn until_deadline<E>(
    work: impl Future<Output = Result<(), E>>,
    shutdown: CancellationToken,
    grace: Duration,
) -> Result<Drained, E> {
    let deadline = async {
        shutdown.cancelled().await;
        tokio::time::sleep(grace).await;
    };
    tokio::select! {
        r = work => r.map(|()| Drained::Clean),
        () = deadline => Ok(Drained::DeadlineHit),
    }
}

/// Waits for SIGTERM or SIGINT and returns its name.
///
/// # Errors
/// When the system refuses a handler.
pub async fn signal() -> std::io::Result<&'static str> {
    use tokio::signal::unix::{SignalKind, signal};
    let (mut term, mut int) = (
        signal(SignalKind::terminate())?,
        signal(SignalKind::interrupt())?,
    );
    Ok(tokio::select! {
        _ = term.recv() => "SIGTERM",
        _ = int.recv() => "SIGINT",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn work_that_never_ends_ends_at_the_deadline() {
        let token = CancellationToken::new();
        token.cancel();
        let grace = Duration::from_millis(30);
        let r = until_deadline(
            std::future::pending::<Result<(), ()>>(),
            token.clone(),
            grace,
        )
        .await;
        assert_eq!(r, Ok(Drained::DeadlineHit));
        let r = until_deadline(async { Ok::<(), ()>(()) }, token, grace).await;
        assert_eq!(r, Ok(Drained::Clean));
    }
}
