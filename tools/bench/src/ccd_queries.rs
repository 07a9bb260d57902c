//! Queries of continuous collision detection with exact truth, in the CSV of Wang et al. 2021 ("A large-scale benchmark
//! and an inclusion-based algorithm for continuous collision detection").
//!
//! Eight rows a query: four points at time 0, then at time 1. Seven integers a row: numerator and denominator of x, y
//! and z, and the truth. Coordinates are rounded to the nearest f64; sets that were made from f64 lose nothing.

use super::EvaluateError;
use num_bigint::BigInt;
use num_rational::Ratio;
use num_traits::{ToPrimitive, Zero};
use std::path::{Path, PathBuf};
use tryon_cloth::contact::ccd::{PairKind, PairMotion};
use tryon_geometry::math::V3d;

/// Folders of the files of each kind.
pub(super) const KINDS: [(&str, PairKind); 2] = [
    ("vertex-face", PairKind::VertexFace),
    ("edge-edge", PairKind::EdgeEdge),
];
/// Rows of one query, and columns of a row.
const ROWS: usize = 8;
const COLUMNS: usize = 7;

/// One query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CcdQuery {
    /// Vertex and three corners, or ends of the first and of the second edge, at times 0 and 1.
    pub(super) motion: PairMotion,
    /// Truth: the points' simplices meet within [0, 1].
    pub(super) has_impact: bool,
    /// False if a coordinate was rounded, by half a unit in the last place at most.
    pub(super) is_exact: bool,
}

/// Files of one group and kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CcdQuerySet {
    /// Path of the group below the folder that was searched; the folder's own name at its top.
    pub(super) group: String,
    /// Index in [`KINDS`].
    pub(super) kind: usize,
    /// CSV files in the order of their names.
    pub(super) files: Vec<PathBuf>,
}

fn fault(file: &Path, why: impl ToString) -> EvaluateError {
    EvaluateError::new(file.display(), why)
}

/// Sets below `root`: CSV files in folders named as in [`KINDS`], in the order of their paths.
///
/// # Errors
/// When a folder can't be read, or none holds queries.
pub(super) fn find_ccd_queries(root: &Path) -> Result<Vec<CcdQuerySet>, EvaluateError> {
    let mut sets = Vec::new();
    search(root, root, &mut sets)?;
    if sets.is_empty() {
        return Err(fault(
            root,
            "no CSV file lies in a folder named vertex-face or edge-edge",
        ));
    }
    Ok(sets)
}

fn search(root: &Path, folder: &Path, sets: &mut Vec<CcdQuerySet>) -> Result<(), EvaluateError> {
    let (mut folders, mut files) = (Vec::new(), Vec::new());
    for entry in std::fs::read_dir(folder).map_err(|e| fault(folder, e))? {
        let path = entry.map_err(|e| fault(folder, e))?.path();
        if path.is_dir() {
            folders.push(path);
        } else if path.extension().is_some_and(|e| e == "csv") {
            files.push(path);
        }
    }
    let kind = KINDS.iter().position(|k| folder.ends_with(k.0));
    if let Some(kind) = kind.filter(|_| !files.is_empty()) {
        files.sort();
        let group = folder.parent().unwrap_or(folder);
        let below = group
            .strip_prefix(root)
            .ok()
            .filter(|b| b.file_name().is_some());
        let shown = below.or(root.file_name().map(Path::new)).unwrap_or(root);
        let group = shown.to_string_lossy().into_owned();
        sets.push(CcdQuerySet { group, kind, files });
    }
    folders.sort();
    folders.iter().try_for_each(|f| search(root, f, sets))
}

/// Reads the queries of one file.
///
/// # Errors
/// When it can't be read, a row isn't seven integers, the rows of a query disagree on the truth, or the last query is
/// incomplete. Names the line.
pub(super) fn read_ccd_queries(
    file: &Path,
    kind: PairKind,
) -> Result<Vec<CcdQuery>, EvaluateError> {
    let text = std::fs::read_to_string(file).map_err(|e| fault(file, e))?;
    let mut rows = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        if !line.trim().is_empty() {
            let row = QueryRow::parse(line);
            rows.push(row.map_err(|why| fault(file, format!("line {number}: {why}")))?);
        }
    }
    if !rows.len().is_multiple_of(ROWS) {
        let why = format!("the last query has {} rows, not {ROWS}", rows.len() % ROWS);
        return Err(fault(file, why));
    }
    let query = |(k, rows): (usize, &[QueryRow])| {
        let has_impact = rows[0].has_impact;
        if rows.iter().any(|r| r.has_impact != has_impact) {
            return Err(fault(file, format!("the rows of query {} disagree", k + 1)));
        }
        let motion = PairMotion {
            kind,
            start: std::array::from_fn(|i| rows[i].point),
            end: std::array::from_fn(|i| rows[i + 4].point),
        };
        Ok(CcdQuery {
            motion,
            has_impact,
            is_exact: rows.iter().all(|r| r.is_exact),
        })
    };
    rows.chunks_exact(ROWS).enumerate().map(query).collect()
}

struct QueryRow {
    point: V3d,
    has_impact: bool,
    is_exact: bool,
}

impl QueryRow {
    fn parse(line: &str) -> Result<Self, String> {
        let columns: Vec<&str> = line.split(',').map(str::trim).collect();
        if columns.len() != COLUMNS {
            return Err(format!("{} columns, not {COLUMNS}", columns.len()));
        }
        let (mut point, mut is_exact) = (V3d::zeros(), true);
        for (axis, ratio) in columns.chunks_exact(2).enumerate() {
            let (value, exact) = round_ratio(ratio[0], ratio[1])?;
            point[axis] = value;
            is_exact &= exact;
        }
        let has_impact = match columns[COLUMNS - 1] {
            "0" => false,
            "1" => true,
            other => return Err(format!("the truth `{other}` is neither 0 nor 1")),
        };
        Ok(Self {
            point,
            has_impact,
            is_exact,
        })
    }
}

/// Nearest f64 of `numerator / denominator`, ties to even, and if it is exact.
///
/// # Errors
/// When one isn't an integer, the denominator isn't positive, or the quotient is beyond the range of f64.
fn round_ratio(numerator: &str, denominator: &str) -> Result<(f64, bool), String> {
    let integer = |digits: &str| -> Result<BigInt, String> {
        let parsed = digits.parse();
        parsed.map_err(|e| format!("`{digits}` is not an integer: {e}"))
    };
    let (n, d) = (integer(numerator)?, integer(denominator)?);
    if d <= BigInt::ZERO {
        return Err(format!("the denominator {d} is not positive"));
    }
    // Reduced or not, the value is the same.
    let ratio = Ratio::new_raw(n, d);
    let beyond = || format!("{numerator}/{denominator} is beyond the range of f64");
    let value = ratio.to_f64().filter(|v| v.is_normal() || ratio.is_zero());
    let value = value.ok_or_else(beyond)?;
    let rounded = Ratio::<BigInt>::from_float(value).ok_or_else(beyond)?;
    let is_exact = rounded.numer() * ratio.denom() == ratio.numer() * rounded.denom();
    Ok((value, is_exact))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_name_the_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("data.csv");
        let good = "1,2,-3,4,0,1,1\n";
        for (bad, expected) in [
            ("1,2,-3,4,0,1\n", "line 3: 6 columns"),
            ("1,2,x,4,0,1,1\n", "line 3: `x` is not an integer"),
            ("1,0,3,4,0,1,1\n", "line 3: the denominator 0"),
            ("1,2,3,4,0,1,2\n", "line 3: the truth"),
            ("1,2,-3,4,0,1,0\n", "the rows of query 1 disagree"),
            ("", "the last query has 7 rows"),
        ] {
            std::fs::write(&file, good.repeat(2) + bad + &good.repeat(5)).expect("a file");
            let fault = read_ccd_queries(&file, PairKind::VertexFace).expect_err("a fault");
            assert!(fault.to_string().contains(expected), "{fault}");
        }
        assert!(find_ccd_queries(folder.path()).is_err());
    }

    #[test]
    fn ratios_are_correctly_rounded() {
        let value = |n: &str, d: &str| round_ratio(n, d).expect("a rational");
        assert_eq!(value("-3", "4"), (-0.75, true));
        assert_eq!(value("0", "7"), (0.0, true));
        assert_eq!(value("1", "3"), (1.0 / 3.0, false));
        // 2^200 + 1 over 2^200: just over 1.
        let power = BigInt::from(2).pow(200);
        let (n, d) = ((&power + 1u32).to_string(), power.to_string());
        assert_eq!(value(&n, &d), (1.0, false));
        assert_eq!(value("-1", &d), (-(2f64.powi(-200)), true));
        // Halfway between 2^53 and its successor: ties to even; a little more than halfway is rounded up.
        assert_eq!(value("9007199254740993", "1"), (9007199254740992.0, false));
        let more = "90071992547409930000000000001";
        assert_eq!(value(more, "10000000000000"), (9007199254740994.0, false));
        assert!(round_ratio("1", "-2").is_err() && round_ratio("", "1").is_err());
        assert!(round_ratio(&"9".repeat(400), "1").is_err());
    }
}
