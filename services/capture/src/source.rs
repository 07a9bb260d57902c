//! What feeds a camera: `synth`, `pattern`, or a recording.

use crate::pattern::Pattern;
use std::path::Path;
use tryon::formats::{RgbdSource, open_recording};

/// A source ready to be read.
pub type OpenSource = Box<dyn RgbdSource>;

/// A source that cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("{source_name}: {why}")]
pub struct SourceError {
    /// As configured.
    pub source_name: String,
    /// What is wrong.
    pub why: String,
}

/// Opens a source by its configured name. Reads files: call it on the compute pool.
///
/// # Errors
/// Names the source, and the file and field at fault.
pub fn open(name: &str) -> Result<OpenSource, SourceError> {
    let fault = |why: String| SourceError { source_name: name.into(), why };
    match name.split_once(':').unwrap_or((name, "")) {
        ("pattern", _) => Ok(Box::new(Pattern::new())),
        ("synth", clip) => synth(clip).map_err(fault),
        _ => open_recording(Path::new(name)).map_err(|e| fault(e.to_string())),
    }
}

fn synth(_clip: &str) -> Result<OpenSource, String> {
    Err("not built yet".into())
}
