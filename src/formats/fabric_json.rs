//! Measured fabrics as JSON: ARCSim's format of the data of Wang, O'Brien & Ramamoorthi 2011.

use super::FormatError;
use super::image::read_limited;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Largest file, bytes; a fabric has 1 kB.
const MAX_BYTES: u64 = 1 << 20;
/// Rows and columns of the two tables.
const SHAPES: [(&str, usize, usize); 2] = [("stretching", 6, 4), ("bending", 3, 5)];

/// Measured fabric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredFabric {
    /// Mass of a square metre, kg/m².
    pub density: f64,
    /// Rows: at rest, then stretched along 0°, 22.5°, 45°, 67.5° and 90° to the weft. Columns: c₁₁, c₁₂, c₂₂, c₃₃ of the
    /// in-plane stiffness, N/m.
    pub stretching: Vec<Vec<f64>>,
    /// Rows: bent about 0°, 45° and 90°. Columns: five growing curvatures. N·m.
    pub bending: Vec<Vec<f64>>,
}

/// Reads a fabric file.
///
/// # Errors
/// As [`parse_fabric`], or when the file cannot be read.
pub fn read_fabric(path: &Path) -> Result<MeasuredFabric, FormatError> {
    let bytes = read_limited(path, MAX_BYTES)?;
    let text = String::from_utf8(bytes)
        .map_err(|_| FormatError::field(path, "text", "it is not UTF-8"))?;
    parse_fabric(&text, path)
}

/// Parses fabric text; `origin` is named in errors.
///
/// # Errors
/// Names the field, row or value at fault.
pub fn parse_fabric(text: &str, origin: &Path) -> Result<MeasuredFabric, FormatError> {
    let f: MeasuredFabric = serde_json::from_str(text)
        .map_err(|e| FormatError::field(origin, "fabric", e.to_string()))?;
    if !(f.density > 0.0 && f.density < 100.0) {
        return Err(FormatError::field(
            origin,
            "density",
            format!("{} kg/m² is no fabric", f.density),
        ));
    }
    for ((field, rows, columns), table) in SHAPES.into_iter().zip([&f.stretching, &f.bending]) {
        if table.len() != rows {
            return Err(FormatError::field(
                origin,
                field,
                format!("{} rows, {rows} are needed", table.len()),
            ));
        }
        for (k, row) in table.iter().enumerate() {
            let at = format!("{field}[{k}]");
            if row.len() != columns {
                return Err(FormatError::field(
                    origin,
                    at,
                    format!("{} values, {columns} are needed", row.len()),
                ));
            }
            if let Some(v) = row.iter().find(|v| !v.is_finite()) {
                return Err(FormatError::field(origin, at, format!("{v} is not finite")));
            }
        }
    }
    Ok(f)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FABRIC: &str = r#"{"density":0.2,"stretching":[[1,0,2,3],[4,0,5,6],[4,0,5,6],[4,0,5,6],[4,0,5,6],[4,0,5,6]],
        "bending":[[1e-6,1e-6,1e-6,1e-6,1e-6],[1e-6,1e-6,1e-6,1e-6,1e-6],[1e-6,1e-6,1e-6,1e-6,1e-6]]}"#;

    #[test]
    fn tables_read_and_faults_are_named() {
        let parse = |t: &str| parse_fabric(t, Path::new("f.json")).map_err(|e| e.to_string());
        assert_eq!(parse(FABRIC).expect("valid").stretching[0][2], 2.0);
        let e = parse(&FABRIC.replace("[1,0,2,3]", "[1,0,2]")).expect_err("short row");
        assert!(e.contains("stretching[0]") && e.contains("3 values"), "{e}");
        assert!(
            parse(&FABRIC.replace("0.2", "-1"))
                .expect_err("mass")
                .contains("density")
        );
        for cut in 0..FABRIC.len() {
            assert!(parse(&FABRIC[..cut]).is_err());
        }
    }
}
