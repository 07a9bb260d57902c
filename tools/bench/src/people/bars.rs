//! Bars of a release: measure, value, number of cases and worst cases, as Markdown and JSON.

use crate::EvaluateError;
use crate::table::write_report;
use serde::Serialize;
use std::path::{Path, PathBuf};
use tryon_geometry::math::order_statistics;

/// One measured bar.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bar {
    /// Row of the bench that measured it, as `--only` takes it.
    pub row: &'static str,
    /// Measure with its unit, for example `joint error, mean [mm]`.
    pub measure: String,
    /// Value; NaN when nothing could be measured.
    pub value: f64,
    /// Cases behind the value: frames, stills or people.
    pub cases: usize,
    /// Worst cases by name, worst first.
    pub worst: Vec<String>,
}

impl Bar {
    /// A bar without worst cases.
    pub(super) fn new(measure: impl Into<String>, value: f64, cases: usize) -> Self {
        Self {
            row: "",
            measure: measure.into(),
            value,
            cases,
            worst: Vec::new(),
        }
    }
    /// The same of a row.
    pub(super) fn of(self, row: &'static str) -> Self {
        Self { row, ..self }
    }
    /// Adds the names of the worst cases.
    pub(super) fn worst(mut self, names: Vec<String>) -> Self {
        self.worst = names;
        self
    }
}

/// Most cases that are named in a bar.
const NAMED: usize = 4;

/// Names with a value, greatest first, at most [`NAMED`].
pub(super) fn greatest(mut cases: Vec<(String, f64)>, unit: &str) -> Vec<String> {
    cases.retain(|c| !c.1.is_nan());
    cases.sort_by(|a, b| b.1.total_cmp(&a.1));
    cases.truncate(NAMED);
    let text = |(name, value): (String, f64)| format!("{name} {value:.0}{unit}");
    cases.into_iter().map(text).collect()
}

/// Share of true values, per cent; NaN without any.
pub(super) fn percent(values: impl IntoIterator<Item = bool>) -> f64 {
    let (mut n, mut hits) = (0usize, 0usize);
    for v in values {
        n += 1;
        hits += usize::from(v);
    }
    100.0 * hits as f64 / n as f64
}

/// Value below which a share `q` of the values lie; NaN without values.
pub(super) fn quantile(values: &[f64], q: f64) -> f64 {
    order_statistics::quantile(&mut values.to_vec(), q).unwrap_or(f64::NAN)
}

/// All bars of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BarTable {
    /// Command that reproduces it.
    pub command: String,
    /// The bars.
    pub bars: Vec<Bar>,
    /// Rows that were left out, each with its reason.
    pub skipped: Vec<String>,
}

impl BarTable {
    /// Table for people.
    pub fn to_markdown(&self) -> String {
        let mut out =
            String::from("| row | measure | value | cases | worst |\n|---|---|---|---|---|\n");
        for b in &self.bars {
            out += &format!(
                "| {} | {} | {:.1} | {} | {} |\n",
                b.row,
                b.measure,
                b.value,
                b.cases,
                b.worst.join(", ")
            );
        }
        for s in &self.skipped {
            out += &format!("\nSKIPPED: {s}\n");
        }
        out
    }

    /// Writes `people.md` and `people.json` into `dir`, which is made when missing. Returns the files.
    ///
    /// # Errors
    /// Names the file that cannot be written.
    pub fn write(&self, dir: &Path) -> Result<[PathBuf; 2], EvaluateError> {
        let json = serde_json::to_value(self).unwrap_or_default();
        write_report(dir, "people", self.to_markdown(), &json)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_quantiles_of_nothing_are_nan() {
        assert!(percent([]).is_nan() && quantile(&[], 0.5).is_nan());
        assert_eq!(percent([true, false, false, true]), 50.0);
        assert_eq!(quantile(&[4.0, 1.0, 3.0, 2.0, 5.0], 0.5), 3.0);
        assert_eq!(quantile(&[4.0, 1.0], 0.95), 4.0);
    }

    #[test]
    fn worst_cases_come_first_and_skipped_rows_are_said() {
        let cases = vec![
            ("a".into(), 1.0),
            ("b".into(), f64::NAN),
            ("c".into(), 30.2),
        ];
        let bar = Bar::new("found [%]", 50.0, 2)
            .of("poses")
            .worst(greatest(cases, " mm"));
        assert_eq!(bar.worst, ["c 30 mm", "a 1 mm"]);
        let table = BarTable {
            bars: vec![bar],
            skipped: vec!["uva: no folder".into()],
            ..BarTable::default()
        };
        let text = table.to_markdown();
        assert!(text.contains("| poses | found [%] | 50.0 | 2 | c 30 mm, a 1 mm |"));
        assert!(text.contains("SKIPPED: uva: no folder"));
    }
}
