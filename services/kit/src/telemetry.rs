//! Logs and metrics. Neither ever carries pixels or poses.

use crate::config::{LogConfig, LogFormat};
use crate::frame_trace;
use crate::log_fields::EscapedFields;
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};
use std::sync::OnceLock;
use std::time::Duration;
use tracing_subscriber::EnvFilter;
use tryon_proto::v1::{FrameId, StageTime};

/// Starts logging to standard error; later calls in the same process change nothing.
///
/// # Errors
/// A `level` that is no filter.
pub fn init_logs(config: &LogConfig) -> Result<(), String> {
    config.check_level()?;
    let filter = EnvFilter::try_new(&config.level).map_err(|e| e.to_string())?;
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr);
    // A second subscriber is refused and the first one stays: tests and `demo` rely on it.
    let _ = match config.format {
        LogFormat::Json => builder.json().try_init(),
        LogFormat::Pretty => builder.fmt_fields(EscapedFields::default()).try_init(),
    };
    Ok(())
}

/// Upper bounds of the time histograms (ms): fine below a frame interval at 30/s, coarse above.
const MS_BUCKETS: [f64; 14] = [
    0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 33.0, 66.0, 100.0, 150.0, 250.0, 500.0, 1000.0,
];

/// Upper bounds of the histogram of garments off the person, shares: fine about the 2 % above which a part hangs off.
const SHARE_BUCKETS: [f64; 10] = [0.0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.4, 1.0];

/// The process's metrics; the first call installs the recorder.
pub fn metrics() -> Option<&'static PrometheusHandle> {
    static HANDLE: OnceLock<Option<PrometheusHandle>> = OnceLock::new();
    let install = || {
        let shares = Matcher::Full("tryon_garment_off_person".into());
        PrometheusBuilder::new()
            .set_buckets(&MS_BUCKETS)
            .ok()?
            .set_buckets_for_metric(shares, &SHARE_BUCKETS)
            .ok()?
            .install_recorder()
            .ok()
    };
    HANDLE.get_or_init(install).as_ref()
}

/// Time between two foldings of histograms: 12 of them at 30 exposures a second hold 30 kB of samples by then.
const FOLD_EVERY: Duration = Duration::from_secs(10);

/// Folds the samples of histograms into their buckets, without end. A reader of the metrics does so too; in a process
/// that has none, samples pile up otherwise.
pub(crate) async fn fold_samples() {
    let mut tick = tokio::time::interval(FOLD_EVERY);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tick.tick().await;
        if let Some(handle) = metrics() {
            handle.run_upkeep();
        }
    }
}

/// Shows the counters of rare faults of `service` as zero from its start: a counter that first appears as one has not
/// increased for Prometheus, and its alert would miss the first fault.
pub fn show_zeros(service: &'static str) {
    let _ = metrics();
    metrics::counter!("tryon_session_panics", "service" => service).increment(0);
    metrics::counter!("tryon_frames_broken").increment(0);
    metrics::gauge!("tryon_stalled", "service" => service).set(0.0);
    if service == "capture" {
        metrics::counter!("tryon_capture_faults").increment(0);
        metrics::counter!("tryon_recordings_failed").increment(0);
    }
}

/// Counts skipped work as `tryon_skipped{service="…", what="…"}`.
pub fn record_skipped<const N: usize>(service: &'static str, skipped: [(&'static str, usize); N]) {
    for (what, n) in skipped {
        metrics::counter!("tryon_skipped", "service" => service, "what" => what)
            .increment(n as u64);
    }
}

/// Records stage times of an exposure as `tryon_stage_ms{stage="…"}`, those whose name starts with `service.`, and as
/// spans if it is traced.
pub fn record_stages(service: &'static str, frame: Option<&FrameId>, stages: &[StageTime]) {
    if let Some(id) = frame {
        frame_trace::record(service, id, stages);
    }
    for s in stages
        .iter()
        .filter(|s| s.stage.split('.').next() == Some(service))
    {
        metrics::histogram!("tryon_stage_ms", "stage" => s.stage.clone()).record(f64::from(s.ms));
    }
}
