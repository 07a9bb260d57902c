//! Sources of a camera: `synth`, `pattern`, `push`, `ros2:…`, or a recording.

use crate::pattern::Pattern;
use crate::push::is_push;
use crate::ros2;
use std::path::Path;
use tryon_formats::{RgbdSource, open_recording};
use tryon_kit::config::{ROS2, Ros2Config};
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
    open_with(name, &Ros2Config::default())
}

/// As [`open`], with the network of ROS 2 cameras. A live source waits for its device: open it on a thread of its own.
///
/// # Errors
/// As [`open`].
pub fn open_with(name: &str, ros2: &Ros2Config) -> Result<OpenSource, SourceError> {
    match kind(name)? {
        SourceKind::Pattern => Ok(Box::new(Pattern::new())),
        SourceKind::Synth(routine) => Ok(synth(routine)),
        SourceKind::Push => Err(fault(
            name,
            "runs while a program feeds it (PublishFrames)".into(),
        )),
        SourceKind::Ros2(topics) => ros2::open(name, &topics, ros2).map_err(|why| fault(name, why)),
        SourceKind::Recording(path) => recording(name, path),
    }
}

/// True for a device, whose frames come once, at their own pace, and which may keep its reader waiting.
pub(crate) fn is_live(name: &str) -> bool {
    matches!(kind(name), Ok(SourceKind::Push | SourceKind::Ros2(_)))
}

/// Checks a source by its configured name. Of a recording it reads as much as [`open`].
///
/// # Errors
/// As [`open`].
pub(crate) fn check(name: &str) -> Result<(), SourceError> {
    match kind(name)? {
        SourceKind::Recording(path) => recording(name, path).map(drop),
        SourceKind::Pattern | SourceKind::Push | SourceKind::Ros2(_) | SourceKind::Synth(_) => {
            Ok(())
        }
    }
}

/// Kind of a source.
enum SourceKind<'a> {
    Pattern,
    Push,
    Synth(Routine),
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
        ("synth", clip) => {
            let routine = routine(clip).map_err(|why| fault(name, why))?;
            Ok(SourceKind::Synth(routine))
        }
        _ => Ok(SourceKind::Recording(Path::new(name))),
    }
}

fn recording(name: &str, path: &Path) -> Result<OpenSource, SourceError> {
    open_recording(path).map_err(|e| fault(name, e.to_string()))
}

/// `try-on` (the default), `leave`, `still`, `seated` or `empty`.
fn routine(clip: &str) -> Result<Routine, String> {
    Ok(match clip {
        "" | "try-on" => Routine::TryOn,
        "leave" => Routine::LeaveAndReturn,
        "still" => Routine::Still,
        "seated" => Routine::Hold(Posture::Sitting),
        "empty" => Routine::Empty,
        other => {
            return Err(format!(
                "`{other}` is no routine; there are try-on, leave, still, seated and empty"
            ));
        }
    })
}

/// The synthetic person, without end.
fn synth(routine: Routine) -> OpenSource {
    let sequence = Sequence::new(
        Actor::default(),
        Setting {
            routine,
            ..Setting::default()
        },
    );
    Box::new(SynthSource::new(sequence, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_open_by_name_and_faults_are_named() {
        let mut s = open("pattern").expect("always there");
        let f = s.next_frame().expect("fine").expect("never ends");
        assert_eq!(f.depth.width(), s.calibration().depth.width);
        assert!(
            ["pattern", "push", "synth", "synth:still", "ros2:/d,/c"]
                .iter()
                .all(|s| check(s).is_ok())
        );
        assert!(is_live("ros2:/d") && is_live("push") && !is_live("pattern"));
        for bad in ["synth:handstand", "ros2:/d,", "/nowhere/at/all"] {
            let e = open(bad).err().expect("refused").to_string();
            assert!(e.starts_with(bad), "{e}");
            assert_eq!(check(bad).expect_err("refused").to_string(), e);
        }
    }
}
