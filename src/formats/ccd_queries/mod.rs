//! Queries of continuous collision detection with exact truth, in the CSV of Wang et al. 2021 ("A large-scale benchmark
//! and an inclusion-based algorithm for continuous collision detection").
//!
//! Eight rows a query: four points at time 0, then at time 1. Seven integers a row: numerator and denominator of x, y
//! and z, and the truth. Coordinates are rounded to the nearest f64; sets that were made from f64 lose nothing.

mod rational;

use super::FormatError;
use rational::round_ratio;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use tryon_geometry::math::V3d;

/// Folder of vertex–face files.
const VERTEX_FACE: &str = "vertex-face";
/// Folder of edge–edge files.
const EDGE_EDGE: &str = "edge-edge";
/// Rows of one query.
const ROWS: usize = 8;
/// Columns of one row.
const COLUMNS: [&str; 7] = [
    "x numerator",
    "x denominator",
    "y numerator",
    "y denominator",
    "z numerator",
    "z denominator",
    "truth",
];

/// One query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CcdQuery {
    /// Points at time 0: vertex and three corners, or ends of the first and of the second edge.
    pub start: [V3d; 4],
    /// Points at time 1.
    pub end: [V3d; 4],
    /// Truth: the points' simplices meet within [0, 1].
    pub has_impact: bool,
    /// False if a coordinate was rounded, by half a unit in the last place at most.
    pub is_exact: bool,
}

/// Files of one group and kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CcdQuerySet {
    /// Path of the group below the folder that was searched; the folder's own name at its top.
    pub group: String,
    /// True for edge–edge, false for vertex–face.
    pub is_edge_edge: bool,
    /// CSV files in the order of their names.
    pub files: Vec<PathBuf>,
}

/// Sets below `root`: CSV files in folders named `vertex-face` and `edge-edge`, in the order of their paths.
///
/// # Errors
/// When a folder can't be read, or none holds queries.
pub fn find_ccd_queries(root: &Path) -> Result<Vec<CcdQuerySet>, FormatError> {
    let mut sets = Vec::new();
    search(root, root, &mut sets)?;
    if sets.is_empty() {
        let why = format!("no CSV file lies in a folder named {VERTEX_FACE} or {EDGE_EDGE}");
        return Err(FormatError::field(root, "folder", why));
    }
    Ok(sets)
}

fn search(root: &Path, folder: &Path, sets: &mut Vec<CcdQuerySet>) -> Result<(), FormatError> {
    let io = |e| FormatError::io(folder, e);
    let (mut folders, mut files) = (Vec::new(), Vec::new());
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.is_dir() {
            folders.push(path);
        } else if path.extension().is_some_and(|e| e == "csv") {
            files.push(path);
        }
    }
    let name = folder.file_name().and_then(|n| n.to_str());
    if matches!(name, Some(VERTEX_FACE | EDGE_EDGE)) && !files.is_empty() {
        files.sort();
        sets.push(CcdQuerySet {
            group: group_name(root, folder),
            is_edge_edge: name == Some(EDGE_EDGE),
            files,
        });
    }
    folders.sort();
    folders.iter().try_for_each(|f| search(root, f, sets))
}

fn group_name(root: &Path, folder: &Path) -> String {
    let group = folder.parent().unwrap_or(folder);
    let below = group.strip_prefix(root).unwrap_or(group);
    let shown = if below.as_os_str().is_empty() {
        root.file_name().map(Path::new).unwrap_or(root)
    } else {
        below
    };
    shown.to_string_lossy().into_owned()
}

/// Reads the queries of one file.
///
/// # Errors
/// When it can't be read, a row isn't seven integers, the rows of a query disagree on the truth, or the last query is
/// incomplete. The field is the line and the column.
pub fn read_ccd_queries(file: &Path) -> Result<Vec<CcdQuery>, FormatError> {
    let reader = BufReader::new(File::open(file).map_err(|e| FormatError::io(file, e))?);
    let mut queries = Vec::new();
    let mut rows = Vec::with_capacity(ROWS);
    let mut last = 0;
    for (number, line) in (1..).zip(reader.lines()) {
        let line = line.map_err(|e| FormatError::io(file, e))?;
        if line.trim().is_empty() {
            continue;
        }
        rows.push(read_row(file, number, &line)?);
        last = number;
        if let Ok(eight) = <[QueryRow; ROWS]>::try_from(rows.as_slice()) {
            queries.push(join_rows(file, number, &eight)?);
            rows.clear();
        }
    }
    if !rows.is_empty() {
        let why = format!("the last query has {} rows, not {ROWS}", rows.len());
        return Err(FormatError::field(file, format!("line {last}"), why));
    }
    Ok(queries)
}

#[derive(Clone, Copy)]
struct QueryRow {
    point: V3d,
    has_impact: bool,
    is_exact: bool,
}

fn read_row(file: &Path, number: usize, line: &str) -> Result<QueryRow, FormatError> {
    let fault = |column: usize, why: String| {
        FormatError::field(file, format!("line {number}, {}", COLUMNS[column]), why)
    };
    let columns: Vec<&str> = line.split(',').map(str::trim).collect();
    let Ok(columns) = <[&str; 7]>::try_from(columns.as_slice()) else {
        let why = format!("it has {} columns, not {}", columns.len(), COLUMNS.len());
        return Err(FormatError::field(file, format!("line {number}"), why));
    };
    let (mut point, mut is_exact) = (V3d::zeros(), true);
    for axis in 0..3 {
        let (n, d) = (2 * axis, 2 * axis + 1);
        let rounded = round_ratio(columns[n], columns[d]).map_err(|why| fault(n, why))?;
        point[axis] = rounded.value;
        is_exact &= rounded.is_exact;
    }
    let has_impact = match columns[6] {
        "0" => false,
        "1" => true,
        other => return Err(fault(6, format!("`{other}` is neither 0 nor 1"))),
    };
    Ok(QueryRow {
        point,
        has_impact,
        is_exact,
    })
}

fn join_rows(file: &Path, number: usize, rows: &[QueryRow; ROWS]) -> Result<CcdQuery, FormatError> {
    let has_impact = rows[0].has_impact;
    if rows.iter().any(|r| r.has_impact != has_impact) {
        let why = "the rows of one query disagree".to_owned();
        return Err(FormatError::field(
            file,
            format!("line {number}, truth"),
            why,
        ));
    }
    Ok(CcdQuery {
        start: std::array::from_fn(|i| rows[i].point),
        end: std::array::from_fn(|i| rows[i + 4].point),
        has_impact,
        is_exact: rows.iter().all(|r| r.is_exact),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_file<R>(text: &str, f: impl FnOnce(&Path) -> R) -> R {
        let folder = tempfile::tempdir().expect("a folder");
        let kind = folder.path().join("some group").join(VERTEX_FACE);
        std::fs::create_dir_all(&kind).expect("a folder");
        let file = kind.join("data.csv");
        std::fs::write(&file, text).expect("a file");
        f(&file)
    }

    #[test]
    fn a_query_is_eight_rows_of_rationals() {
        let text = "1,2,-3,4,0,1,1\n".repeat(16);
        with_file(&text, |file| {
            let queries = read_ccd_queries(file).expect("queries");
            assert_eq!(queries.len(), 2);
            assert_eq!(queries[0].start, [V3d::new(0.5, -0.75, 0.0); 4]);
            assert!(queries[0].has_impact && queries[0].is_exact);
            let root = file.ancestors().nth(3).expect("the root");
            let sets = find_ccd_queries(root).expect("sets");
            assert_eq!(sets.len(), 1);
            assert_eq!(sets[0].group, "some group");
            assert!(!sets[0].is_edge_edge);
            let group = file.ancestors().nth(2).expect("the group");
            assert_eq!(find_ccd_queries(group).expect("sets"), sets);
        });
    }

    #[test]
    fn faults_name_line_and_column() {
        let good = "1,2,-3,4,0,1,1\n";
        for (bad, expected) in [
            ("1,2,-3,4,0,1\n", "line 3`: it has 6 columns"),
            ("1,2,x,4,0,1,1\n", "line 3, y numerator`"),
            (
                "1,0,3,4,0,1,1\n",
                "line 3, x numerator`: the denominator is 0",
            ),
            ("1,2,3,4,0,1,2\n", "line 3, truth`"),
            (
                "1,2,-3,4,0,1,0\n",
                "line 8, truth`: the rows of one query disagree",
            ),
            ("", "line 7`: the last query has 7 rows"),
        ] {
            let text = good.repeat(2) + bad + &good.repeat(5);
            let fault = with_file(&text, |f| {
                read_ccd_queries(f).expect_err("a fault").to_string()
            });
            assert!(fault.contains(expected), "{fault}");
        }
        let empty = tempfile::tempdir().expect("a folder");
        assert!(find_ccd_queries(empty.path()).is_err());
    }
}
