//! Colour image of each depth image: by time where both have times, else by number, else by position.

use super::names::frame_number;
use crate::rgbd_source::MAX_COLOR_GAP_NS;
use std::collections::BTreeMap;

/// Images of one camera, sorted by time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct ImageList {
    /// Time in nanoseconds, and path relative to the folder.
    pub(super) images: Vec<(u64, String)>,
    /// True if the times are the recording's, not made up from positions.
    pub(super) has_times: bool,
}

impl ImageList {
    /// Adds a time to all times; the order stays.
    pub(super) fn shift(&mut self, offset_ns: i64) {
        for (time, _) in &mut self.images {
            *time = time.saturating_add_signed(offset_ns);
        }
    }
}

/// Colour image of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ColorEntry {
    /// Path relative to the folder.
    pub(super) file: String,
    /// Capture time on the clock of depth, nanoseconds, where both have times.
    pub(super) time_ns: Option<u64>,
}

impl ColorEntry {
    pub(super) fn untimed(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            time_ns: None,
        }
    }
}

/// Colour of each depth image, and a note on colour that no frame has.
pub(super) type PairedColors = (Vec<Option<ColorEntry>>, Option<String>);

/// Pairs colour images with depth images.
pub(super) fn pair_colors(depth: &ImageList, color: &ImageList) -> PairedColors {
    let total = color.images.len();
    let found = if depth.has_times && color.has_times {
        Some(by_time(depth, color))
    } else {
        by_number(depth, color).or_else(|| by_position(depth, color))
    };
    let Some(found) = found else {
        let why = format!(
            "{total} colour images are left out: neither numbers in their names, nor their count ({} depth images), nor \
             a time list pairs them",
            depth.images.len()
        );
        return (vec![None; depth.images.len()], Some(why));
    };
    let is_lost = total > 0 && found.iter().all(Option::is_none);
    let note =
        is_lost.then(|| format!("{total} colour images are left out: no depth has their time"));
    (found, note)
}

fn by_time(depth: &ImageList, color: &ImageList) -> Vec<Option<ColorEntry>> {
    let times = depth.images.iter().map(|(time, _)| *time);
    let entry = |(time, file): &(u64, String)| ColorEntry {
        file: file.clone(),
        time_ns: Some(*time),
    };
    times
        .map(|t| nearest(&color.images, t).map(entry))
        .collect()
}

/// Image nearest in time, within [`MAX_COLOR_GAP_NS`].
fn nearest(list: &[(u64, String)], time_ns: u64) -> Option<&(u64, String)> {
    let after = list.partition_point(|(t, _)| *t < time_ns);
    let candidates = [after.checked_sub(1), Some(after)];
    let gap = |i: &usize| list[*i].0.abs_diff(time_ns);
    let best = candidates
        .into_iter()
        .flatten()
        .filter(|&i| i < list.len())
        .min_by_key(gap)?;
    (gap(&best) <= MAX_COLOR_GAP_NS).then_some(&list[best])
}

/// Pairs of equal numbers; `None` if a name has none, two have the same, or none is in both lists.
fn by_number(depth: &ImageList, color: &ImageList) -> Option<Vec<Option<ColorEntry>>> {
    let of_depth = numbered(depth)?;
    let of_color = numbered(color)?;
    if !of_color.keys().any(|n| of_depth.contains_key(n)) {
        return None;
    }
    let color_of = |file: &str| {
        of_color
            .get(&frame_number(file)?)
            .map(|c| ColorEntry::untimed(c))
    };
    Some(
        depth
            .images
            .iter()
            .map(|(_, file)| color_of(file))
            .collect(),
    )
}

/// Images by number, if each has a number of its own.
fn numbered(list: &ImageList) -> Option<BTreeMap<u64, &str>> {
    let files = list.images.iter().map(|(_, file)| file.as_str());
    let map: BTreeMap<u64, &str> = files
        .map(|file| frame_number(file).map(|n| (n, file)))
        .collect::<Option<_>>()?;
    (map.len() == list.images.len()).then_some(map)
}

/// Pairs in the lists' order, if they have the same length.
fn by_position(depth: &ImageList, color: &ImageList) -> Option<Vec<Option<ColorEntry>>> {
    let files = color
        .images
        .iter()
        .map(|(_, file)| Some(ColorEntry::untimed(file)));
    (depth.images.len() == color.images.len()).then(|| files.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_is_the_nearest_in_time_within_the_gap() {
        let list: Vec<(u64, String)> = [0u64, 33, 66, 300]
            .iter()
            .map(|t| (t * 1_000_000, format!("{t}")))
            .collect();
        let nearest_name = |t| nearest(&list, t).map(|(_, file)| file.as_str());
        assert_eq!(nearest_name(40_000_000), Some("33"));
        assert_eq!(nearest_name(52_000_000), Some("66"));
        assert_eq!(nearest_name(150_000_000), None);
        assert_eq!(nearest_name(320_000_000), Some("300"));
        assert_eq!(nearest(&[], 0), None);
    }

    fn list(files: &[&str], has_times: bool) -> ImageList {
        ImageList {
            images: files.iter().map(|f| (0, (*f).to_owned())).collect(),
            has_times,
        }
    }

    fn paired(depth: &[&str], color: &[&str]) -> (Vec<String>, bool) {
        let (found, note) = pair_colors(&list(depth, true), &list(color, false));
        let name = |c: Option<ColorEntry>| c.map(|c| c.file).unwrap_or_default();
        let found = found.into_iter().map(name).collect();
        (found, note.is_some())
    }

    #[test]
    fn colour_without_times_pairs_by_number_then_by_position() {
        let (found, noted) = paired(
            &["d1.png", "d2.png", "d4.png"],
            &["2.jpg", "3.jpg", "4.jpg"],
        );
        assert_eq!(
            (found.as_slice(), noted),
            (&[String::new(), "2.jpg".into(), "4.jpg".into()][..], false)
        );
        let (found, noted) = paired(&["d1.png", "d2.png"], &["a.png", "b.png"]);
        assert_eq!(
            (found.as_slice(), noted),
            (&["a.png".to_owned(), "b.png".into()][..], false)
        );
        let (found, noted) = paired(&["d1.png", "d2.png"], &["a.png"]);
        assert_eq!(
            (found.as_slice(), noted),
            (&[String::new(), String::new()][..], true)
        );
        // The same number in all names is none.
        let (found, _) = paired(&["a_v2.png", "b_v2.png"], &["x_v2.png", "y_v2.png"]);
        assert_eq!(found, ["x_v2.png", "y_v2.png"]);
        assert_eq!(paired(&["1.png"], &[]), (vec![String::new()], true));
    }
}
