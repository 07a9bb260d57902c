//! A camera that may vanish: how long its silence is waited for, and how it is opened again.

use crate::source::{OpenSource, SourceError};
use std::future::pending;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::{Instant, sleep, timeout, timeout_at};
use tryon_kit::compute::Pool;
use tryon_kit::config::{CameraConfig, Ros2Config};
use tryon_proto::v1::{self, CameraState};

/// Shortest silence of a camera that is said.
const LEAST_SILENCE: Duration = Duration::from_millis(250);
/// Periods of a camera that its silence is waited for before it is said.
const PERIODS: u32 = 4;
/// Longest wait for a device's first frame.
const FIRST_FRAME: Duration = Duration::from_secs(5);
/// Silence after which a device is opened anew.
const GIVEN_UP: Duration = Duration::from_millis(1000);
/// Time between two tries to open a device.
const BETWEEN_TRIES: Duration = Duration::from_millis(300);
/// Longest wait for a driver to open its device.
const LONGEST_OPENING: Duration = Duration::from_secs(10);
/// Most calls of a driver that hang before it isn't called any more.
const MAX_HUNG: usize = 3;

/// Way to open the source of a camera.
#[derive(Clone)]
pub(crate) struct Opening {
    pub(crate) open: fn(&CameraConfig, &Ros2Config) -> Result<OpenSource, SourceError>,
    pub(crate) camera: CameraConfig,
    pub(crate) ros2: Ros2Config,
}

impl Opening {
    /// Opens the source; waits as long as its driver.
    pub(crate) fn open(&self) -> Result<OpenSource, SourceError> {
        (self.open)(&self.camera, &self.ros2)
    }
}

/// Expectation of a source's next frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Liveness {
    /// A recording or a made scene: it takes the time that it takes.
    Patient,
    /// A program that feeds a camera: its silence is said.
    Said,
    /// A device: its silence is said, and then it is opened anew.
    Reopened,
}

/// Wait for a source's next frame.
pub(crate) struct Silence {
    liveness: Liveness,
    since: Instant,
    last_frame: Option<Instant>,
    /// Between the last two frames.
    period: Option<Duration>,
}

impl Silence {
    /// Waits for the first frame from now on.
    pub(crate) fn new(liveness: Liveness) -> Self {
        Self {
            liveness,
            since: Instant::now(),
            last_frame: None,
            period: None,
        }
    }

    /// Waits for the next frame from now on.
    pub(crate) fn restart(&mut self) {
        self.since = Instant::now();
    }

    /// A frame has come.
    pub(crate) fn frame(&mut self) {
        let now = Instant::now();
        self.period = self.last_frame.map(|last| now - last);
        self.last_frame = Some(now);
    }

    fn limit(&self) -> Duration {
        self.period
            .map_or(FIRST_FRAME, |p| LEAST_SILENCE.max(p * PERIODS))
    }

    /// Moment at which the source counts as lost.
    fn said_at(&self) -> Option<Instant> {
        (self.liveness != Liveness::Patient).then(|| self.since + self.limit())
    }

    /// Moment at which a device is given up.
    fn given_up_at(&self) -> Option<Instant> {
        (self.liveness == Liveness::Reopened).then(|| self.since + GIVEN_UP.max(self.limit()))
    }

    /// Waits for what the thread of a source does. `None` for a device that is given up.
    pub(crate) async fn within<T>(
        &self,
        info: &watch::Sender<v1::CameraInfo>,
        reading: impl Future<Output = T>,
    ) -> Option<T> {
        let mut reading = pin!(reading);
        let Some(said_at) = self.said_at() else {
            return Some(reading.await);
        };
        if let Ok(read) = timeout_at(said_at, &mut reading).await {
            return Some(read);
        }
        say_lost(
            info,
            &format!("no frame for {} ms", self.limit().as_millis()),
        );
        match self.given_up_at() {
            Some(at) => timeout_at(at, reading).await.ok(),
            None => Some(reading.await),
        }
    }
}

/// Calls of one camera's driver that have not returned. Clones share them.
#[derive(Clone, Debug, Default)]
pub(crate) struct DriverCalls(Arc<AtomicUsize>);

/// A call under way; dropped when it returns.
pub(crate) struct DriverCall(Arc<AtomicUsize>);

impl DriverCalls {
    /// Counts a call.
    pub(crate) fn begin(&self) -> DriverCall {
        self.0.fetch_add(1, Ordering::Relaxed);
        DriverCall(self.0.clone())
    }

    fn count(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }
}

impl Drop for DriverCall {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Opens a device on a thread of its own; one that hangs is left to its driver.
async fn try_open(opening: &Opening, calls: &DriverCalls) -> Result<OpenSource, String> {
    // Nobody reads a device that is being opened.
    let hung = calls.count();
    if hung >= MAX_HUNG {
        return Err(format!(
            "{hung} calls of its driver hang: unplug the camera, then restart this process"
        ));
    }
    let thread = Pool::background("opening").map_err(|e| e.to_string())?;
    let (opening, call) = (opening.clone(), calls.begin());
    let opening = thread.run(move || {
        let opened = opening.open();
        drop(call);
        opened.map_err(|e| e.to_string())
    });
    match timeout(LONGEST_OPENING, opening).await {
        Ok(opened) => opened.map_err(|e| e.to_string())?,
        Err(_) => Err(format!("its driver hangs for {LONGEST_OPENING:?}")),
    }
}

/// A device that is away, while it is tried again.
#[derive(Default)]
pub(crate) struct Awaited(Option<JoinHandle<OpenSource>>);

impl Awaited {
    /// Tries from now on, in place of what was tried before.
    pub(crate) fn begin(&mut self, device: impl Future<Output = OpenSource> + Send + 'static) {
        self.end();
        self.0 = Some(tokio::spawn(device));
    }

    pub(crate) fn is_running(&self) -> bool {
        self.0.is_some()
    }

    /// Tries no more.
    pub(crate) fn end(&mut self) {
        if let Some(task) = self.0.take() {
            task.abort();
        }
    }

    /// Waits for the device; without end while none is away. Cancel safe.
    pub(crate) async fn back(&mut self) -> OpenSource {
        let opened = match &mut self.0 {
            Some(task) => task.await,
            None => pending().await,
        };
        self.0 = None;
        match opened {
            Ok(source) => source,
            Err(_) => pending().await,
        }
    }
}

/// Tries to open a device until it is back. The last failure is the camera's detail.
pub(crate) async fn until_back(
    opening: Opening,
    calls: DriverCalls,
    info: Arc<watch::Sender<v1::CameraInfo>>,
) -> OpenSource {
    loop {
        match try_open(&opening, &calls).await {
            Ok(source) => return source,
            Err(why) => say_lost(&info, &why),
        }
        sleep(BETWEEN_TRIES).await;
    }
}

/// Shows that a camera gives no frames.
pub(crate) fn say_lost(info: &watch::Sender<v1::CameraInfo>, why: &str) {
    info.send_if_modified(|i| {
        let is_new = i.state() != CameraState::Lost;
        if is_new {
            tracing::warn!(camera = i.camera, why, "gives no frames");
            metrics::counter!("tryon_cameras_lost", "camera" => i.camera.clone()).increment(1);
            i.set_state(CameraState::Lost);
        }
        let changed = i.detail != why;
        i.detail = why.into();
        is_new || changed
    });
}

/// Shows that a camera gives frames again.
pub(crate) fn say_back(info: &watch::Sender<v1::CameraInfo>) {
    info.send_if_modified(|i| {
        let was_lost = i.state() == CameraState::Lost;
        if was_lost {
            tracing::info!(camera = i.camera, "gives frames again");
            i.set_state(CameraState::Running);
            i.detail.clear();
        }
        was_lost
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_follows_the_period_of_a_camera() {
        for (period_ms, silence_ms) in [(33, 250), (200, 800)] {
            let mut silence = Silence::new(Liveness::Reopened);
            assert_eq!(silence.limit(), FIRST_FRAME);
            silence.period = Some(Duration::from_millis(period_ms));
            let after = |at: Option<Instant>| at.map(|at| (at - silence.since).as_millis());
            assert_eq!(after(silence.said_at()), Some(silence_ms));
            assert_eq!(after(silence.given_up_at()), Some(1000));
        }
        let said = Silence::new(Liveness::Said);
        assert!(said.said_at().is_some() && said.given_up_at().is_none());
        assert!(Silence::new(Liveness::Patient).said_at().is_none());
    }

    #[tokio::test]
    async fn a_silent_device_is_said_and_then_given_up() {
        let (info, _) = watch::channel(v1::CameraInfo::default());
        let mut silence = Silence::new(Liveness::Reopened);
        silence.frame();
        silence.frame();
        assert_eq!(silence.within(&info, async { 7 }).await, Some(7));
        assert_eq!(info.borrow().state(), CameraState::Unspecified);
        assert_eq!(silence.within(&info, pending::<()>()).await, None);
        assert_eq!(info.borrow().state(), CameraState::Lost);
        assert_eq!(info.borrow().detail, "no frame for 250 ms");
        say_back(&info);
        assert_eq!(info.borrow().state(), CameraState::Running);
        assert_eq!(info.borrow().detail, "");
    }
}
