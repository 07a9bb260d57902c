//! Traces of sampled frames over the chain, by OpenTelemetry: one trace an exposure, in it a span of each service with
//! its stages as children.
//!
//! The context travels in `FrameId.trace`, with every message about the exposure: streams carry many exposures on one
//! call, so metadata of the call could not. Trace id: `epoch ‖ trace`; id of capture's span, the root: `trace`.
//! Spans hold ids, names and times, neither pixels nor poses.

use crate::config::TelemetryConfig;
use opentelemetry::trace::{
    SpanContext, SpanId, SpanKind, Status, TraceFlags, TraceId, TraceState,
};
use opentelemetry::{InstrumentationScope, KeyValue};
use opentelemetry_otlp::{SpanExporter, WithExportConfig};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{SpanData, SpanEvents, SpanExporter as _, SpanLinks};
use std::sync::OnceLock;
use std::time::{Duration, SystemTime};
use tokio::sync::mpsc;
use tryon_proto::v1::{FrameId, StageTime};

/// Spans that wait for the collector; further ones are dropped and counted. A frame has about six a service.
const WAITING: usize = 256;
/// Time of one export, and of the last at shutdown.
const PATIENCE: Duration = Duration::from_secs(2);

/// Export of this process; empty while traces are off.
static EXPORT: OnceLock<Export> = OnceLock::new();

#[derive(Debug)]
struct Export {
    spans: mpsc::Sender<Vec<SpanData>>,
    /// Time between two traced exposures of a camera (ns); 0 for none.
    every_ns: u64,
}

/// Chooses the exposures that are traced. Capture has one for each camera.
#[derive(Debug)]
pub struct Sampler {
    every_ns: u64,
    due_ns: u64,
}

impl Default for Sampler {
    /// Sampler at the configured rate; of none while this process exports nothing.
    fn default() -> Self {
        Self::every(EXPORT.get().map_or(0, |e| e.every_ns))
    }
}

impl Sampler {
    fn every(every_ns: u64) -> Self {
        Self {
            every_ns,
            due_ns: 0,
        }
    }

    /// `FrameId.trace` of an exposure received at `unix_ns`: a random number, or 0 for one that is not traced.
    pub fn trace(&mut self, unix_ns: u64) -> u64 {
        // A clock set back must not end the traces: a due time far ahead is forgotten.
        let is_due = unix_ns >= self.due_ns || self.due_ns - unix_ns > self.every_ns;
        if self.every_ns == 0 || !is_due {
            return 0;
        }
        self.due_ns = unix_ns.saturating_add(self.every_ns);
        crate::sessions::random_u64().max(1)
    }
}

/// Exporter of a process. [`Exporter::end`] sends what waits.
#[derive(Debug)]
pub struct Exporter {
    task: tokio::task::JoinHandle<()>,
    end: tokio_util::sync::CancellationToken,
}

/// Starts the export of process `name` to `config.otlp`; `None` without one. Requires a runtime.
///
/// # Errors
/// An endpoint that is no URL.
pub fn start(name: &'static str, config: &TelemetryConfig) -> Result<Option<Exporter>, String> {
    if config.otlp.is_empty() {
        return Ok(None);
    }
    let exporter = SpanExporter::builder()
        .with_tonic()
        .with_endpoint(&config.otlp)
        .with_timeout(PATIENCE)
        .build();
    let mut exporter = exporter.map_err(|e| e.to_string())?;
    let resource = Resource::builder_empty()
        .with_service_name(format!("tryon-{name}"))
        .with_attribute(KeyValue::new("service.version", env!("CARGO_PKG_VERSION")));
    exporter.set_resource(&resource.build());
    let (sender, mut waiting) = mpsc::channel::<Vec<SpanData>>(WAITING);
    let export = Export {
        spans: sender,
        every_ns: match config.traces_per_second {
            0.0 => 0,
            rate => (1e9 / rate) as u64,
        },
    };
    if EXPORT.set(export).is_err() {
        return Ok(None);
    }
    let end = tokio_util::sync::CancellationToken::new();
    let ended = end.clone();
    let task = tokio::spawn(async move {
        loop {
            let mut batch = Vec::new();
            tokio::select! {
                n = waiting.recv_many(&mut batch, WAITING) => if n == 0 { return },
                () = ended.cancelled() => {
                    while let Ok(spans) = waiting.try_recv() {
                        batch.push(spans);
                    }
                }
            }
            let spans: Vec<SpanData> = batch.into_iter().flatten().collect();
            if !spans.is_empty()
                && let Err(e) = exporter.export(spans).await
            {
                metrics::counter!("tryon_spans_lost").increment(1);
                tracing::debug!(error = %e, "spans were not taken");
            }
            if ended.is_cancelled() {
                return;
            }
        }
    });
    Ok(Some(Exporter { task, end }))
}

impl Exporter {
    /// Sends what waits, within two seconds.
    pub async fn end(self) {
        self.end.cancel();
        let _ = tokio::time::timeout(PATIENCE, self.task).await;
    }
}

/// Records the work of `service` on an exposure that ends now: the stages whose names begin with `service.`. Does nothing
/// for one that is not traced.
pub fn record(service: &'static str, id: &FrameId, stages: &[StageTime]) {
    if id.trace == 0 {
        return;
    }
    let Some(export) = EXPORT.get() else { return };
    let spans = spans(service, id, stages, SystemTime::now());
    if export.spans.try_send(spans).is_err() {
        metrics::counter!("tryon_spans_lost").increment(1);
    }
}

/// Span of the service up to `end`, and one of each stage, one after another.
fn spans(
    service: &'static str,
    id: &FrameId,
    stages: &[StageTime],
    end: SystemTime,
) -> Vec<SpanData> {
    let own = |s: &&StageTime| s.stage.split('.').next() == Some(service);
    let is_total = |s: &StageTime| s.stage.ends_with(".total");
    let time =
        |s: &StageTime| Duration::try_from_secs_f32(s.ms.max(0.0) * 1e-3).unwrap_or_default();
    let parts: Vec<&StageTime> = stages.iter().filter(own).filter(|s| !is_total(s)).collect();
    let sum: Duration = parts.iter().map(|s| time(s)).sum();
    let total = stages.iter().filter(own).find(|s| is_total(s)).map(time);
    let length = total.unwrap_or(sum).max(sum);

    let root = SpanId::from_bytes(id.trace.to_be_bytes());
    let (own_id, parent) = match service {
        "capture" => (root, SpanId::INVALID),
        _ => (random_span(), root),
    };
    let start = end.checked_sub(length).unwrap_or(end);
    let mut of_service = span(id, own_id, parent, service.to_owned());
    (of_service.start_time, of_service.end_time) = (start, end);
    of_service.attributes = vec![KeyValue::new("frame.sequence", id.sequence.cast_signed())];
    let mut all = vec![of_service];
    let mut at = start;
    for s in parts {
        let mut part = span(id, random_span(), own_id, s.stage.clone());
        part.start_time = at;
        at += time(s);
        part.end_time = at;
        all.push(part);
    }
    all
}

fn random_span() -> SpanId {
    SpanId::from_bytes(crate::sessions::random_u64().max(1).to_be_bytes())
}

fn span(id: &FrameId, own: SpanId, parent: SpanId, name: String) -> SpanData {
    let trace = u128::from(id.epoch) << 64 | u128::from(id.trace);
    let trace = TraceId::from_bytes(trace.to_be_bytes());
    let (flags, state) = (TraceFlags::SAMPLED, TraceState::NONE);
    SpanData {
        span_context: SpanContext::new(trace, own, flags, false, state),
        parent_span_id: parent,
        parent_span_is_remote: false,
        span_kind: SpanKind::Internal,
        name: name.into(),
        start_time: SystemTime::UNIX_EPOCH,
        end_time: SystemTime::UNIX_EPOCH,
        attributes: Vec::new(),
        dropped_attributes_count: 0,
        events: SpanEvents::default(),
        links: SpanLinks::default(),
        status: Status::Unset,
        instrumentation_scope: InstrumentationScope::builder("tryon").build(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_exposure_a_second_whatever_the_clock_does() {
        let mut sampler = Sampler::every(1_000_000_000);
        let frames = |from_ms: u64| (0..90).map(move |i| (from_ms + 33 * i) * 1_000_000);
        let count = |s: &mut Sampler, from_ms| frames(from_ms).filter(|t| s.trace(*t) != 0).count();
        assert_eq!(count(&mut sampler, 100_000), 3);
        assert_eq!(count(&mut sampler, 98_000), 3, "five seconds back");
        assert_eq!(count(&mut sampler, 106_000), 3, "five seconds ahead");
        assert_eq!(Sampler::every(0).trace(1), 0);
    }

    #[test]
    fn services_meet_in_one_trace_under_the_root_of_capture() {
        let id = FrameId {
            epoch: 7,
            sequence: 42,
            trace: 9,
            ..FrameId::default()
        };
        let stage = |name: &str, ms| StageTime {
            stage: name.into(),
            ms,
        };
        let stages = [
            stage("capture.read", 2.0),
            stage("tracking.pose", 5.0),
            stage("tracking.shape", f32::NAN),
            stage("tracking.total", 8.0),
        ];
        let end = SystemTime::UNIX_EPOCH + Duration::from_secs(1);
        let (root, tracked) = (
            spans("capture", &id, &stages, end),
            spans("tracking", &id, &stages, end),
        );
        assert_eq!((root.len(), tracked.len()), (2, 3));
        assert_eq!(
            root[0].span_context.trace_id(),
            tracked[2].span_context.trace_id()
        );
        assert_eq!(tracked[0].parent_span_id, root[0].span_context.span_id());
        assert_eq!(tracked[1].parent_span_id, tracked[0].span_context.span_id());
        assert_eq!(root[0].parent_span_id, SpanId::INVALID);
        let length = tracked[0].end_time.duration_since(tracked[0].start_time);
        assert!((length.expect("forwards").as_secs_f64() - 0.008).abs() < 1e-6);
        assert!(tracked[2].end_time <= end);
    }
}
