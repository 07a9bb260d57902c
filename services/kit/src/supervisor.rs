//! Messages to systemd by `sd_notify`: ready once every port is bound, alive while the process can do its work, stopping
//! at a signal. Without `NOTIFY_SOCKET` in the environment nothing is sent.

use crate::compute::Pool;
use sd_notify::NotifyState;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::JoinHandle;

/// Proofs of life within one period of the watchdog: one lost to a busy moment is no death.
const PROOFS: u32 = 3;

fn send(state: &NotifyState<'_>) {
    if let Err(e) = sd_notify::notify(std::slice::from_ref(state)) {
        tracing::warn!(error = %e, "could not notify the supervisor");
    }
}

/// Tells that the service is up, and with a watchdog feeds it from now on until the task is aborted.
pub fn ready(pool: &Arc<Pool>, admin: SocketAddr) -> Option<JoinHandle<()>> {
    send(&NotifyState::Ready);
    let every = sd_notify::watchdog_enabled()? / PROOFS;
    Some(tokio::spawn(feed(pool.clone(), admin, every)))
}

/// Tells that the service drains.
pub fn stopping() {
    send(&NotifyState::Stopping);
}

async fn feed(pool: Arc<Pool>, admin: SocketAddr, every: Duration) {
    let mut tick = tokio::time::interval(every);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tick.tick().await;
        if is_live(&pool, admin, every).await {
            send(&NotifyState::Watchdog);
        } else {
            tracing::error!("no proof of life within {every:?}: the watchdog is not fed");
        }
    }
}

/// The compute pool finishes a job and the admin port answers, both within `limit`: no frame, body or picture is made
/// without the one, and no request is served without the runtime that the other needs.
async fn is_live(pool: &Pool, admin: SocketAddr, limit: Duration) -> bool {
    let proofs = async { (pool.run(|| ()).await.is_ok(), answers(admin).await.is_ok()) };
    tokio::time::timeout(limit, proofs).await == Ok((true, true))
}

/// One request to `/healthz`.
async fn answers(mut admin: SocketAddr) -> std::io::Result<()> {
    if admin.ip().is_unspecified() {
        admin.set_ip(match admin {
            SocketAddr::V4(_) => std::net::Ipv4Addr::LOCALHOST.into(),
            SocketAddr::V6(_) => std::net::Ipv6Addr::LOCALHOST.into(),
        });
    }
    let mut stream = TcpStream::connect(admin).await?;
    stream
        .write_all(b"GET /healthz HTTP/1.0\r\nHost: localhost\r\n\r\n")
        .await?;
    let mut head = [0; 12];
    stream.read_exact(&mut head).await?;
    if head.ends_with(b" 200") {
        Ok(())
    } else {
        Err(std::io::Error::other("the admin port answers with a fault"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::sync::watch;
    use tokio_util::sync::CancellationToken;

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_stuck_pool_and_a_dead_port_are_no_life() {
        let pool = Pool::new(1).expect("a thread");
        let (_ready, is_ready) = watch::channel(true);
        let end = CancellationToken::new();
        let any = "127.0.0.1:0".parse().expect("an address");
        let health = tonic_health::server::HealthReporter::new();
        let served = crate::admin::serve(any, is_ready, health, end.clone());
        let admin = served.await.expect("bound");
        let limit = Duration::from_secs(2);
        assert!(is_live(&pool, admin, limit).await);

        let (release, stuck) = std::sync::mpsc::channel::<()>();
        let (begun, has_begun) = tokio::sync::oneshot::channel();
        let busy = pool.clone();
        let work = move || begun.send(()).is_ok() && stuck.recv().is_err();
        let job = tokio::spawn(async move { busy.run(work).await });
        assert_eq!(has_begun.await, Ok(()));
        assert!(!is_live(&pool, admin, Duration::from_millis(300)).await);
        drop(release);
        assert!(job.await.expect("joined").is_ok());
        assert!(is_live(&pool, admin, limit).await);

        let dead = "127.0.0.1:1".parse().expect("an address");
        assert!(!is_live(&pool, dead, limit).await);
    }
}
