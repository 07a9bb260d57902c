//! Garments in a folder: mesh files and captures, with one level of folders in it.

use std::path::{Path, PathBuf};
use tryon::mirror::CapturedWardrobe;

/// Endings of mesh garment files.
const MESHES: [&str; 4] = ["mhclo", "obj", "glb", "gltf"];

/// Contents of a folder, each in the order of their paths.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct GarmentFolder {
    /// Mesh garments. The mesh that an `.mhclo` binds is no garment of its own.
    pub(crate) files: Vec<PathBuf>,
    /// Folders with the garments of a capture.
    pub(crate) captures: Vec<PathBuf>,
}

impl GarmentFolder {
    /// Lists a folder, which may be a capture itself.
    ///
    /// # Errors
    /// A folder that cannot be listed.
    pub(crate) fn list(folder: &Path) -> std::io::Result<Self> {
        let entries = |folder: &Path| -> std::io::Result<Vec<PathBuf>> {
            let all = std::fs::read_dir(folder)?;
            all.map(|entry| Ok(entry?.path())).collect()
        };
        let is_capture = |p: &PathBuf| CapturedWardrobe::is_in(p);
        if is_capture(&folder.to_owned()) {
            return Ok(Self {
                captures: vec![folder.to_owned()],
                ..Self::default()
            });
        }
        let mut all = entries(folder)?;
        let inner = all.iter().filter(|p| p.is_dir()).cloned();
        let (mut captures, folders): (Vec<PathBuf>, Vec<PathBuf>) = inner.partition(is_capture);
        for inner in &folders {
            all.extend(entries(inner)?);
        }
        captures.sort();
        Ok(Self {
            files: meshes(all),
            captures,
        })
    }
}

/// Mesh garments among some paths, sorted.
fn meshes(mut all: Vec<PathBuf>) -> Vec<PathBuf> {
    let kind = |p: &Path| {
        p.extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
    };
    all.retain(|p| p.is_file() && kind(p).is_some_and(|k| MESHES.contains(&k.as_str())));
    let bound: Vec<PathBuf> = all
        .iter()
        .filter(|p| kind(p).as_deref() == Some("mhclo"))
        .cloned()
        .collect();
    all.retain(|p| {
        kind(p).as_deref() == Some("mhclo")
            || !bound
                .iter()
                .any(|b| b.with_extension("") == p.with_extension(""))
    });
    all.sort();
    all
}

/// Name of the garment in a file, or of a capture: lower case, with `_` for every other character.
pub(crate) fn name_of(file: &Path) -> String {
    // A folder given as `.` has a name in full only.
    let full = file.canonicalize().unwrap_or_default();
    let stem = file
        .file_stem()
        .or(full.file_stem())
        .map_or_else(String::new, |s| s.to_string_lossy().to_lowercase());
    stem.chars()
        .map(|c| {
            if c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' {
                c
            } else {
                '_'
            }
        })
        .collect()
}
