//! A device that vanishes, hangs and returns, under the task of its camera.
#![allow(clippy::disallowed_methods)] // its driver waits on a thread of its own

use crate::camera::{self, Command, Handle};
use crate::live::Opening;
use crate::pattern::Pattern;
use crate::source::{OpenSource, SourceError};
use std::path::Path;
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;
use tokio_util::sync::CancellationToken;
use tryon_formats::{FormatError, RgbdSource};
use tryon_geometry::camera::{Calibration, RgbdFrame};
use tryon_kit::auth::Auth;
use tryon_kit::compute::Pool;
use tryon_kit::config::{CameraConfig, Config, Ros2Config};
use tryon_kit::flow::Stalls;
use tryon_kit::frames::{CameraKey, LocalBus};
use tryon_kit::server::Context;
use tryon_kit::tls::Tls;
use tryon_proto::v1::CameraState;

const PRESENT: u8 = 0;
const GONE: u8 = 1;
const HANGS: u8 = 2;

static DEVICE: AtomicU8 = AtomicU8::new(PRESENT);
static OPENED: AtomicUsize = AtomicUsize::new(0);
const PERIOD: Duration = Duration::from_millis(33);

/// Stand-in of a driver: frames at their pace while the device is present.
struct Device(Pattern);

fn open(config: &CameraConfig, _: &Ros2Config) -> Result<OpenSource, SourceError> {
    if DEVICE.load(Ordering::SeqCst) != PRESENT {
        return Err(SourceError {
            source_name: config.source.clone(),
            why: "no such device".into(),
        });
    }
    OPENED.fetch_add(1, Ordering::SeqCst);
    Ok(Box::new(Device(Pattern::new())))
}

impl RgbdSource for Device {
    fn calibration(&self) -> &Calibration {
        self.0.calibration()
    }
    fn len(&self) -> Option<usize> {
        None
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        std::thread::sleep(PERIOD);
        while DEVICE.load(Ordering::SeqCst) == HANGS {
            std::thread::sleep(PERIOD);
        }
        match DEVICE.load(Ordering::SeqCst) {
            PRESENT => self.0.next_frame(),
            _ => Err(FormatError::field(Path::new("device"), "usb", "is gone")),
        }
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        Ok(())
    }
}

fn context() -> Context {
    let (config, pool) = (Config::default(), Pool::new(1).expect("a thread"));
    Context {
        stalls: Stalls::default(),
        bus: LocalBus::new(pool.clone()),
        pool,
        shutdown: CancellationToken::new(),
        grace: Duration::ZERO,
        auth: Auth::open(&config, None).expect("open to all"),
        tls: Tls::open(&config.tls).expect("none"),
        inside: Tls::inside(&config, None).expect("none"),
    }
}

/// Waits for a state, watched by somebody who consents; the time until then.
async fn until(handle: &Handle, state: CameraState) -> Duration {
    let begun = Instant::now();
    while handle.info.borrow().state() != state {
        let lease = Duration::from_secs(60);
        handle.leases.hold("somebody", lease).expect("held");
        assert!(begun.elapsed() < Duration::from_secs(60), "never {state:?}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    begun.elapsed()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_device_that_vanishes_or_hangs_is_said_and_comes_back() {
    let config = CameraConfig {
        source: "freenect:A1".into(),
        ..CameraConfig::default()
    };
    let key = CameraKey::new("store", "front").expect("a key");
    let ctx = context();
    let shutdown = ctx.shutdown.clone();
    let opening = Opening {
        open,
        camera: config,
        ros2: Ros2Config::default(),
    };
    let handle = camera::spawn(opening, key, ctx);
    let (answer, started) = oneshot::channel();
    (handle.commands.send(Command::Start(answer)).await).expect("sent");
    started.await.expect("an answer").expect("started");
    until(&handle, CameraState::Running).await;
    let mut epoch = handle.info.borrow().epoch;
    for fault in [GONE, HANGS] {
        tokio::time::sleep(20 * PERIOD).await;
        DEVICE.store(fault, Ordering::SeqCst);
        let said = until(&handle, CameraState::Lost).await;
        let opened = OPENED.load(Ordering::SeqCst);
        // Longer than a device is waited for before it is opened anew.
        tokio::time::sleep(Duration::from_secs(2)).await;
        assert_eq!(OPENED.load(Ordering::SeqCst), opened);
        assert!(handle.info.borrow().detail.contains("no such device"));
        DEVICE.store(PRESENT, Ordering::SeqCst);
        let back = until(&handle, CameraState::Running).await;
        eprintln!("fault {fault}: said after {said:?}, back after {back:?}");
        let now = handle.info.borrow().epoch;
        assert_ne!(now, epoch, "a device that is back has another epoch");
        epoch = now;
    }
    // A stopped camera is not opened again.
    DEVICE.store(GONE, Ordering::SeqCst);
    until(&handle, CameraState::Lost).await;
    let (answer, stopped) = oneshot::channel();
    (handle.commands.send(Command::Stop(answer)).await).expect("sent");
    let info = stopped.await.expect("an answer").expect("stopped");
    assert_eq!(info.state(), CameraState::Stopped);
    let opened = OPENED.load(Ordering::SeqCst);
    DEVICE.store(PRESENT, Ordering::SeqCst);
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert_eq!(OPENED.load(Ordering::SeqCst), opened);
    assert_eq!(handle.info.borrow().state(), CameraState::Stopped);
    shutdown.cancel();
}
