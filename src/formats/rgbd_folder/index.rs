//! Files of each frame, by time lists or by name.

use crate::FormatError;
use crate::image::read_limited;
use std::path::Path;

/// Largest time list, bytes; a day at 30 Hz has 180 MB.
const MAX_LIST_BYTES: u64 = 256 << 20;

/// Frame period of images without a time list, that of most depth cameras.
const DEFAULT_PERIOD_NS: u64 = 1_000_000_000 / 30;

/// Largest time between colour and its depth, nanoseconds: half a period at 15 Hz, the slowest tracking rate. Older
/// colour shows another pose.
const MAX_GAP_NS: u64 = 33_400_000;

/// The files of one frame, relative to the folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    /// Capture time of the depth image, nanoseconds.
    pub(super) time_ns: u64,
    /// Depth image.
    pub(super) depth: String,
    /// Colour image nearest in time.
    pub(super) color: Option<String>,
}

/// Frames of a folder, sorted by time.
pub(super) fn entries(folder: &Path) -> Result<Vec<Entry>, FormatError> {
    let depth = images(folder, "depth", &["png"])?;
    if depth.is_empty() {
        return Err(FormatError::field(
            folder,
            "depth",
            "no depth images: expected depth/*.png and perhaps depth.txt",
        ));
    }
    let color = images(folder, "rgb", &["png", "jpg", "jpeg"])?;
    Ok(depth
        .into_iter()
        .map(|(time_ns, file)| Entry {
            time_ns,
            depth: file,
            color: nearest(&color, time_ns).map(str::to_owned),
        })
        .collect())
}

/// Image nearest in time, within [`MAX_GAP_NS`].
fn nearest(list: &[(u64, String)], time_ns: u64) -> Option<&str> {
    let after = list.partition_point(|(t, _)| *t < time_ns);
    let candidates = [after.checked_sub(1), Some(after)];
    let gap = |i: &usize| list[*i].0.abs_diff(time_ns);
    let best = candidates
        .into_iter()
        .flatten()
        .filter(|&i| i < list.len())
        .min_by_key(gap)?;
    (gap(&best) <= MAX_GAP_NS).then_some(list[best].1.as_str())
}

/// Images of `NAME.txt` if it exists, else the sorted files of `NAME/` at 30 Hz. Sorted by time.
fn images(
    folder: &Path,
    name: &str,
    extensions: &[&str],
) -> Result<Vec<(u64, String)>, FormatError> {
    let list = folder.join(format!("{name}.txt"));
    if list.exists() {
        return time_list(&list);
    }
    let dir = folder.join(name);
    if !dir.exists() {
        return Ok(Vec::new());
    }
    let mut files = Vec::new();
    for item in std::fs::read_dir(&dir).map_err(|e| FormatError::io(&dir, e))? {
        let path = item.map_err(|e| FormatError::io(&dir, e))?.path();
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default()
            .to_ascii_lowercase();
        if let Some(file) = path.file_name().and_then(|f| f.to_str())
            && extensions.contains(&extension.as_str())
        {
            files.push(format!("{name}/{file}"));
        }
    }
    files.sort();
    Ok(files
        .into_iter()
        .enumerate()
        .map(|(i, f)| (i as u64 * DEFAULT_PERIOD_NS, f))
        .collect())
}

/// Lines of `timestamp path`, seconds with a fraction; `#` starts a comment.
fn time_list(path: &Path) -> Result<Vec<(u64, String)>, FormatError> {
    let bytes = read_limited(path, MAX_LIST_BYTES)?;
    let text = String::from_utf8_lossy(&bytes);
    let mut out = Vec::new();
    for (n, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fault = |why: String| FormatError::field(path, format!("line {}", n + 1), why);
        let (time, file) = line
            .split_once(char::is_whitespace)
            .ok_or_else(|| fault("expected `timestamp path`".into()))?;
        let time_ns =
            nanoseconds(time).ok_or_else(|| fault(format!("`{time}` is no time in seconds")))?;
        let file = file.trim();
        let inside =
            !Path::new(file).is_absolute() && !file.split(['/', '\\']).any(|part| part == "..");
        if !inside {
            return Err(fault(format!("`{file}` leads out of the folder")));
        }
        out.push((time_ns, file.to_owned()));
    }
    out.sort();
    Ok(out)
}

/// Parses decimal seconds as nanoseconds, digit by digit: f64 cannot hold nanoseconds since 1970.
fn nanoseconds(text: &str) -> Option<u64> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() || !digits(whole) || !digits(fraction) {
        return None;
    }
    let nanos: String = fraction
        .chars()
        .chain(std::iter::repeat('0'))
        .take(9)
        .collect();
    whole
        .parse::<u64>()
        .ok()?
        .checked_mul(1_000_000_000)?
        .checked_add(nanos.parse().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_keep_every_digit() {
        assert_eq!(
            nanoseconds("1305031102.175304"),
            Some(1_305_031_102_175_304_000)
        );
        assert_eq!(nanoseconds("0.033333"), Some(33_333_000));
        assert_eq!(nanoseconds("7"), Some(7_000_000_000));
        for bad in ["", ".5", "-1", "nan", "1e3", "99999999999999"] {
            assert_eq!(nanoseconds(bad), None, "{bad}");
        }
    }

    #[test]
    fn colour_is_the_nearest_in_time_within_the_gap() {
        let list: Vec<(u64, String)> = [0u64, 33, 66, 300]
            .iter()
            .map(|t| (t * 1_000_000, format!("{t}")))
            .collect();
        assert_eq!(nearest(&list, 40_000_000), Some("33"));
        assert_eq!(nearest(&list, 52_000_000), Some("66"));
        assert_eq!(nearest(&list, 150_000_000), None);
        assert_eq!(nearest(&list, 320_000_000), Some("300"));
        assert_eq!(nearest(&[], 0), None);
    }
}
