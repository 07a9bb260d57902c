//! Paths of the shared data, for tests.

use std::path::{Path, PathBuf};

/// A path below `../shared/data` (or `$TRYON_SHARED/data`); `None` where it is missing, said loudly.
///
/// # Panics
/// With `TRYON_REQUIRE_ALL` set, where it is missing.
pub fn shared_data(path: impl AsRef<Path>) -> Option<PathBuf> {
    let root = std::env::var_os("TRYON_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let full = root.join("data").join(path);
    if full.exists() {
        return Some(full);
    }
    assert!(
        std::env::var_os("TRYON_REQUIRE_ALL").is_none(),
        "{} is missing",
        full.display()
    );
    eprintln!("SKIPPED: {} is missing", full.display());
    None
}
