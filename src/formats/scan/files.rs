//! Scan files by extension, and folders of scans as sequences.

use super::gltf::read_scene;
use super::mesh::ScanMesh;
use super::obj::read_obj_scan;
use super::ply::read_ply;
use crate::FormatError;
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// Format of a scan file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ScanFormat {
    Ply,
    Obj,
    Gltf,
}

/// Extensions of [`ScanFormat`], as errors name them.
const EXTENSIONS: &str = ".ply, .obj, .gltf or .glb";

/// Format of a path's extension, in any case.
fn format_of(path: &Path) -> Option<ScanFormat> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "ply" => Some(ScanFormat::Ply),
        "obj" => Some(ScanFormat::Obj),
        "gltf" | "glb" => Some(ScanFormat::Gltf),
        _ => None,
    }
}

fn unknown_extension(path: &Path) -> FormatError {
    FormatError::field(path, "extension", format!("expected {EXTENSIONS}"))
}

/// Reads a scan; the extension names its format.
///
/// # Errors
/// Names the extension that is unknown, or the part of the file at fault; a scan without points is an error.
pub fn read_scan(path: &Path) -> Result<ScanMesh, FormatError> {
    let format = format_of(path).ok_or_else(|| unknown_extension(path))?;
    let size = std::fs::metadata(path).map_err(|e| FormatError::io(path, e))?;
    if size.len() == 0 {
        return Err(FormatError::field(path, "size", "the file is empty"));
    }
    let scan = match format {
        ScanFormat::Ply => read_ply(path)?,
        ScanFormat::Obj => read_obj_scan(path)?,
        ScanFormat::Gltf => read_scene(path)?,
    };
    if scan.points.is_empty() {
        return Err(FormatError::field(path, "points", "the scan is empty"));
    }
    Ok(scan)
}

/// Scan files of a sequence: those of a folder in natural order (2 before 10), or one file.
///
/// Hidden files, other extensions and subfolders are left out.
///
/// # Errors
/// Names a folder without scans, a file of another format, or a path that does not exist.
pub fn scan_files(path: &Path) -> Result<Vec<PathBuf>, FormatError> {
    let io = |e| FormatError::io(path, e);
    if !std::fs::metadata(path).map_err(io)?.is_dir() {
        format_of(path).ok_or_else(|| unknown_extension(path))?;
        return Ok(vec![path.to_owned()]);
    }
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(io)? {
        let entry = entry.map_err(io)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let file = entry.path();
        if !name.starts_with('.') && format_of(&file).is_some() && file.is_file() {
            files.push((name, file));
        }
    }
    if files.is_empty() {
        let why = format!("no scan in this folder; expected {EXTENSIONS}");
        return Err(FormatError::field(path, "files", why));
    }
    files.sort_by(|a, b| natural_order(&a.0, &b.0));
    Ok(files.into_iter().map(|f| f.1).collect())
}

/// Order of names in which runs of digits compare as numbers.
pub(super) fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut rest_a, mut rest_b) = (a, b);
    while !rest_a.is_empty() && !rest_b.is_empty() {
        let (run_a, after_a) = split_run(rest_a);
        let (run_b, after_b) = split_run(rest_b);
        (rest_a, rest_b) = (after_a, after_b);
        let order = if is_number(run_a) && is_number(run_b) {
            let [x, y] = [run_a, run_b].map(|r| r.trim_start_matches('0'));
            x.len().cmp(&y.len()).then_with(|| x.cmp(y))
        } else {
            run_a.cmp(run_b)
        };
        if order.is_ne() {
            return order;
        }
    }
    let lengths = rest_a.len().cmp(&rest_b.len());
    lengths.then_with(|| a.cmp(b))
}

fn is_number(run: &str) -> bool {
    run.starts_with(|c: char| c.is_ascii_digit())
}

/// Leading run of digits or of other characters, and the rest.
fn split_run(text: &str) -> (&str, &str) {
    let digits = is_number(text);
    let end = text.find(|c: char| c.is_ascii_digit() != digits);
    text.split_at(end.unwrap_or(text.len()))
}
