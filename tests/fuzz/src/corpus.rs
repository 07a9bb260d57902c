//! Kept inputs: `corpus/TARGET/NAME@member.ext` for one member, `corpus/TARGET/NAME/…` for several.

use crate::bundle::Bundle;
use prost::Message;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};

/// Folder of the inputs of a target.
pub fn folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("corpus")
        .join(target)
}

/// Kept inputs of a target with their names, sorted.
///
/// # Errors
/// A file that cannot be read; a target without a folder has no inputs.
pub fn load(target: &str) -> io::Result<Vec<(String, Bundle)>> {
    let folder = folder(target);
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let mut entries = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        entries.push((name.into_owned(), Bundle::read(&path)?));
    }
    entries.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(entries)
}

/// Saves a failing input and returns its path; the same input has the same name.
///
/// # Errors
/// An error of the system.
pub fn save(target: &str, kind: &str, bundle: &Bundle) -> io::Result<PathBuf> {
    let mut hasher = DefaultHasher::new();
    bundle.encode_to_vec().hash(&mut hasher);
    let name = format!("{kind}-{:08x}", hasher.finish() as u32);
    let folder = folder(target);
    fs::create_dir_all(&folder)?;
    if let [only] = &bundle.0[..]
        && !only.name.contains('/')
    {
        let path = folder.join(format!("{name}@{}", only.name));
        fs::write(&path, &only.bytes)?;
        return Ok(path);
    }
    let path = folder.join(name);
    bundle.write_into(&path)?;
    Ok(path)
}
