//! report.json, written by the headless commands beside their pictures.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

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
    fn percentiles_are_nearest_ranks() {
        let v: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let s = Summary::of(&v);
        assert_eq!((s.count, s.p50, s.p99, s.max), (100, 50.0, 99.0, 100.0));
        assert_eq!(Summary::of(&[]).count, 0);
        assert_eq!(Summary::of(&[f64::NAN, 3.0]).p50, 3.0);
    }
}
