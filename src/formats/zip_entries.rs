//! Entries of a zip archive, read within a limit.

use super::FormatError;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Zip archive in a file.
pub(crate) type ZipFileArchive = zip::ZipArchive<BufReader<File>>;

/// Opens an archive and reads its directory.
///
/// # Errors
/// When the file cannot be read or is no zip archive.
pub(crate) fn open_zip(path: &Path) -> Result<ZipFileArchive, FormatError> {
    let file = File::open(path).map_err(|e| FormatError::io(path, e))?;
    zip::ZipArchive::new(BufReader::new(file))
        .map_err(|e| FormatError::field(path, "zip", format!("not a readable archive ({e})")))
}

/// Bytes of the entry `name`, at most `limit`.
///
/// # Errors
/// No such entry, damage, or more bytes.
pub(crate) fn read_entry(
    path: &Path,
    zip: &mut ZipFileArchive,
    name: &str,
    limit: u64,
) -> Result<Vec<u8>, FormatError> {
    let fault = |why: String| FormatError::field(path, name, why);
    let entry = zip.by_name(name).map_err(|e| fault(e.to_string()))?;
    // The buffer grows as bytes arrive: the stated size alone allocates nothing.
    let mut bytes = Vec::new();
    let read = entry.take(limit.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(|e| fault(format!("cannot be read ({e})")))?;
    if bytes.len() as u64 > limit {
        return Err(fault(format!("more than {limit} bytes")));
    }
    Ok(bytes)
}
