//! What several tests share: finding the data that lies beside the project.

use std::path::PathBuf;

/// A path below `../shared/data` (or `$TRYON_SHARED/data`). When it is missing the test says so loudly and skips;
/// with `TRYON_REQUIRE_ALL=1` it fails.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let root = std::env::var_os("TRYON_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let full = root.join("data").join(path);
    if full.exists() {
        return Some(full);
    }
    assert!(std::env::var_os("TRYON_REQUIRE_ALL").is_none(), "{} is missing", full.display());
    eprintln!("SKIPPED: {} is missing", full.display());
    None
}
