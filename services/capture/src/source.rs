//! Sources of a camera: `synth`, `pattern`, or a recording.

use crate::pattern::Pattern;
use std::path::Path;
use tryon::formats::{RgbdSource, open_recording};
use tryon::synth::{Actor, Posture, Routine, Sequence, Setting, SynthSource};

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
    let fault = |why: String| SourceError {
        source_name: name.into(),
        why,
    };
    match name.split_once(':').unwrap_or((name, "")) {
        ("pattern", _) => Ok(Box::new(Pattern::new())),
        ("synth", clip) => synth(clip).map_err(fault),
        _ => open_recording(Path::new(name)).map_err(|e| fault(e.to_string())),
    }
}

/// `try-on` (the default), `leave`, `still`, `seated` or `empty`, without end.
fn synth(clip: &str) -> Result<OpenSource, String> {
    let routine = match clip {
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
    };
    let sequence = Sequence::new(
        Actor::default(),
        Setting {
            routine,
            ..Setting::default()
        },
    );
    Ok(Box::new(SynthSource::new(sequence, None)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_open_by_name_and_faults_are_named() {
        let mut s = open("pattern").expect("always there");
        let f = s.next_frame().expect("fine").expect("never ends");
        assert_eq!(f.depth.width(), s.calibration().depth.width);
        for bad in ["synth:handstand", "/nowhere/at/all"] {
            let e = open(bad).err().expect("refused").to_string();
            assert!(e.starts_with(bad), "{e}");
        }
    }
}
