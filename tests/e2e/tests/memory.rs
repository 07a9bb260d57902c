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
use std::alloc::System;
use std::time::Duration;
use tryon_proto::v1::*;

/// The system's allocator, which counts.
#[global_allocator]
static ALLOCATOR: cap::Cap<System> = cap::Cap::new(System, usize::MAX);

/// Sessions before the first count: buffers of transports, tables and thread pools have grown by then.
const WARM: usize = 4;
/// Sessions between the two counts.
const COUNTED: usize = 10;
/// Most bytes of a session that stay: what zenoh, h2 and the metrics keep is 12 kB on average over 24 sessions and does not
/// grow with their number; one body is 0.5 MB, one outfit 3 MB.
const MOST_KEPT: f64 = 50e3;

/// One visit: opened, dressed, closed, and gone.
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
    // The sessions behind it end on their own.
    tokio::time::sleep(Duration::from_millis(1500)).await;
}

#[test]
fn dressed_sessions_leave_no_memory_behind() {
    let kiosk = Kiosk::start("synth:still", 15.0);
    let client = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .expect("a runtime");
    client.block_on(async {
        let mut before = 0;
        for k in 0..WARM + COUNTED {
            if k == WARM {
                before = ALLOCATOR.allocated();
            }
            visit(&kiosk, format!("visit-{k}")).await;
        }
        // Samples of histograms wait for the next reader of the metrics.
        if let Some(metrics) = tryon_kit::telemetry::metrics() {
            metrics.run_upkeep();
        }
        let kept = ALLOCATOR.allocated() as f64 - before as f64;
        println!("{:.0} bytes of each session stay", kept / COUNTED as f64);
        assert!(kept < MOST_KEPT * COUNTED as f64, "{kept} bytes stay");
    });
}
