//! Results of a benchmark: one row for each method, parameters and scene.

use super::EvaluateError;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// One measurement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// Sequence or scene measured on.
    pub scene: String,
    /// Method measured.
    pub method: String,
    /// Settings, in the order in which they are shown.
    pub parameters: Vec<(String, String)>,
    /// Run time of one unit of work (a frame, a step), milliseconds; the unit is named by [`Table::run_time`].
    pub run_ms: f64,
    /// Errors by name with unit, for example `("joints_mm", 8.5)`.
    pub errors: Vec<(String, f64)>,
}

impl Row {
    /// A row without parameters and errors.
    pub fn new(scene: impl Into<String>, method: impl Into<String>, run_ms: f64) -> Self {
        Self {
            scene: scene.into(),
            method: method.into(),
            run_ms,
            ..Self::default()
        }
    }
    /// Adds a parameter.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.parameters.push((name.to_owned(), value.to_string()));
        self
    }
    /// Adds an error.
    #[must_use]
    pub fn error(mut self, name: &str, value: f64) -> Self {
        self.errors.push((name.to_owned(), value));
        self
    }
    /// Error of that name, if measured.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.errors.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }
}

/// Results of one benchmark.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// File name without extension.
    pub name: String,
    /// Command that reproduces it.
    pub command: String,
    /// Unit of work that [`Row::run_ms`] counts.
    pub run_time: String,
    /// The measurements.
    pub rows: Vec<Row>,
}

/// Names of the pairs of all rows, each once, in the order of their first use.
fn names<'a, T: 'a>(pairs: impl Iterator<Item = &'a (String, T)>) -> Vec<&'a str> {
    let mut out: Vec<&str> = Vec::new();
    for (name, _) in pairs {
        if !out.contains(&name.as_str()) {
            out.push(name);
        }
    }
    out
}

/// Command line of this process.
pub(super) fn command_line() -> String {
    std::env::args().collect::<Vec<_>>().join(" ")
}

/// Writes `NAME.md` and `NAME.json` into `dir`, which is made when missing. Returns the files.
///
/// # Errors
/// Names the file that cannot be written.
pub(super) fn write_report(
    dir: &Path,
    name: &str,
    markdown: String,
    json: &Value,
) -> Result<[PathBuf; 2], EvaluateError> {
    let fault = |path: &Path, e: std::io::Error| EvaluateError::new(path.display(), e);
    std::fs::create_dir_all(dir).map_err(|e| fault(dir, e))?;
    let files = ["md", "json"].map(|ending| dir.join(format!("{name}.{ending}")));
    for (path, text) in files.iter().zip([markdown, format!("{json:#}\n")]) {
        std::fs::write(path, text).map_err(|e| fault(path, e))?;
    }
    Ok(files)
}

impl Table {
    /// An empty table of this process.
    pub fn new(name: &str, run_time: &str) -> Self {
        Self {
            name: name.to_owned(),
            command: command_line(),
            run_time: run_time.to_owned(),
            rows: Vec::new(),
        }
    }

    /// Table as JSON; numbers that are not finite become null.
    pub fn to_json(&self) -> Value {
        let row = |r: &Row| {
            let text = |(n, v): &(String, String)| (n.clone(), Value::from(v.as_str()));
            let number = |(n, v): &(String, f64)| (n.clone(), Value::from(*v));
            json!({
                "scene": r.scene,
                "method": r.method,
                "parameters": r.parameters.iter().map(text).collect::<Map<_, _>>(),
                "run_ms": r.run_ms,
                "errors": r.errors.iter().map(number).collect::<Map<_, _>>(),
            })
        };
        json!({
            "name": self.name,
            "command": self.command,
            "run_time": self.run_time,
            "rows": self.rows.iter().map(row).collect::<Vec<_>>(),
        })
    }

    /// Rows as a table of Markdown.
    pub fn to_markdown(&self) -> String {
        let parameters = names(self.rows.iter().flat_map(|r| &r.parameters));
        let errors = names(self.rows.iter().flat_map(|r| &r.errors));
        let mut head = vec!["scene", "method"];
        head.extend(parameters.iter().chain(&["run_ms"]).chain(&errors));
        let mut out = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
        for r in &self.rows {
            let mut cells = vec![r.scene.clone(), r.method.clone()];
            let value = |p: &&str| r.parameters.iter().find(|(n, _)| n == p);
            let number = |v: f64| format!("{v:.2}");
            cells.extend(
                (parameters.iter()).map(|p| value(p).map_or(String::new(), |(_, v)| v.clone())),
            );
            cells.push(number(r.run_ms));
            cells.extend(
                errors
                    .iter()
                    .map(|e| r.get(e).map_or(String::new(), number)),
            );
            out += &format!("| {} |\n", cells.join(" | "));
        }
        out
    }

    /// Writes `NAME.md` and `NAME.json` into `dir`, which is made when missing. Returns the files.
    ///
    /// # Errors
    /// Names the file that cannot be written.
    pub fn write(&self, dir: &Path) -> Result<[PathBuf; 2], EvaluateError> {
        write_report(dir, &self.name, self.to_markdown(), &self.to_json())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_hold_every_row_and_column_and_a_bad_folder_is_named() {
        let mut table = Table::new("trial", "one step");
        let row = |ms| Row::new("walk", "plane", ms);
        table.rows = vec![
            row(1.5).with("iterations", 2).error("joints_mm", 9.0),
            row(3.0).error("joints_mm", f64::NAN).error("lost", 2.0),
        ];
        let dir = tempfile::tempdir().expect("folder");
        let [markdown, json] = table.write(&dir.path().join("new")).expect("written");
        let text = std::fs::read_to_string(&markdown).expect("text");
        assert!(text.lines().all(|l| l.matches('|').count() == 7), "{text}");
        let text = std::fs::read_to_string(json).expect("text");
        let value: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(value["rows"][0]["errors"]["joints_mm"], 9.0);
        assert!(value["rows"][1]["errors"]["joints_mm"].is_null());
        let error = table.write(&markdown).expect_err("a file is no folder");
        assert!(error.to_string().contains("trial.md"), "{error}");
    }
}
