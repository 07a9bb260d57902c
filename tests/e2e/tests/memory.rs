//! Memory of dressed sessions: what a session allocates goes with it. A program of its own, since it counts all of its
//! process's memory.
#![allow(
    clippy::unwrap_used,
    missing_docs,
    unreachable_pub,
    clippy::print_stdout
)]

#[allow(dead_code, reason = "other programs use the rest")]
#[path = "chain/kiosk.rs"]
mod kiosk;

use kiosk::{Kiosk, Watcher};
use std::time::Duration;
use tryon_kit::forget::{ZEROING, Zeroing};
use tryon_proto::v1::*;

/// The allocator of the programs, which counts.
#[global_allocator]
static ALLOCATOR: cap::Cap<Zeroing> = cap::Cap::new(ZEROING, usize::MAX);

/// Sessions before the first count: buffers of transports, tables, thread pools and epochs have grown by then.
const WARM: usize = 10;
/// Sessions between two counts.
const EVERY: usize = 10;
/// Sessions after the first count: few enough that one body that stays shows (50 kB of each). The variable asks for more.
const COUNTED: usize = 10;
const SESSIONS: &str = "TRYON_SESSIONS";
/// Most bytes of a session that stay. One body is 0.5 MB, one outfit 3 MB. The first 40 sessions fill nodes of epochs, of
/// which a thread holds 64 at the most (docs/decisions/074): 4 to 8 kB of each of the first 20 counted, 1.1 kB after 40.
const MOST_KEPT: f64 = 25e3;

/// Bytes of this process.
struct Memory {
    allocated: f64,
    resident: f64,
}

impl Memory {
    /// Counts between two visits, once the sessions behind the last one have ended.
    async fn count() -> Self {
        tokio::time::sleep(Duration::from_millis(1500)).await;
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let line = status.lines().find(|l| l.starts_with("VmRSS:"));
        let kib = line.and_then(|l| l.split_whitespace().nth(1)?.parse::<f64>().ok());
        Self {
            allocated: ALLOCATOR.allocated() as f64,
            resident: kib.map_or(f64::NAN, |k| k * 1024.0),
        }
    }
}

/// One visit: opened, dressed, closed.
async fn visit(kiosk: &Kiosk, id: String) {
    let mut watcher = Watcher::open(kiosk, &id, "front", &["tshirt"]).await;
    watcher.picture(TryOnState::Live).await;
    drop(watcher);
    let request = CloseTryOnRequest { try_on_id: id };
    kiosk
        .compositor()
        .close_try_on(request)
        .await
        .expect("closed");
}

#[test]
fn dressed_sessions_leave_no_memory_behind() {
    let counted = std::env::var(SESSIONS).map_or(COUNTED, |n| n.parse().expect(SESSIONS));
    let kiosk = Kiosk::start("synth:still", 15.0);
    let client = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .expect("a runtime");
    client.block_on(async {
        let (mut first, mut kept) = (None, 0.0);
        for k in 1..=WARM + counted {
            visit(&kiosk, format!("visit-{k}")).await;
            if k < WARM || !(k - WARM).is_multiple_of(EVERY) {
                continue;
            }
            let now = Memory::count().await;
            kept = now.allocated - *first.get_or_insert(now.allocated);
            println!(
                "{k} sessions: {kept:.0} bytes stay, {:.1} MiB are resident",
                now.resident / 1024.0 / 1024.0
            );
        }
        let each = kept / counted as f64;
        assert!(each < MOST_KEPT, "{each:.0} bytes of each session stay");
    });
}
