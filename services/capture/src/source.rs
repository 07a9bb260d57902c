//! Sources of a camera: `synth`, `pattern`, `push`, or a recording.

use crate::pattern::Pattern;
use crate::push::is_push;
use std::path::Path;
use tryon_formats::{RgbdSource, open_recording};
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

/// Opens a source by its configured name. Reads files: call it on the compute pool.
///
/// # Errors
/// Names the source, and the file and field at fault.
pub fn open(name: &str) -> Result<OpenSource, SourceError> {
    match kind(name)? {
        SourceKind::Pattern => Ok(Box::new(Pattern::new())),
        SourceKind::Synth(routine) => Ok(synth(routine)),
        SourceKind::Push => Err(fault(
            name,
            "runs while a program feeds it (PublishFrames)".into(),
        )),
        SourceKind::Recording(path) => recording(name, path),
    }
}

/// Checks a source by its configured name. Of a recording it reads as much as [`open`].
///
/// # Errors
/// As [`open`].
pub(crate) fn check(name: &str) -> Result<(), SourceError> {
    match kind(name)? {
        SourceKind::Recording(path) => recording(name, path).map(drop),
        SourceKind::Pattern | SourceKind::Push | SourceKind::Synth(_) => Ok(()),
    }
}

/// Kind of a source.
enum SourceKind<'a> {
    Pattern,
    Push,
    Synth(Routine),
    Recording(&'a Path),
}

fn fault(name: &str, why: String) -> SourceError {
    SourceError {
        source_name: name.into(),
        why,
    }
}

fn kind(name: &str) -> Result<SourceKind<'_>, SourceError> {
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
            ["pattern", "push", "synth", "synth:still"]
                .iter()
                .all(|s| check(s).is_ok())
        );
        for bad in ["synth:handstand", "/nowhere/at/all"] {
            let e = open(bad).err().expect("refused").to_string();
            assert!(e.starts_with(bad), "{e}");
            assert_eq!(check(bad).expect_err("refused").to_string(), e);
        }
    }
}
