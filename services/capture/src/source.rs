//! Sources of a camera: `studio`, `synth`, `pattern`, `push`, `ros2:…`, a device as `freenect:SERIAL`, or a recording.

use crate::live::Liveness;
use crate::pattern::Pattern;
use crate::push::is_push;
use crate::ros2;
use std::path::Path;
use tryon_devices::{DeviceOptions, is_device};
use tryon_formats::{CameraFile, RecordingOptions, Reoriented, RgbdSource, open_recording_with};
use tryon_kit::config::{CameraConfig, ROS2, Ros2Config};
use tryon_synth::{Actor, Posture, Routine, Sequence, Setting, SynthSource};

/// A source ready to be read.
pub type OpenSource = Box<dyn RgbdSource>;

/// A source that cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("{source_name}: {why}")]
pub struct SourceError {
    /// As configured.
    pub source_name: String,
    /// Fault.
    pub why: String,
}

/// Opens a source by its configured name, with the defaults of the configuration. Reads files: call it on the compute pool.
///
/// # Errors
/// Names the source, and the file and field at fault.
pub fn open(name: &str) -> Result<OpenSource, SourceError> {
    open_with(name, None, &Ros2Config::default())
}

/// Opens the source of a camera, with its pictures set upright. A device may keep its thread waiting for seconds.
///
/// # Errors
/// As [`open`].
pub(crate) fn open_camera(
    config: &CameraConfig,
    ros2: &Ros2Config,
) -> Result<OpenSource, SourceError> {
    let source = open_with(&config.source, config.camera_file(), ros2)?;
    Ok(upright(config, source))
}

/// The source with its pictures set upright as the camera is mounted.
pub(crate) fn upright(config: &CameraConfig, source: OpenSource) -> OpenSource {
    Reoriented::wrap(Path::new(&config.source), source, config.mounting())
}

/// As [`open`]; `camera` is a `camera.json` for devices and recordings without a calibration of their own, `ros2` the network
/// of ROS 2 cameras. A device may keep its thread waiting for seconds.
///
/// # Errors
/// As [`open`].
pub fn open_with(
    name: &str,
    camera: Option<&Path>,
    ros2: &Ros2Config,
) -> Result<OpenSource, SourceError> {
    match kind(name)? {
        SourceKind::Pattern => Ok(Box::new(Pattern::new())),
        SourceKind::Synth(setting) => Ok(synth(Actor::default(), *setting)),
        SourceKind::Studio(setting) => Ok(synth(Actor::figure(), *setting)),
        SourceKind::Push => Err(fault(
            name,
            "runs while a program feeds it (PublishFrames)".into(),
        )),
        SourceKind::Ros2(topics) => ros2::open(name, &topics, ros2).map_err(|why| fault(name, why)),
        SourceKind::Device => device(name, camera),
        SourceKind::Recording(path) => recording(name, path, camera),
    }
}

/// True for the path of a recording, whether it is there or not.
pub fn is_recording(name: &str) -> bool {
    matches!(kind(name), Ok(SourceKind::Recording(_)))
}

/// True for a source whose frames come once, at their own pace.
pub fn is_live(name: &str) -> bool {
    liveness(name) != Liveness::Patient
}

/// Checks the source of a camera. Of a recording it reads as much as [`open`]; a device may be unplugged.
///
/// # Errors
/// As [`open`].
pub(crate) fn check(config: &CameraConfig) -> Result<(), SourceError> {
    let (name, camera) = (config.source.as_str(), config.camera_file());
    match kind(name)? {
        SourceKind::Recording(path) => recording(name, path, camera).map(drop),
        SourceKind::Device => check_device(name, camera),
        SourceKind::Pattern
        | SourceKind::Push
        | SourceKind::Ros2(_)
        | SourceKind::Synth(_)
        | SourceKind::Studio(_) => Ok(()),
    }
}

/// Expectation of a source's next frame.
pub(crate) fn liveness(name: &str) -> Liveness {
    match kind(name) {
        Ok(SourceKind::Push) => Liveness::Said,
        Ok(SourceKind::Device | SourceKind::Ros2(_)) => Liveness::Reopened,
        _ => Liveness::Patient,
    }
}

/// Warns of a missing library: it may be installed while this process runs.
fn check_device(name: &str, camera: Option<&Path>) -> Result<(), SourceError> {
    if let Err(why) = tryon_devices::check(name) {
        tracing::warn!(source = name, %why, "the camera cannot be opened");
    }
    let read = camera.map(CameraFile::read).transpose();
    read.map(drop).map_err(|e| fault(name, e.to_string()))
}

/// Kind of a source.
enum SourceKind<'a> {
    Pattern,
    Push,
    /// Somebody in everyday clothes in a room.
    Synth(Box<Setting>),
    /// The display figure in a studio.
    Studio(Box<Setting>),
    Device,
    Ros2(ros2::Topics),
    Recording(&'a Path),
}

fn fault(name: &str, why: String) -> SourceError {
    SourceError {
        source_name: name.into(),
        why,
    }
}

fn kind(name: &str) -> Result<SourceKind<'_>, SourceError> {
    if let Some(topics) = name.strip_prefix(ROS2) {
        let topics = ros2::Topics::parse(topics).map_err(|why| fault(name, why))?;
        return Ok(SourceKind::Ros2(topics));
    }
    match name.split_once(':').unwrap_or((name, "")) {
        ("pattern", _) => Ok(SourceKind::Pattern),
        _ if is_push(name) => Ok(SourceKind::Push),
        ("synth", clip) => performing(name, clip, Setting::default()).map(SourceKind::Synth),
        ("studio", clip) => performing(name, clip, Setting::studio()).map(SourceKind::Studio),
        ("studio-720", clip) => wide_studio(name, clip, 720),
        ("studio-1080", clip) => wide_studio(name, clip, 1080),
        _ if is_device(name) => Ok(SourceKind::Device),
        _ => Ok(SourceKind::Recording(Path::new(name))),
    }
}

fn recording(name: &str, path: &Path, camera: Option<&Path>) -> Result<OpenSource, SourceError> {
    let options = RecordingOptions {
        camera: camera.map(Path::to_owned),
        ..RecordingOptions::default()
    };
    open_recording_with(path, &options).map_err(|e| fault(name, e.to_string()))
}

fn device(name: &str, camera: Option<&Path>) -> Result<OpenSource, SourceError> {
    let options = DeviceOptions {
        camera: camera.map(Path::to_owned),
    };
    tryon_devices::open_with(name, &options).map_err(|e| {
        // Most of a device's errors begin with its name.
        let why = e.to_string();
        let rest = why
            .strip_prefix(name)
            .and_then(|rest| rest.strip_prefix(": "));
        fault(name, rest.map_or(why.clone(), str::to_owned))
    })
}

/// `try-on` (the default), `leave`, `walk`, `still`, `seated` or `empty`.
fn routine(clip: &str) -> Result<Routine, String> {
    Ok(match clip {
        "" | "try-on" => Routine::TryOn,
        "leave" => Routine::LeaveAndReturn,
        "walk" => Routine::Walk,
        "still" => Routine::Still,
        "seated" => Routine::Hold(Posture::Sitting),
        "empty" => Routine::Empty,
        other => {
            return Err(format!(
                "`{other}` is no routine; there are try-on, leave, walk, still, seated and empty"
            ));
        }
    })
}

/// A setting with the routine of a source's name.
fn performing(name: &str, clip: &str, setting: Setting) -> Result<Box<Setting>, SourceError> {
    let routine = routine(clip).map_err(|why| fault(name, why))?;
    Ok(Box::new(Setting { routine, ..setting }))
}

/// The display figure before a colour camera of 16:9.
fn wide_studio<'a>(name: &'a str, clip: &str, rows: u32) -> Result<SourceKind<'a>, SourceError> {
    let setting = Setting::studio().with_wide_color(rows);
    performing(name, clip, setting).map(SourceKind::Studio)
}

/// A synthetic person, without end.
fn synth(actor: Actor, setting: Setting) -> OpenSource {
    Box::new(SynthSource::new(Sequence::new(actor, setting), None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_open_by_name_and_faults_are_named() {
        let mut s = open("pattern").expect("always there");
        let f = s.next_frame().expect("fine").expect("never ends");
        assert_eq!(f.depth.width(), s.calibration().depth.width);
        for (source, size) in [
            ("studio", (640, 480)),
            ("studio-720:still", (1280, 720)),
            ("studio-1080", (1920, 1080)),
        ] {
            let mut studio = open(source).expect("always there");
            let frame = studio.next_frame().expect("fine").expect("never ends");
            let color = frame.color.map(|c| (c.width(), c.height()));
            assert_eq!(color, Some(size), "{source}");
        }
        let check = |source: &str, camera: &str| {
            check(&CameraConfig {
                source: source.into(),
                camera: camera.into(),
                ..CameraConfig::default()
            })
        };
        // Devices need not be plugged in.
        let fine = [
            "pattern",
            "push",
            "synth",
            "synth:still",
            "studio",
            "studio:walk",
            "freenect:A1",
            "openni",
            "v4l2:7",
            "ros2:/d,/c",
        ];
        assert!(fine.iter().all(|s| check(s, "").is_ok()));
        let names = ["push", "synth", "/nowhere/at/all", "synth:handstand"];
        assert_eq!(names.map(is_recording), [false, false, true, false]);
        for bad in [
            "synth:handstand",
            "studio:handstand",
            "ros2:/d,",
            "/nowhere/at/all",
            "freenect:",
        ] {
            let e = open(bad).err().expect("refused").to_string();
            assert!(e.starts_with(bad), "{e}");
            assert_eq!(check(bad, "").expect_err("refused").to_string(), e);
        }
        let e = check("v4l2:7", "/nowhere.json")
            .expect_err("no file")
            .to_string();
        assert!(e.starts_with("v4l2:7: /nowhere.json"), "{e}");
        let names = ["push", "v4l2", "ros2:/d", "synth", "v4l2.mcap"];
        use Liveness::{Patient, Reopened, Said};
        assert_eq!(
            names.map(liveness),
            [Said, Reopened, Reopened, Patient, Patient]
        );
    }
}
