//! The converted file: read whole and compared with the checksum of the one valid content.

use crate::LandmarkError;
use sha2::{Digest, Sha256};
use std::io::Read;
use std::path::{Path, PathBuf};

/// SHA-256 of the file, hexadecimal; `tools/landmarks/convert` refuses to write another.
const CHECKSUM: &str = include_str!("model.sha256");
/// Longest file that is read, bytes: the model has 17 MB, and a longer file is something else.
const MOST_BYTES: u64 = 32 << 20;

/// Reads the model.
///
/// # Errors
/// [`LandmarkError::Missing`], [`LandmarkError::Io`], [`LandmarkError::Foreign`].
pub(crate) fn read(file: &Path) -> Result<Vec<u8>, LandmarkError> {
    let opened = std::fs::File::open(file).map_err(|e| LandmarkError::io(file, e))?;
    let mut bytes = Vec::new();
    (opened.take(MOST_BYTES).read_to_end(&mut bytes)).map_err(|e| LandmarkError::io(file, e))?;

    let digest = Sha256::digest(&bytes);
    let found: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    let expected = CHECKSUM.trim_ascii();
    if found == expected {
        return Ok(bytes);
    }
    Err(LandmarkError::Foreign {
        file: file.to_owned(),
        bytes: bytes.len() as u64,
        found,
        expected,
    })
}

/// The model's file for tests: `$TRYON_LANDMARKS`, or `target/landmarks.onnx`; `None` where it is missing, said loudly.
///
/// # Panics
/// With `TRYON_LANDMARKS` or `TRYON_REQUIRE_ALL` set, where it is missing.
pub fn shared_model() -> Option<PathBuf> {
    let asked = std::env::var_os("TRYON_LANDMARKS").map(PathBuf::from);
    let is_required = asked.is_some() || std::env::var_os("TRYON_REQUIRE_ALL").is_some();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2)?;
    let file = asked.unwrap_or_else(|| root.join("target/landmarks.onnx"));
    if file.exists() {
        return Some(file);
    }
    let error = LandmarkError::Missing { file };
    assert!(!is_required, "{error}");
    eprintln!("SKIPPED: {error}");
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_not_the_model_are_refused_by_name() {
        let folder = std::env::temp_dir().join(format!("tryon_model_{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a temporary folder");
        let file = folder.join("landmarks.onnx");
        let missing = read(&file).expect_err("no file").to_string();
        assert!(
            missing.contains("landmarks.onnx") && missing.contains("npm ci"),
            "{missing}"
        );
        assert!(matches!(read(&folder), Err(LandmarkError::Io { .. })));

        for content in [&b""[..], b"\x08\x07 another model"] {
            std::fs::write(&file, content).expect("written");
            let Err(LandmarkError::Foreign { bytes, .. }) = read(&file) else {
                panic!("{} bytes were taken", content.len());
            };
            assert_eq!(bytes, content.len() as u64);
        }
        if let Some(model) = shared_model() {
            let whole = std::fs::read(model).expect("readable");
            std::fs::write(&file, &whole[..whole.len() - 1]).expect("written");
            assert!(matches!(read(&file), Err(LandmarkError::Foreign { .. })));
        }
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
