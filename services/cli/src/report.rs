//! report.json, written by the headless commands beside their pictures.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::{Display, Formatter};
use std::path::Path;
use tryon::view::OffPerson;

/// Distribution of a measured quantity.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Summary {
    /// Number of samples.
    pub(crate) count: usize,
    /// Arithmetic mean.
    pub(crate) mean: f64,
    /// Median.
    pub(crate) p50: f64,
    /// 99th percentile.
    pub(crate) p99: f64,
    /// Largest.
    pub(crate) max: f64,
}

impl Summary {
    /// Summary of samples in any order; all zero without samples.
    pub(crate) fn of(samples: &[f64]) -> Self {
        let mut v: Vec<f64> = samples.iter().copied().filter(|x| x.is_finite()).collect();
        v.sort_by(f64::total_cmp);
        let Some(&max) = v.last() else {
            return Self::default();
        };
        // Nearest rank: the smallest value with at least the share `q` of samples at or below it.
        let rank = |q: f64| v[((q * v.len() as f64).ceil() as usize).clamp(1, v.len()) - 1];
        Self {
            count: v.len(),
            mean: v.iter().sum::<f64>() / v.len() as f64,
            p50: rank(0.5),
            p99: rank(0.99),
            max,
        }
    }
}

/// Garment pixels off the recorded person, as shares of the garment pixels of each measured picture.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct OffPersonSummary {
    /// Pictures measured.
    measured: usize,
    /// Mean share, percent.
    mean_percent: f64,
    /// Measured pictures with a share above [`OffPerson::LIMIT`], percent.
    pub(crate) above_2_percent: f64,
    /// Largest share, percent.
    worst_percent: f64,
    /// Its frame.
    worst_frame: Option<usize>,
}

impl OffPersonSummary {
    /// Summary of frames and their shares, 0 to 1.
    pub(crate) fn of(shares: &[(usize, f32)]) -> Self {
        let Some(worst) = shares.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
            return Self::default();
        };
        let percent = |part: f64| 100.0 * part / shares.len() as f64;
        let above = shares.iter().filter(|s| s.1 > OffPerson::LIMIT).count();
        Self {
            measured: shares.len(),
            mean_percent: percent(shares.iter().map(|s| f64::from(s.1)).sum()),
            above_2_percent: percent(above as f64),
            worst_percent: 100.0 * f64::from(worst.1),
            worst_frame: Some(worst.0),
        }
    }
}

impl Display for OffPersonSummary {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "more than 2 % of the garments hang off the person in {:.0} % of {} pictures, {:.0} % at worst",
            self.above_2_percent, self.measured, self.worst_percent
        )?;
        match self.worst_frame {
            Some(frame) => write!(f, " (frame {frame})"),
            None => Ok(()),
        }
    }
}

/// Samples of a run by name.
#[derive(Debug, Default)]
pub(crate) struct Samples(BTreeMap<String, Vec<f64>>);

impl Samples {
    /// Adds one sample.
    pub(crate) fn push(&mut self, name: &str, value: f64) {
        self.0.entry(name.to_owned()).or_default().push(value);
    }
    /// Adds one sample a stage.
    pub(crate) fn extend<'a>(&mut self, stages: impl IntoIterator<Item = (&'a str, f64)>) {
        for (name, value) in stages {
            self.push(name, value);
        }
    }
    /// Summary of each name.
    pub(crate) fn summaries(&self) -> BTreeMap<String, Summary> {
        self.0
            .iter()
            .map(|(k, v)| (k.clone(), Summary::of(v)))
            .collect()
    }
}

/// Vertices of a garment in positions.npy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct GarmentPart {
    /// Name of the garment.
    pub(crate) name: String,
    /// First vertex of the garment.
    pub(crate) first_vertex: usize,
    /// Number of vertices.
    pub(crate) vertices: usize,
}

/// Vertices of garments that follow one another, by name and number of vertices.
pub(crate) fn garment_parts<'a>(
    garments: impl Iterator<Item = (&'a str, usize)>,
) -> Vec<GarmentPart> {
    let mut first_vertex = 0;
    let part = |(name, vertices): (&str, usize)| {
        let part = GarmentPart {
            name: name.to_owned(),
            first_vertex,
            vertices,
        };
        first_vertex += vertices;
        part
    };
    garments.map(part).collect()
}

/// Peak resident memory of this process, bytes; `None` where the system does not report it.
pub(crate) fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace()
        .nth(1)?
        .parse::<u64>()
        .ok()
        .map(|kib| kib * 1024)
}

/// Writes `report` as indented JSON.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn write(path: &Path, report: &impl Serialize) -> anyhow::Result<()> {
    use anyhow::Context;
    let text = serde_json::to_string_pretty(report)?;
    std::fs::write(path, text + "\n").with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_off_the_person_are_counted_above_two_percent() {
        let s = OffPersonSummary::of(&[(7, 0.0), (8, 0.25), (9, 0.015), (10, 0.035)]);
        assert_eq!((s.measured, s.worst_frame), (4, Some(8)));
        assert_eq!((s.above_2_percent, s.worst_percent), (50.0, 25.0));
        assert!((s.mean_percent - 7.5).abs() < 1e-5, "{s:?}");
        let words = s.to_string();
        assert!(words.contains("50 % of 4 pictures") && words.ends_with("(frame 8)"));
        assert_eq!(OffPersonSummary::of(&[]), OffPersonSummary::default());
    }

    #[test]
    fn percentiles_are_nearest_ranks() {
        let v: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let s = Summary::of(&v);
        assert_eq!((s.count, s.p50, s.p99, s.max), (100, 50.0, 99.0, 100.0));
        assert_eq!(Summary::of(&[]).count, 0);
        assert_eq!(Summary::of(&[f64::NAN, 3.0]).p50, 3.0);
    }
}
