//! Tests of the scan readers: PLY, materials, sequences.

mod materials;
mod ply;
mod sequence;

use super::{ScanMesh, read_scan};
use std::path::Path;

/// Writes `bytes` as `name` in `folder` and reads the scan.
fn read_bytes(folder: &Path, name: &str, bytes: &[u8]) -> Result<ScanMesh, String> {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("written");
    read_scan(&path).map_err(|e| e.to_string())
}

/// Reads the only fault of a file.
fn refusal(folder: &Path, name: &str, bytes: &[u8]) -> String {
    read_bytes(folder, name, bytes).expect_err("a fault")
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("temporary folder")
}
